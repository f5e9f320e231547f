"""The limits of a problem beside the values in its history lines."""

from __future__ import annotations

from dataclasses import dataclass

from pneumorph.problem import Limits


@dataclass(frozen=True)
class Bound:
    """What a value of the history's ``limits`` has to keep.

    Attributes
    ----------
    key, word : in the history, and for people.
    bound : in mm, 1/mm² or 1.
    at_least : whether the value must not be below the bound; else it must not be above.
    tolerance : the part of the bound by which the limit report lets it be passed.
    """

    key: str
    word: str
    bound: float
    at_least: bool
    tolerance: float

    def used(self, value: float) -> float:
        """How much of the limit a value uses: 1 is right at it, more is beyond."""
        return self.bound / max(value, 1e-12) if self.at_least else value / self.bound

    def passed(self, value: float) -> float:
        """By which part of the bound a value is beyond it; negative where it is within."""
        return (self.bound - value if self.at_least else value - self.bound) / self.bound


def bounds(limits: Limits) -> list[Bound]:
    """All bounds, in the order they are shown."""
    found = [
        Bound("wall_mm", "wall", limits.wall, True, 0.01),
        Bound("fold_mm", "fold", limits.fold.distance, True, 0.01),
        Bound("curvature", "curvature", limits.curvature, False, 0.03),
        Bound("skew", "skew", limits.skew, False, 0.03),
        Bound("stretch", "stretch", limits.stretch.limit, False, 0.03),
    ]
    if limits.envelope is not None:
        found.append(Bound("envelope_mm", "envelope", limits.envelope.radius, False, 0.01))
    return found
