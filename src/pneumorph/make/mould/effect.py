"""How much tubes in the ports change the motion of the body, as reported and checked."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.make.checks import Check


@dataclass(frozen=True)
class PortEffect:
    """The motion of the tip in a task, and how much tubes change it.

    Attributes
    ----------
    task : str
    moved, turned : float
        Magnitudes of the tip's displacement, mm, and of its rotation vector, radians, without tubes.
    shift, turn : float
        Magnitudes of the changes of both.
    length : float
        Of the body, mm. Rotations are compared with displacements by multiplying them with it.
    """

    task: str
    moved: float
    turned: float
    shift: float
    turn: float
    length: float

    @property
    def relative(self) -> float:
        """The change relative to the motion."""
        motion = np.hypot(self.moved, self.length * self.turned)
        return float(np.hypot(self.shift, self.length * self.turn) / max(motion, 1e-12))

    @property
    def sentence(self) -> str:
        """The change in words, for the assembly sheet."""
        return (
            f"Tubes in the ports change the motion of task {self.task}: its translation of {self.moved:.3g} mm by "
            f"{self.shift:.2g} mm, and its rotation of {np.degrees(self.turned):.3g}° by {np.degrees(self.turn):.2g}°."
        )

    def check(self, most: float) -> Check:
        """Whether the change is within a fraction of the motion."""
        return Check("body", f"change of the motion by tubes in the ports, task {self.task}", self.relative, most)
