"""What a limit is called, what its bound is, and when a value satisfies it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any, Literal, overload

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]

ROUNDING = 1e-9
"""What rounding errors may do to a value that is at its bound, relative to it (in mm if the bound is zero)."""

DECIDED = 0.25
"""Accuracy of certificates where they decide whether a limit is satisfied, in units of `Limit.aim`."""


@dataclass(frozen=True)
class Limit:
    """One limit of a design.

    Attributes
    ----------
    name : str
        As used by the optimiser and in the readings of reports.
    word : str
        The name shown to users; limits with the same word are shown as one.
    unit : "mm", "mm³", "/mm", "/mm²", "°", "°/kPa", "mm/kPa" or ""
    at_least : bool
        Whether the quantity must be at least its bound; otherwise at most.
    aim : float
        How far within the bound the optimiser aims, relative to `scale`. How nearly it meets limits at samples, and the
        accuracy of certificates between them, fit in there, so that no certified value is beyond its bound.
    key : str or None
        Key in the history's ``limits``; None if the history does not have the limit separately.
    read : function of `problem.Limits`, or of `problem.TaskLimits` for a limit on states
        Returns its bound in the limit's unit; None if the problem has no such limit.
    per : "wall", "fold" or None
        The limit by which the optimiser's values are divided; None if they are divided by the bound.
    far : float
        Accuracy of certified values far from the bound, relative to the distance from it.
    of_all : bool
        Whether it is on a quantity of the whole body, which is nowhere.
    told : 1.0 or -1.0
        By which values are multiplied where they are shown: least motions are sizes, in a direction of their own.
    """

    name: str
    word: str
    unit: str
    at_least: bool
    aim: float
    key: str | None
    read: Callable[[Any], float | None]
    per: Literal["wall", "fold"] | None = None
    far: float = 0.01
    of_all: bool = False
    told: float = 1.0

    @property
    def suffix(self) -> str:
        """The unit as it follows a number."""
        return f" {self.unit}" if self.unit.startswith(("mm", "N")) else self.unit

    def asked(self, bound: float) -> str:
        """What a value must be, in words: "at least 1°", or "-1° or farther" for a motion the other way."""
        if self.told < 0.0:
            return f"{self.told * bound:g}{self.suffix} or farther"
        return f"{'at least' if self.at_least else 'at most'} {bound:g}{self.suffix}"

    @property
    def sign(self) -> float:
        """With it larger values are worse."""
        return -1.0 if self.at_least else 1.0

    def bound(self, limits: Limits) -> float:
        """The bound of a problem that has this limit."""
        bound = self.read(limits)
        assert bound is not None
        return bound

    def scale(self, limits: Limits) -> float:
        """What distances from the bound are divided by for the optimiser, in the limit's unit."""
        return {"wall": limits.wall, "fold": limits.fold.distance}[self.per] if self.per else self.bound(limits)

    def excess(self, value: Any, bound: float) -> Any:
        """Violation of a value, or of each of several, relative to the bound; negative within it.

        In mm if the bound is zero.
        """
        return self.sign * (value - bound) / (bound or 1.0)

    def satisfied(self, value: float, bound: float) -> bool:
        """Whether a value is not beyond the bound."""
        return self.excess(value, bound) <= ROUNDING

    @overload
    def used(self, value: float, bound: float) -> float: ...
    @overload
    def used(self, value: Floats, bound: float) -> Floats: ...
    def used(self, value: float | Floats, bound: float) -> float | Floats:
        """Ratio of a value, or of each of several, to its limit: 1 exactly at the limit, more if it is violated.

        If the bound is zero, none of it is used by what is 1 mm within.
        """
        if not bound:
            return np.maximum(1.0 + self.excess(value, bound), 0.0)
        return bound / np.maximum(value, 1e-12) if self.at_least else value / bound
