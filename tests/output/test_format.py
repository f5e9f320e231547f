"""Sentences about results."""

from dataclasses import replace

from records import task_result
from tiny import tiny

from pneumorph.mechanics import rubbers_of
from pneumorph.output.format import balloons, stretches, warnings_of
from pneumorph.problem import loads


def test_why_a_result_cannot_be_trusted():
    rubbers = rubbers_of(loads(tiny()))
    assert warnings_of(rubbers, task_result()) == []
    (unstable,) = warnings_of(rubbers, task_result(stable=False))
    assert "not stable" in unstable
    (crossing,) = warnings_of(rubbers, task_result(self_intersecting=True))
    assert "self-intersects" in crossing and "[contact]" in crossing
    narrow = {name: replace(rubber, valid_stretch=2.0) for name, rubber in rubbers.items()}
    (stretched,) = warnings_of(narrow, task_result(max_stretch=2.5))
    assert "stretched to 2.50" in stretched


def test_how_near_a_state_is_to_ballooning():
    assert balloons({"A": 0.06}, 1.06) == "at 63.6 kPa it balloons, 1.06 times the working pressure"
    assert balloons({"A": 0.06, "B": 0.0}, 1.1) == "at A 66, B 0 kPa it balloons, 1.10 times the working pressures"


def test_stretch_beside_the_range_of_the_rubber():
    rubbers = rubbers_of(loads(tiny()))
    assert stretches(rubbers, task_result(max_stretch=1.52)) == "largest stretch 1.52"
    narrow = {name: replace(rubber, valid_stretch=2.5) for name, rubber in rubbers.items()}
    assert stretches(narrow, task_result(max_stretch=1.52)) == "largest stretch 1.52 (the rubber's data reach to 2.5)"
    (name,) = narrow
    two = narrow | {"cap": replace(rubbers[name], valid_stretch=3.0)}
    both = stretches(two, task_result(region_stretches={name: 1.52, "cap": 1.1}))
    assert f"{name} 1.52 (" in both and "cap 1.10 (" in both and "reach to 3)" in both
