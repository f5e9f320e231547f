"""Names of the plate's six components, used for springs, guides and blocked motions, and of motions in objectives."""

from collections.abc import Mapping
from typing import Any

from pneumorph.problem.table import InvalidKey

COMPONENT_OF = {"extension": "axial", "twist": "torsion"}
"""The component of the plate that belongs to a motion, where the two have different names."""

MOTION_OF = {component: motion for motion, component in COMPONENT_OF.items()}


def component_of(name: Any) -> Any:
    """The component that belongs to a motion's name; anything else unchanged."""
    return COMPONENT_OF.get(name, name) if isinstance(name, str) else name


MOTIONS = ("shift_x", "shift_y", "extension", "bending_x", "bending_y", "twist")
"""The motions of the tip: along x, y, z in mm, and about x, y, z in rad."""

PUSH = "push_"
"""Before the name of a motion: the force (N) or moment (N·mm) with which the plate pushes where this motion is held."""

PUSHES = tuple(PUSH + name for name in MOTIONS)


def is_turn(name: str) -> bool:
    """Whether a motion of the tip, or a component of the plate, is one about an axis."""
    return name.startswith("bending") or component_of(name) == "torsion"


POSE = ("x", "y", "z", "turn_x", "turn_y", "turn_z")
"""The motions of an obstacle: along x, y, z in mm, and components of its rotation vector in rad."""


def renamed(data: Any, names: Mapping[str, str]) -> Any:
    """A table with its keys by other names {accepted: own}; anything else unchanged.

    Raises
    ------
    InvalidKey
        If a key is given by both names.
    """
    if not isinstance(data, dict):
        return data
    for accepted, own in names.items():
        if accepted in data and own in data:
            raise InvalidKey(accepted, f"is the same as {own}; give only one of them")
    return {names.get(key, key) if isinstance(key, str) else key: value for key, value in data.items()}
