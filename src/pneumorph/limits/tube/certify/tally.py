"""The certificate of one limit over all surfaces of a body, collected while its surfaces are bounded one by one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.limits.certify.places import NO_POINTS, Pairs, Points
from pneumorph.limits.limit import DECIDED, ROUNDING, Limit
from pneumorph.limits.tube.certify.cells import FINE, Accuracy, KnotSpans, SpanBounds, knot_spans
from pneumorph.limits.tube.certify.patch_distances import (
    Gaps,
    Patches,
    gaps,
    nearest,
    nearest_uncertified,
    patches,
    without_discs,
)

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class SpannedBody:
    """A body by the knot spans of its surfaces.

    Attributes
    ----------
    body : Body
    spec : problem.Limits
    spans : tuple of KnotSpans
        Those of each surface, the exterior first.
    """

    body: Body
    spec: Limits
    spans: tuple[KnotSpans, ...]

    @property
    def own(self) -> list[int]:
        """The surfaces of which some knot span is to be bounded."""
        return [number for number, spans in enumerate(self.spans) if spans.own.any()]

    @cached_property
    def closed(self) -> list[Patches]:
        """Each surface as patches, with the end discs of chambers."""
        return [patches(surface, spans) for surface, spans in zip(self.body.surfaces, self.spans, strict=True)]

    @cached_property
    def tubes(self) -> list[Patches]:
        """The same without discs."""
        return [without_discs(surface) for surface in self.closed]


def spanned_body(body: Body, spec: Limits, own: Sequence[Mask] | None) -> SpannedBody:
    """The knot spans of a body; see `report.certify`."""
    masks = [None] * len(body.surfaces) if own is None else own
    return SpannedBody(body, spec, tuple(map(knot_spans, body.surfaces, masks)))


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
        self.place = (0, 0.0, 0.0)
        self._places: list[Points | Pairs] = []

    def points(self, surface: int, found: SpanBounds) -> None:
        """Add the bounds on a surface's knot spans."""
        self._worst(found.upper, found.seen, surface, found.q, found.r)
        some, sign = ~(found.upper <= self.accuracy.needed), self.limit.sign
        at = np.full(np.count_nonzero(some), surface), found.q[some], found.r[some]
        self._places.append(Points(*at, sign * found.seen[some], sign * found.upper[some]))

    def pairs(self, first: int, second: int, found: Gaps, beyond: float) -> None:
        """Add the distances between two surfaces, and the lower bound `beyond` of all other pairs of patches.

        Parameters
        ----------
        first, second : int
            Indices of the surfaces.
        found : Gaps
        beyond : float
            Lower bound of all other pairs, mm.
        """
        self._worst(-found.lower, -found.seen, first, found.a[:, 0], found.a[:, 1])
        self.upper = max(self.upper, -beyond)
        some = nearest_uncertified(found, -self.accuracy.needed)
        between = np.full(len(some), first), np.full(len(some), second), found.a[some], found.b[some]
        self._places.append(Pairs(*between, found.seen[some], found.lower[some]))

    def places(self) -> Points | Pairs:
        """All places where the limit is not certified."""
        if not self._places:
            return NO_POINTS
        return type(self._places[0])(*(np.concatenate(part) for part in zip(*self._places, strict=True)))

    def _worst(self, upper: Floats, seen: Floats, surface: int, q: Floats, r: Floats) -> None:
        if not len(upper):
            return
        self.upper = max(self.upper, float(upper.max()))
        k = int(np.argmax(seen))
        if seen[k] > self.worst:
            self.worst, self.place = float(seen[k]), (surface, float(q[k]), float(r[k]))


def certify_pairs(
    tallies: Mapping[str, Tally], limit: Limit, measured: Mapping[tuple[int, int], tuple[Patches, Patches, float]]
) -> None:
    """Enclose the distances between pairs of surfaces, or within surfaces, in the tally of their limit.

    `measured` has both surfaces and the neighbourhood, see `gaps`, by the surfaces' indices.
    """
    tally = tallies[limit.name]
    known = {number: nearest(*parts) for number, parts in measured.items()}
    # Nothing is refined that is farther than what is known of all limits with the same name for users.
    alike = [-other.worst for other in tallies.values() if other.limit.word == limit.word]
    least = min([*alike, *(found.seen.min(initial=np.inf) for found in known.values())])
    for number, parts in measured.items():
        tally.pairs(*number, *gaps(*parts, tally.accuracy, known[number], min(least, -tally.worst)))
