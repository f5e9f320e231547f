"""The certificate of one limit over all surfaces of a body, collected while its surfaces are bounded one by one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.limits.certify.enclosed import Accuracy, CellBounds, EnclosedBody, Gaps
from pneumorph.limits.certify.places import NO_POINTS, Pairs, Points
from pneumorph.limits.limit import DECIDED, ROUNDING, Limit

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]

FINE = 0.003
"""Largest gap between certified and attained values near a limit, relative to the bound."""


class Tally:
    """Collects the values of one limit over all surfaces, with a sign such that larger is worse."""

    def __init__(self, limit: Limit, spec: Limits) -> None:
        self.limit, self.bound, self.scale = limit, limit.bound(spec), limit.scale(spec)
        self.accuracy = Accuracy(
            bound=limit.sign * self.bound,
            needed=limit.sign * self.bound if self.bound else ROUNDING,
            gap=FINE * (self.bound or self.scale),
            decided=DECIDED * limit.aim * self.scale,
            relative_gap=limit.far,
        )
        self.worst, self.upper = -np.inf, -np.inf
        self.surface, self.at = 0, np.zeros(3)
        self._places: list[Points | Pairs] = []

    def points(self, surface: int, bounds: CellBounds) -> None:
        """Add the bounds on a surface's cells."""
        self._worst(bounds.upper, bounds.attained, surface, bounds.at)
        some, sign = ~(bounds.upper <= self.accuracy.needed), self.limit.sign
        on = np.full(np.count_nonzero(some), surface)
        self._places.append(Points(on, bounds.at[some], sign * bounds.attained[some], sign * bounds.upper[some]))

    def pairs(self, first: int, second: int, gaps: Gaps, beyond: float) -> None:
        """Add the distances between two surfaces, and the lower bound `beyond` of all other pairs of pieces.

        Parameters
        ----------
        first, second : int
            Indices of the surfaces.
        gaps : Gaps
        beyond : float
            Lower bound of all other pairs, mm.
        """
        self._worst(-gaps.lower, -gaps.attained, first, gaps.a)
        self.upper = max(self.upper, -beyond)
        some = _nearest_uncertified(gaps, -self.accuracy.needed)
        between = np.full(len(some), first), np.full(len(some), second), gaps.a[some], gaps.b[some]
        self._places.append(Pairs(*between, gaps.attained[some], gaps.lower[some]))

    def places(self) -> Points | Pairs:
        """All places where the limit is not certified."""
        if not self._places:
            return NO_POINTS
        return type(self._places[0])(*(np.concatenate(part) for part in zip(*self._places, strict=True)))

    def _worst(self, upper: Floats, attained: Floats, surface: int, at: Floats) -> None:
        if not len(upper):
            return
        self.upper = max(self.upper, float(upper.max()))
        k = int(np.argmax(attained))
        if attained[k] > self.worst:
            self.worst, self.surface, self.at = float(attained[k]), surface, at[k]


def certify_pairs(
    body: EnclosedBody, couples: Sequence[tuple[int, int]], limit: Limit, tallies: Mapping[str, Tally]
) -> None:
    """Enclose the distances between pairs of surfaces, or within surfaces, in the tally of their limit.

    Parameters
    ----------
    body : EnclosedBody
    couples : sequence of (int, int)
        Numbers of two surfaces, or twice the same.
    limit : Limit
        On distances.
    tallies : {limit: Tally}
        Of all limits; that of this limit is added to.
    """
    tally = tallies[limit.name]
    known = {couple: body.near(*couple) for couple in couples}
    # Nothing is refined that is farther than what is known of all limits with the same name for users.
    alike = [-other.worst for other in tallies.values() if other.limit.word == limit.word]
    least = min([*alike, *(gaps.attained.min(initial=np.inf) for gaps in known.values())])
    for couple, near in known.items():
        tally.pairs(*couple, *body.gaps(*couple, tally.accuracy, near, min(least, -tally.worst)))


def _nearest_uncertified(gaps: Gaps, needed: float) -> NDArray[np.integer]:
    """Indices of pairs whose distance is not certified to be at least `needed`: of each piece only the nearest."""
    some = np.flatnonzero(~(gaps.lower >= needed))
    some = some[np.isfinite(gaps.attained[some])]
    some = some[np.argsort(gaps.attained[some], kind="stable")]
    first = [np.unique(gaps.piece[some, side], return_index=True)[1] for side in (0, 1)]
    return some[np.unique(np.concatenate(first))]
