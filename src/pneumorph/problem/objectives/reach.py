"""A position and an orientation of the plate."""

from collections.abc import Iterator, Sequence
from typing import Literal

import numpy as np
from pydantic import model_validator

from pneumorph.problem.objectives.bending import LEAST, longer
from pneumorph.problem.objectives.table import Fault, Known, ObjectiveTable, Position, RotationVector, Weight, unchanged
from pneumorph.problem.table import InvalidKey

HALF_TURN = np.pi - 1e-6


class Reach(ObjectiveTable):
    """Objective: the plate reaches a position (centre, from the base centre) and an orientation (rotation vector).

    The weights are those of the squared distance (1/mm²) and of the squared angle (1/rad²).
    """

    kind: Literal["reach"]
    """The kind of objective."""
    position: Position | None = None
    """Position of the plate's centre relative to the centre of the base."""
    rotation: RotationVector | None = None
    """Rotation vector of the plate."""
    position_weight: Weight = 0.01
    """Weight of the squared distance, 1/mm²."""
    rotation_weight: Weight = 1.0
    """Weight of the squared angle, 1/rad²."""

    @model_validator(mode="after")
    def _has_a_target(self) -> "Reach":
        if self.position is None and self.rotation is None:
            raise InvalidKey(
                "position", 'is missing, and so is rotation; give one, e.g. position = ["0 mm", "20 mm", "70 mm"]'
            )
        # At half a turn both senses of rotation are equally far, and the gradient does not exist.
        if self.rotation is not None and np.linalg.norm(self.rotation) > HALF_TURN:
            raise InvalidKey("rotation", "is a turn by 180° or more; give one of less than half a turn")
        places = self.position is not None and self.position_weight > 0
        if not places and not (self.rotation is not None and self.rotation_weight > 0):
            raise InvalidKey(
                "position_weight", "leaves no target with a weight; give position or rotation a positive weight"
            )
        return self

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `ObjectiveTable.keeps`."""
        return (self.position is None or unchanged(self.position, polar)) and (
            self.rotation is None or unchanged(self.rotation, axial)
        )

    def inconsistencies(self, known: Known) -> Iterator[Fault]:
        """See `ObjectiveTable.inconsistencies`."""
        if not known.plate:
            yield (
                "kind",
                'reach is a target for the plate, but the tip is free; use end_effector.kind = "plate"',
            )

    def bends(self, length: float) -> np.ndarray | None:
        """See `ObjectiveTable.bends`."""
        turned = None if self.rotation is None else longer(np.array(self.rotation[:2]), LEAST)
        if turned is None and self.position is not None:
            return longer(np.array([-self.position[1], self.position[0]]), LEAST * length)
        return turned
