"""The largest motion of the tip."""

from typing import ClassVar, Literal

import numpy as np

from pneumorph.problem.objectives.of_motion import OfMotion
from pneumorph.problem.objectives.table import Asked
from pneumorph.problem.objectives.words import Amount, Result, motion_amount


class Maximize(OfMotion):
    """Objective: the largest motion of the tip along or about an axis; a minus sign reverses the direction.

    "extension" may also be written "axial", and "twist" "torsion", as for springs.
    """

    curve: ClassVar[str] = "motion of the tip"

    kind: Literal["maximize"] = "maximize"  # pyright: ignore[reportIncompatibleVariableOverride]
    """The kind of objective; "maximize" if it is left out."""

    @property
    def tip_motions(self) -> dict[str, float]:
        """See `ObjectiveTable.tip_motions`."""
        return {self.component: self.sign}

    @property
    def asked_motions(self) -> dict[str, Asked]:
        """See `ObjectiveTable.asked_motions`."""
        return {self.component: Asked("motion", self.sign)}

    def bends(self, length: float) -> np.ndarray:
        """See `ObjectiveTable.bends`."""
        return np.array([self.component in ("bending_x", "shift_y"), self.component in ("bending_y", "shift_x")], float)

    def achieved(self, result: Result) -> Amount:
        """The motion."""
        return motion_amount(self.component, self.sign, result)
