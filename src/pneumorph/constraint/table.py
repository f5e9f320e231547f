"""The table of limits: everything that is said of one, once."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

from pneumorph.constraint.surface import MIN_AREA

if TYPE_CHECKING:
    from pneumorph.problem import Limits


@dataclass(frozen=True)
class Limit:
    """One limit of a design.

    Attributes
    ----------
    name : str
        As among the optimiser's values, and of the report's readings.
    word : str
        The name users see; limits of the same name are shown as one.
    unit : "mm", "/mm²" or ""
    at_least : bool
        Whether the quantity must not be below its bound; else it must not be above.
    tolerance : float
        Part of the bound by which a design may pass it and still hold the limit (of a millimetre where it is zero).
    key : str or None
        In the history's ``limits``; None where the history has no line of its own for it.
    read : function of `problem.Limits`
        Its bound in mm, 1/mm² or 1; None where the problem has no such limit.
    per : "wall", "fold" or None
        The limit distance that the optimiser's values are relative to; None where they are relative to the bound.
    """

    name: str
    word: str
    unit: str
    at_least: bool
    tolerance: float
    key: str | None
    read: Callable[[Limits], float | None]
    per: Literal["wall", "fold"] | None = None

    def excess(self, value: float, bound: float) -> float:
        """By which part of the bound a value is beyond it (in mm where the bound is zero); negative where within."""
        return (bound - value if self.at_least else value - bound) / (bound or 1.0)

    def used(self, value: float, bound: float) -> float:
        """How much of the limit a value uses: 1 is right at it, more is beyond."""
        return bound / max(value, 1e-12) if self.at_least else value / bound


def _envelope(limits: Limits) -> float | None:
    return limits.envelope.radius if limits.envelope else None


TABLE = (
    Limit("wall", "wall", "mm", True, 0.005, "wall_mm", lambda limits: limits.wall, "wall"),
    Limit("planes", "wall", "mm", True, 0.005, None, lambda limits: limits.wall, "wall"),
    Limit("fold", "fold", "mm", True, 0.005, "fold_mm", lambda limits: limits.fold.distance, "fold"),
    Limit("rim", "fold", "mm", True, 0.005, None, lambda limits: limits.fold.distance, "fold"),
    Limit("curvature", "curvature", "/mm²", False, 0.01, "curvature", lambda limits: limits.curvature),
    Limit("skew", "skew", "", False, 0.01, "skew", lambda limits: limits.skew),
    Limit("stretch", "stretch", "/mm²", False, 0.01, "stretch", lambda limits: limits.stretch.limit),
    Limit("area", "area", "", True, 0.01, None, lambda limits: MIN_AREA),
    Limit("ends", "ends", "mm", False, 0.005, None, lambda limits: 0.0, "wall"),
    Limit("envelope", "envelope", "mm", False, 0.005, "envelope_mm", _envelope, "wall"),
)

BY_NAME = {limit.name: limit for limit in TABLE}


def in_history(limits: Limits) -> list[tuple[Limit, str, float]]:
    """The limits of a problem that its history lines tell of, in the order they are shown: limit, key and bound."""
    found = ((limit, limit.key, limit.read(limits)) for limit in TABLE)
    return [(limit, key, bound) for limit, key, bound in found if key is not None and bound is not None]
