"""Names of the plate's motions: components of springs, guides and blocks, and the motions that objectives name."""

from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

COMPONENT_OF = {"extension": "axial", "twist": "torsion"}
"""The component of the plate that a motion is of, where their names differ."""

MOTION_OF = {component: motion for motion, component in COMPONENT_OF.items()}


def component_of(name: Any) -> Any:
    """The component that a motion's name stands for; anything else as it is."""
    return COMPONENT_OF.get(name, name) if isinstance(name, str) else name


Component = Annotated[
    Literal["shift_x", "shift_y", "axial", "bending_x", "bending_y", "torsion"], BeforeValidator(component_of)
]
