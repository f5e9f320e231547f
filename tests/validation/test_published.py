"""Published measurements: their files, the derivative of a lifted load, and what is said of differences."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.interpolate import CubicSpline

from pneumorph.output.compared import compared_figure, csv_lines, grouped, markdown, points, row
from pneumorph.problem import load
from pneumorph.problem.scaled import scaled
from pneumorph.validation import Comparison, disc
from pneumorph.validation.beam import measured
from pneumorph.validation.disc import Lift, lifted
from pneumorph.validation.tables import PUBLISHED, problem_of, table_of


def comparison(predicted, fitted=(False, False, False), missing="") -> Comparison:
    at, bars = np.array([1.0, 2.0, 3.0]), np.array([0.3, 0.3, 0.3])
    values, free = np.array(predicted), np.array(fitted)
    return Comparison("beam", "soft", "deflection", "mm", "", "load, N", at, at, bars, values, bars, free, missing)


def test_differences_are_those_of_points_that_were_not_fitted():
    one = comparison([9.0, 2.6, 4.0], fitted=(True, False, False))
    assert one.rms == pytest.approx(np.sqrt((0.6**2 + 1.0) / 2))
    assert one.normalised == pytest.approx(one.rms / 3.0)
    assert one.within == 1, "2 √(0.3² + 0.3²) is 0.85"


def test_a_curve_without_points_says_why():
    empty = np.zeros(0)
    one = Comparison(
        "disc", "soft", "pressure", "kPa", "", "height, mm", *[empty] * 5, fitted=empty.astype(bool), missing="it folds"
    )
    assert one.rms is None and one.normalised is None
    assert "it folds" in markdown([one]) and not grouped([one]) and len(list(csv_lines([one]))) == 1


def test_a_measurement_without_a_stated_deviation_has_none():
    one = comparison([1.0, 2.5, 3.5])
    assert row(one)[6] == "0.3 mm" and "1 ± 0.3" in list(points(one))[1]
    exact = replace(one, scatter=np.zeros(3))
    assert row(exact)[6] == "–"
    told = list(points(exact))[1]
    assert told.split() == ["1", "1", "1", "±", "0.3"]


def test_points_are_drawn_with_bars_of_two_deviations():
    axes = compared_figure([comparison([1.0, 2.5, 3.5])]).axes[0]
    (band,) = axes.collections[:1]
    assert band.get_paths()[0].vertices[:, 1].max() == pytest.approx(3.5 + 0.6)


def test_the_beam_hangs_down_further_with_more_load():
    known = measured()
    values = [known[case][0] for case in ("gravity", "load52", "load101")]
    # Of two runs and two markers: 6.64, 6.52, 6.72 and 6.59 mm down, and the mount 0.12 mm in the mean.
    assert values[0] == pytest.approx(6.6175 - 0.1217, abs=1e-3)
    assert values == sorted(values) and all(half > 0.0 for _, half in known.values())


@pytest.mark.parametrize("path", sorted(PUBLISHED.glob("*.toml")), ids=lambda path: path.stem)
def test_a_frozen_problem_has_a_rubber_with_its_source(path):
    problem = load(path)
    assert problem.material.source and problem.material.scatter
    assert path.stem.split("_")[0] in ("arm", "balloon", "beam", "disc", "ringed")


def test_every_load_of_the_disc_was_measured():
    loads = {-task.force[2] for task in problem_of("disc", "first_pull", 12.0).task}
    assert loads == set(np.unique(table_of("disc")["force_N"]))


def test_blind_predictions_of_ringed_discs_have_bars_of_all_their_parts():
    table = table_of("ringed_predicted")
    loads = {-task.force[2] for task in problem_of("disc", "tension_tests", 12.0).task}
    assert {*zip(table["disc"], table["force_N"], table["height_mm"], strict=True)} == {
        (disc, load, height) for disc in range(1, 7) for load in loads for height in (10.0, 20.0, 30.0, 40.0)
    }
    parts = np.stack([table[f"{part}_kPa"] for part in ("rubber", "thickness", "load", "mesh")])
    np.testing.assert_allclose(np.linalg.norm(parts, axis=0), table["deviation_kPa"], atol=2e-4)
    pressure, twice = table["pressure_kPa"], 2 * table["deviation_kPa"]
    np.testing.assert_allclose(pressure - np.hypot(twice, table["soft_fabric_kPa"]), table["low_kPa"], atol=3e-4)
    np.testing.assert_allclose(pressure + np.hypot(twice, table["stiff_fabric_kPa"]), table["high_kPa"], atol=3e-4)


def test_the_mesh_s_part_is_what_elements_of_half_the_size_change(monkeypatch):
    heights = np.array([0.0, 100.0])

    def pressed(problem, task, volumes, until):
        return Lift(heights, np.full(2, 3e-3 + 1e-5 * problem.mesh.size), np.full(2, 2e-3), "")

    monkeypatch.setattr(disc, "lifted", pressed)
    first = next(disc.discs())
    assert len(first.at) == 6
    assert first.predicted == pytest.approx(3.0 + 0.01 * disc.SIZE / 2)
    assert first.error == pytest.approx(np.hypot(2.0 * np.hypot(0.1, disc.THICKNESS), 0.01 * disc.SIZE / 2))


@pytest.mark.slow
def test_pressures_at_a_height_change_with_the_moduli_as_derived():
    problem, more = problem_of("disc", "tension_tests", 12.0), 0.02
    stiffer = scaled(problem.material, 1 + more, name="stiffer", source="a test")
    task = problem.task[0].model_copy(update={"force": (0.0, 0.0, -2.0)})
    volumes = np.linspace(120e3, 160e3, 3)
    lifts = [lifted(each, task, volumes, 60.0) for each in (problem, problem.model_copy(update={"material": stiffer}))]
    one, other = lifts
    height = one.heights[1]
    change = CubicSpline(other.heights, other.pressures)(height) - one.pressures[1]
    assert change / np.log(1 + more) == pytest.approx(one.by_moduli[1], rel=0.03)
