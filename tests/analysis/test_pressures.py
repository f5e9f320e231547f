"""Pressures as users write them."""

import pint
import pytest

from pneumorph.analysis.pressures import pressure_paths
from pneumorph.errors import ProblemError


def path_of(chambers=("A", "B"), **given):
    """The pressures of the only sweep, at every step."""
    (only,) = pressure_paths(given, chambers)
    return only.steps


def test_pressures():
    assert path_of() == [{}]
    assert path_of(A="60kPa") == [{"A": 0.06}]
    assert path_of(A=pint.UnitRegistry().Quantity(60, "kPa")) == [{"A": 0.06}]
    path = path_of(A="0:0.1:0.05 bar", B="10 kPa")
    assert path == [{"B": 0.01, "A": pytest.approx(pressure)} for pressure in (0.0, 0.005, 0.01)]
    assert [step["A"] for step in path_of(A="60:-0:-20kPa")] == pytest.approx([0.06, 0.04, 0.02, 0.0])
    together = path_of(A="0:60:20kPa", B="60:0:-20kPa")
    assert together[1] == {"A": pytest.approx(0.02), "B": pytest.approx(0.04)}


def test_one_by_one():
    paths = pressure_paths({"A": "0:60:20kPa", "B": "10:20:10kPa", "C": "5kPa"}, ("A", "B", "C"), one_by_one=True)
    assert [path.swept for path in paths] == [("A",), ("B",)]
    assert [step["A"] for step in paths[0].steps] == pytest.approx([0.0, 0.02, 0.04, 0.06])
    assert all(step["B"] == pytest.approx(0.01) for step in paths[0].steps)
    assert [step["B"] for step in paths[1].steps] == pytest.approx([0.01, 0.02])
    assert all(step["A"] == 0.0 and step["C"] == 0.005 for step in paths[1].steps)
    with pytest.raises(ProblemError, match="no chamber is swept"):
        pressure_paths({"A": "5kPa"}, ("A",), one_by_one=True)


@pytest.mark.parametrize("asked", ["", "0:60kPa", "0:60:0kPa", "0:60:-5kPa", "0:60:5mm", "0:60:1e-9kPa", 60, None])
def test_values_that_are_not_pressures(asked):
    with pytest.raises(ProblemError, match=r"^pressure A="):
        pressure_paths({"A": asked}, ("A",))


def test_an_unknown_chamber():
    with pytest.raises(ProblemError, match='no chamber "C"; use one of A'):
        pressure_paths({"C": "1 kPa"}, ("A",))


def test_sweeps_of_different_lengths():
    with pytest.raises(ProblemError, match=r"different numbers of steps.*one by one"):
        path_of(A="0:60:20kPa", B="0:60:30kPa")
