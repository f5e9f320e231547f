"""The largest motion of the tip."""

from __future__ import annotations

from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.objective import FeatureFunction, Objective
from pneumorph.problem import Maximize

_READERS = {
    "shift_x": lambda f: f.translation[0],
    "shift_y": lambda f: f.translation[1],
    "extension": lambda f: f.translation[2],
    "bending_x": lambda f: f.rotation[0],
    "bending_y": lambda f: f.rotation[1],
    "twist": lambda f: f.rotation[2],
}


TIP_MOTIONS = {name: Objective(read) for name, read in _READERS.items()}
"""The motions of the tip as functions of a state, in mm and rad."""


def build(asked: Maximize, scope: Scope) -> Objective:
    """See `Kind`."""
    return maximize(asked.motion)


def motion(name: str) -> FeatureFunction:
    """A motion of the end-effector: "shift_x", "shift_y" or "extension" in mm, a rotation about x, y or z in rad.

    With a minus sign, as in "-twist", the motion in the opposite direction.
    """
    sign = -1.0 if name.startswith("-") else 1.0
    read = _READERS[name.lstrip("+-")]
    return lambda f: sign * read(f)


def maximize(name: str) -> Objective:
    """The objective −`motion`, whose minimum is the largest motion (Remark 1 of the paper)."""
    measure = motion(name)
    return Objective(lambda f: -measure(f))
