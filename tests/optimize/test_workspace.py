"""The workspace that the tips of several tasks span."""

import numpy as np
import pytest
from designing import BRIEFLY, accepted, analysed
from tiny import tiny

from pneumorph.analysis import analyse
from pneumorph.analysis.slopes import design_gradient
from pneumorph.analysis.workspace import _hull
from pneumorph.errors import ProblemError
from pneumorph.mechanics import TOLERANCE
from pneumorph.optimize import design
from pneumorph.problem import Problem, loads
from pneumorph.sensitivity import taylor_test


def asked(axes: list[str], pressures: list[int]) -> Problem:
    """A tube with a chamber off its axis, at several pressures, of which the last is designed."""
    table = loads(tiny(iterations="2")).model_dump(mode="json", exclude_none=True)
    table["body"]["chamber"][0]["center"] = ["1 mm", "0.5 mm"]
    table["end_effector"] = {}
    table["limits"] |= {"margin": 1, "strain": "off"}
    table["task"] = [
        {"name": f"at_{p}", "pressure": {"A": f"{p} kPa"}, "objective": {"kind": "workspace", "axes": axes}}
        for p in pressures
    ]
    table["task"][-1]["pressure"] = {"A": {"start": f"{pressures[-1]} kPa", "min": "0 kPa", "max": "100 kPa"}}
    return Problem.model_validate(table)


CASES = {"length": asked(["x"], [0, 30, 50]), "area": asked(["x", "z"], [-20, 0, 60])}


@pytest.mark.parametrize("problem", CASES.values(), ids=list(CASES))
def test_the_gradient_is_exact(problem):
    space, disc, found = analysed(problem)
    slope = design_gradient(problem, space, disc, found)
    starts = {name: each.state for name, each in found.equilibria.items()}
    shape = np.arange(space.n) < space.n_shape
    direction = np.where(shape, np.random.default_rng(1).uniform(-0.2, 0.2, space.n), 0.3)

    def value(phi):
        return analyse(problem, space, disc, phi, starts, tolerance=TOLERANCE).value

    test = taylor_test(value, space.start, slope, direction, 0.2, count=3, start=found.value)
    assert abs(test.rate - 2.0) < 0.02, test


def test_it_grows_from_design_to_design():
    entries = [event.entry for event in accepted(design(CASES["length"], settings=BRIEFLY))]
    assert entries[-1].objective < entries[0].objective
    tips = [entry.tasks[name].translation[0] for entry in entries[-1:] for name in ("at_0", "at_30", "at_50")]
    assert entries[-1].tasks["at_0"].objective == pytest.approx(-np.ptp(tips))


@pytest.mark.parametrize(
    "points, size",
    [
        ([[0.0], [3.0], [1.0]], 3.0),
        ([[0.0, 0.0], [2.0, 0.0], [2.0, 1.0], [0.0, 1.0], [1.0, 0.5]], 2.0),
        ([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0.2, 0.2, 0.2]], 1 / 6),
    ],
)
def test_the_hull_and_its_derivatives(points, size):
    points = np.array(points)
    value, slope = _hull(points)
    assert value == pytest.approx(size)
    way = np.random.default_rng(2).uniform(-1.0, 1.0, points.shape)
    step = 1e-5
    assert (_hull(points + step * way)[0] - _hull(points - step * way)[0]) / (2 * step) == pytest.approx(
        (slope * way).sum(), rel=1e-8
    )
    assert not slope[-1].any(), "the last point is within"


def test_tasks_that_span_nothing_are_refused():
    with pytest.raises(ProblemError, match=r"task\[0\]\.objective\.kind"):
        asked(["x", "z"], [0, 50])
