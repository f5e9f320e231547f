"""Sweeps as tables and as pictures."""

import csv
import io
from dataclasses import replace

import matplotlib.pyplot as plt
import numpy as np
import pytest

from pneumorph.analysis import Curve
from pneumorph.output.curves import curves_figure
from pneumorph.output.figures import save
from pneumorph.output.sweeps import csv_text, table
from pneumorph.results import SweepStep


def step(pressures, angle=0.5, force=None):
    """Bends about y, pulls nowhere else."""
    total = sum(pressures.values())
    return SweepStep(
        task="t",
        pressures=pressures,
        translation=(40 * total, 1e-4 * total, 100 * total),
        rotation=(0.0, angle * total / 0.06, 1e-6),
        reaction={} if force is None else {"axial": force * total, "torsion": -200 * total},
        volumes={name: 4000.0 + 1e4 * pressure for name, pressure in pressures.items()},
        max_stretch=1.0 + total,
        stable=True,
    )


def missing(pressures):
    return SweepStep("t", pressures, converged=False, reason="it balloons, says A")


PRESSURES = [0.0, 0.02, 0.04, 0.06]
ONE = Curve("t", ("A",), [step({"A": p}, force=50.0) for p in PRESSURES] + [missing({"A": 0.08})])


def test_the_table_has_units_in_its_header_and_every_step():
    header, *rows = csv.reader(io.StringIO(csv_text([ONE], ["A"])))
    assert header == [
        "task", "swept", "pressure_A_kPa", "translation_x_mm", "translation_y_mm", "translation_z_mm", "rotation_x_deg",
        "rotation_y_deg", "rotation_z_deg", "reaction_axial_N", "reaction_torsion_N_mm", "volume_A_mm3", "max_stretch",
        "beyond_validity", "converged", "reason",
    ]  # fmt: skip
    assert all(len(row) == len(header) for row in rows)
    last = dict(zip(header, rows[3], strict=True))
    assert float(last["pressure_A_kPa"]) == 60.0
    assert float(last["rotation_y_deg"]) == pytest.approx(np.degrees(0.5))
    assert float(last["reaction_axial_N"]) == pytest.approx(3.0)
    failed = dict(zip(header, rows[4], strict=True))
    assert (failed["converged"], failed["reason"], failed["max_stretch"]) == ("false", "it balloons, says A", "")


def test_what_was_not_found_is_no_number():
    header, rows = table([ONE], ["A"])
    failed = dict(zip(header, rows[4], strict=True))
    assert np.isnan([failed["translation_x_mm"], failed["reaction_axial_N"], failed["volume_A_mm3"]]).all()
    assert failed["converged"] is False


def test_the_pull_on_a_plate_is_in_the_table():
    held = replace(ONE.steps[1], contact={"plate": (0.0, 0.0, 2.0)}, contact_normal={"plate": 2.0}, pull={"plate": 6.5})
    header, rows = table([Curve("t", ("A",), [held, missing({"A": 0.08})])], ["A"])
    assert rows[0][header.index("pull_plate_N")] == 6.5
    assert np.isnan(rows[1][header.index("pull_plate_N")])


def test_what_is_filled_in_is_known_of_steps_without_a_state_too():
    held = [replace(step({"A": 0.01 * number}), filled={"A": 100.0 * number}) for number in range(3)]
    curve = Curve("t", ("volume A",), [*held, replace(missing({}), filled={"A": 300.0})])
    header, rows = table([curve], ["A"])
    assert header[2:4] == ["pressure_A_kPa", "filled_A_mm3"]
    assert [row[3] for row in rows] == [0.0, 100.0, 200.0, 300.0]
    assert rows[2][2] == pytest.approx(20.0) and np.isnan(rows[3][2]), "its pressure is not known"
    axes = curves_figure([curve], "").axes[0]
    assert axes.get_xlabel() == "volume filled into A, ml" and axes.get_xlim()[1] > 0.3


@pytest.fixture
def drawn(tmp_path):
    """Draw sweeps; the figure with its axes by title."""

    def draw(curves, title=""):
        figure = curves_figure(curves, title)
        save(figure, tmp_path / "curves.png")
        picture = plt.imread(tmp_path / "curves.png")
        assert picture.shape[0] > 300 and picture.std() > 0.01
        return figure, {axes.get_title(): axes for axes in figure.axes if axes.get_title()}

    return draw


def words(legend):
    return [text.get_text() for text in legend.get_texts()]


def test_one_sweep(drawn):
    figure, panels = drawn([ONE], "blocked")
    assert list(panels) == [
        "translation of the tip", "rotation of the tip", "blocked force of the tip", "blocked torque of the tip",
        "volume of the chambers", "largest stretch",
    ]  # fmt: skip
    motion = panels["translation of the tip"]
    assert words(motion.get_legend()) == ["along x", "along z"]
    assert words(figure.legends[0]) == ["no equilibrium found from here on"]
    assert motion.get_xlim()[1] > 80
    assert motion.get_xlabel() == "pressure in A, kPa" and motion.get_ylabel() == "mm"
    along_z = motion.lines[1]
    assert along_z.get_xdata() == pytest.approx([0, 20, 40, 60])
    assert along_z.get_ydata() == pytest.approx([0, 2, 4, 6])


def test_a_line_at_the_limit_pressure(drawn):
    end = SweepStep("t", {"A": 0.12}, converged=False, reason="it balloons", limit={"A": 0.0712})
    figure, panels = drawn([Curve("t", ("A",), [*ONE.found, end])])
    motion = panels["translation of the tip"]
    assert "71.2 kPa" in words(figure.legends[0])[0]
    assert any(line.get_xdata() == pytest.approx([71.2, 71.2]) for line in motion.lines)
    assert motion.get_xlim()[1] > 120


def test_sweeps_one_by_one(drawn):
    """A colour for each, named below; what does not move is left out, with its panel where nothing else is in it."""
    both = [
        Curve("t", ("A",), [step({"A": p, "B": 0.0}, angle=0.0) for p in PRESSURES]),
        Curve("t", ("B",), [step({"A": 0.0, "B": p}, angle=0.0) for p in PRESSURES]),
    ]
    figure, panels = drawn(both)
    assert list(panels) == ["translation of the tip", "volume of the chambers", "largest stretch"]
    assert words(figure.legends[0]) == ["A swept", "B swept"]
    assert panels["largest stretch"].get_xlabel() == "pressure of the swept chamber, kPa"
