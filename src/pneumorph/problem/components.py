"""Names of the plate's six components, used for springs, guides and blocked motions, and of motions in objectives."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

COMPONENT_OF = {"extension": "axial", "twist": "torsion"}
"""The component of the plate that belongs to a motion, where the two have different names."""

MOTION_OF = {component: motion for motion, component in COMPONENT_OF.items()}


def component_of(name: Any) -> Any:
    """The component that belongs to a motion's name; anything else unchanged."""
    return COMPONENT_OF.get(name, name) if isinstance(name, str) else name


Component = Annotated[
    Literal["shift_x", "shift_y", "axial", "bending_x", "bending_y", "torsion"], BeforeValidator(component_of)
]
