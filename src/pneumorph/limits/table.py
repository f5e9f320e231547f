"""The table of limits: names, units, bounds and tolerances, defined in one place."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal, overload

import numpy as np
from numpy.typing import NDArray

from pneumorph.limits.measures.formulas import MIN_AREA

if TYPE_CHECKING:
    from pneumorph.problem import Limits


ROUNDING = 1e-6
"""Part of a tolerance that is left for rounding: a value certified to be just within it must count as held."""


@dataclass(frozen=True)
class Limit:
    """One limit of a design.

    Attributes
    ----------
    name : str
        As used by the optimiser and in the readings of reports.
    word : str
        The name shown to users; limits with the same word are shown as one.
    unit : "mm", "/mm²" or ""
    at_least : bool
        Whether the quantity must be at least its bound; otherwise at most.
    tolerance : float
        Allowed violation relative to the bound (in mm if the bound is zero).
    key : str or None
        Key in the history's ``limits``; None if the history does not have the limit separately.
    read : function of `problem.Limits`
        Returns its bound in mm, 1/mm² or 1; None if the problem has no such limit.
    per : "wall", "fold" or None
        The limit by which the optimiser's values are divided; None if they are divided by the bound.
    of_shape : bool
        Whether the shape alone decides; otherwise the states of the tasks do (`optimize.states`).
    """

    name: str
    word: str
    unit: str
    at_least: bool
    tolerance: float
    key: str | None
    read: Callable[[Limits], float | None]
    per: Literal["wall", "fold"] | None = None
    of_shape: bool = True

    def excess(self, value: float, bound: float) -> float:
        """Violation relative to the bound (in mm if the bound is zero); negative if the limit is held."""
        return (bound - value if self.at_least else value - bound) / (bound or 1.0)

    def needed(self, bound: float, slack: float = 1.0) -> float:
        """The value at which a limit is still held within `slack` tolerances, whatever rounding does."""
        allowed = slack * self.tolerance * (1.0 - ROUNDING) * (bound or 1.0)
        return bound - allowed if self.at_least else bound + allowed

    @overload
    def used(self, value: float, bound: float) -> float: ...
    @overload
    def used(self, value: NDArray[np.float64], bound: float) -> NDArray[np.float64]: ...
    def used(self, value: float | NDArray[np.float64], bound: float) -> float | NDArray[np.float64]:
        """Ratio of a value, or of each of several, to its limit: 1 exactly at the limit, more if it is violated."""
        return bound / np.maximum(value, 1e-12) if self.at_least else value / bound


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
    Limit("strain", "strain", "", False, 0.005, "strain", lambda limits: limits.strain, of_shape=False),
    Limit("margin", "margin", "", True, 0.005, "margin", lambda limits: limits.margin, of_shape=False),
)

OF_SHAPE = tuple(limit for limit in TABLE if limit.of_shape)
"""The limits that need no equilibrium."""

BY_NAME = {limit.name: limit for limit in TABLE}


def in_history(limits: Limits) -> list[tuple[Limit, str, float]]:
    """The limits of a problem that its history contains, in the order they are shown: limit, key and bound."""
    found = ((limit, limit.key, limit.read(limits)) for limit in TABLE)
    return [(limit, key, bound) for limit, key, bound in found if key is not None and bound is not None]
