"""A given motion of a free obstacle."""

from collections.abc import Iterator
from typing import Annotated, Literal

from pydantic import model_validator

from pneumorph.problem.components import POSE
from pneumorph.problem.names import Name
from pneumorph.problem.objectives.table import (
    Angle,
    Fault,
    Known,
    Length,
    ObjectiveTable,
    Weight,
    given_motions,
    require_motion,
)
from pneumorph.problem.table import Example


class TargetPose(ObjectiveTable):
    """Objective: a free obstacle is moved and rotated by these amounts; motions without a target are free.

    The weights are those of the squared differences in length (1/mm²) and in angle (1/rad²).
    """

    kind: Literal["pose"]
    """The kind of objective."""
    obstacle: Annotated[Name, Example('the name of a free obstacle, e.g. obstacle = "ball"')]
    """Name of the obstacle, which has a table `free`."""
    x: Length | None = None
    """Displacement of its reference point along x."""
    y: Length | None = None
    """The same along y."""
    z: Length | None = None
    """The same along z."""
    turn_x: Angle | None = None
    """Component of its rotation vector about x."""
    turn_y: Angle | None = None
    """The same about y."""
    turn_z: Angle | None = None
    """The same about z."""
    position_weight: Weight = 0.01
    """Weight of the squared lengths, 1/mm²."""
    rotation_weight: Weight = 1.0
    """Weight of the squared angles, 1/rad²."""

    @model_validator(mode="after")
    def _has_a_target(self) -> "TargetPose":
        weights = self.position_weight, self.rotation_weight
        require_motion(self.targets, weights, POSE[:3], 'z = "5 mm"')
        return self

    def weight_of(self, motion: str) -> float:
        """The weight of a motion's squared difference."""
        return self.position_weight if motion in POSE[:3] else self.rotation_weight

    @property
    def targets(self) -> dict[str, float]:
        """The motions that are given, in mm and rad, in the order of `POSE`."""
        return given_motions(self, POSE)

    @property
    def touched(self) -> str:
        """See `ObjectiveTable.touched`."""
        return self.obstacle

    def inconsistencies(self, known: Known) -> Iterator[Fault]:
        """See `ObjectiveTable.inconsistencies`."""
        if self.obstacle not in known.free:
            others = f"the free ones are {', '.join(known.free)}" if known.free else "give one a table free"
            yield "obstacle", f'there is no free obstacle "{self.obstacle}"; {others}'
