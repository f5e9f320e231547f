"""Sweeps as tables and as pictures."""

import csv
import io

import matplotlib.pyplot as plt
import numpy as np
import pytest

from pneumorph.output import curves as drawing
from pneumorph.output.curves import draw_curves
from pneumorph.output.sweeps import Curve, csv_text


def step(pressures, angle=0.5, force=None):
    """A step as the JSON has it: bends about y, pulls nowhere else."""
    total = sum(pressures.values())
    return {
        "task": "t",
        "pressure_MPa": pressures,
        "translation_mm": [40 * total, 1e-4 * total, 100 * total],
        "rotation_rad": [0.0, angle * total / 0.06, 1e-6],
        "reaction": {} if force is None else {"axial": force * total, "torsion": -200 * total},
        "volume_mm3": {name: 4000.0 + 1e4 * pressure for name, pressure in pressures.items()},
        "max_stretch": 1.0 + total,
        "beyond_validity": False,
        "converged": True,
    }


def missing(pressures):
    nothing = dict.fromkeys(
        ("translation_mm", "rotation_rad", "reaction", "volume_mm3", "max_stretch", "beyond_validity")
    )
    return {"task": "t", "pressure_MPa": pressures, **nothing, "converged": False, "reason": "it balloons, says A"}


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


@pytest.fixture
def drawn(monkeypatch, tmp_path):
    """Draw sweeps; the figure with its axes by title."""

    def draw(curves, title=""):
        kept = []

        class Kept(drawing.Figure):
            def __init__(self, *arguments, **options):
                super().__init__(*arguments, **options)
                kept.append(self)

        monkeypatch.setattr(drawing, "Figure", Kept)
        draw_curves(tmp_path / "curves.png", curves, title)
        picture = plt.imread(tmp_path / "curves.png")
        assert picture.shape[0] > 300 and picture.std() > 0.01
        return kept[0], {axes.get_title(): axes for axes in kept[0].axes if axes.get_title()}

    return draw


def words(legend):
    return [text.get_text() for text in legend.get_texts()]


def test_one_sweep(drawn):
    _, panels = drawn([ONE], "blocked")
    assert list(panels) == [
        "translation of the tip", "rotation of the tip", "force on what holds the tip", "torque on what holds the tip",
        "volume of the chambers", "largest stretch",
    ]  # fmt: skip
    motion = panels["translation of the tip"]
    assert words(motion.get_legend()) == ["along x", "along z", "no equilibrium beyond"]
    assert motion.get_xlabel() == "pressure in A, kPa" and motion.get_ylabel() == "mm"
    along_z = motion.lines[2]
    assert along_z.get_xdata() == pytest.approx([0, 20, 40, 60])
    assert along_z.get_ydata() == pytest.approx([0, 2, 4, 6])


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
