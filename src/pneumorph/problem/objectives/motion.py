"""Given motions of the tip."""

from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from pydantic import model_validator

from pneumorph.problem.components import MOTION_OF, MOTIONS, renamed
from pneumorph.problem.objectives.bending import LEAST, longer
from pneumorph.problem.objectives.table import (
    Angle,
    Asked,
    Length,
    ObjectiveTable,
    Weight,
    given_motions,
    require_motion,
)
from pneumorph.problem.objectives.words import Amount, Result, motion_amount


class TargetMotion(ObjectiveTable):
    """Objective: the tip moves by these amounts along and about the axes; motions without a target are free.

    The weights are those of the squared differences in length (1/mm²) and in angle (1/rad²). "extension" may also be
    written "axial", and "twist" "torsion", as for springs.
    """

    kind: Literal["motion"]
    """The kind of objective."""
    shift_x: Length | None = None
    """Motion of the tip along x."""
    shift_y: Length | None = None
    """Motion of the tip along y."""
    extension: Length | None = None
    """Motion of the tip along z."""
    bending_x: Angle | None = None
    """Rotation of the tip about x; positive is towards -y."""
    bending_y: Angle | None = None
    """Rotation of the tip about y; positive is towards +x."""
    twist: Angle | None = None
    """Rotation of the tip about z; positive is counter-clockwise, viewed from the tip."""
    position_weight: Weight = 0.01
    """Weight of the squared lengths, 1/mm²."""
    rotation_weight: Weight = 1.0
    """Weight of the squared angles, 1/rad²."""

    @model_validator(mode="before")
    @classmethod
    def _by_the_names_of_springs(cls, data: Any) -> Any:
        return renamed(data, MOTION_OF)

    @model_validator(mode="after")
    def _has_a_target(self) -> "TargetMotion":
        weights = self.position_weight, self.rotation_weight
        require_motion(self.targets, weights, MOTIONS[:3], 'bending_y = "60 deg"')
        return self

    @property
    def targets(self) -> dict[str, float]:
        """The motions that are given, in mm and rad, in the order of `MOTIONS`."""
        return given_motions(self, MOTIONS)

    @property
    def tip_motions(self) -> dict[str, float]:
        """See `ObjectiveTable.tip_motions`."""
        return dict.fromkeys(self.targets, 1.0)

    def weight_of(self, motion: str) -> float:
        """The weight of a motion's squared difference."""
        return self.position_weight if motion in MOTIONS[:3] else self.rotation_weight

    @property
    def asked_motions(self) -> dict[str, Asked]:
        """See `ObjectiveTable.asked_motions`."""
        targets = self.targets.items()
        return {motion: Asked(motion, value) for motion, value in targets if value and self.weight_of(motion)}

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `ObjectiveTable.keeps`; where a motion should be zero, its sign does not matter."""
        signs: dict[str, float] = dict(zip(MOTIONS, (*polar, *axial), strict=True))
        return all(signs[motion] > 0 or value == 0 for motion, value in self.targets.items())

    def bends(self, length: float) -> np.ndarray | None:
        """See `ObjectiveTable.bends`."""
        turned = longer(np.array([self.bending_x or 0.0, self.bending_y or 0.0]), LEAST)
        sideways = np.array([-(self.shift_y or 0.0), self.shift_x or 0.0])
        return turned if turned is not None else longer(sideways, LEAST * length)

    def achieved(self, result: Result) -> Amount:
        """The motion if there is only one, else the first distance from the target."""
        if len(self.targets) > 1:
            return super().achieved(result)
        ((name, wanted),) = self.targets.items()
        done = motion_amount(name, 1.0, result)
        return done._replace(target=float(np.degrees(wanted)) if done.unit == "°" else wanted)
