"""What may be minimised of the tip that is no function of a state alone: its stiffness, and the force that holds it.

`sensitivity/whole.py` has their values and derivatives, for which the tangent or the residual is needed.
"""

from __future__ import annotations

from dataclasses import dataclass

from pneumorph.problem.components import MOTIONS


@dataclass(frozen=True)
class TipStiffness:
    """`sign` times the force per motion of the tip, by a force or moment that does work on this motion alone.

    All other motions of the tip are free.
    """

    motion: str
    sign: float


@dataclass(frozen=True)
class HeldForce:
    """`sign` times the force or moment with which the whole body pushes where a motion of its plate is held."""

    motion: str
    sign: float

    @property
    def number(self) -> int:
        """Of the plate's six components."""
        return MOTIONS.index(self.motion)
