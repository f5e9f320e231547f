"""Sentences about results."""

from dataclasses import replace

from records import task_result
from tiny import tiny

from pneumorph.mechanics import rubbers_of
from pneumorph.output.format import warnings_of
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
