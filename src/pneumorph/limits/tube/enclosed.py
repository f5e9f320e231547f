"""A body of tubes by the knot spans of its surfaces, as certificates ask about it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.regions import Region
from pneumorph.geometry.tube.surface import between_ends
from pneumorph.limits.certify.enclosed import Accuracy, CellBounds, Gaps
from pneumorph.limits.tube.certify.cells import KnotSpans, knot_spans
from pneumorph.limits.tube.certify.hull_bounds import facet_bounds, hull_bounds
from pneumorph.limits.tube.certify.patch_distances import Patches, gaps, nearest, patches, without_discs
from pneumorph.limits.tube.points import positions_at

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Mask = NDArray[np.bool_]


@dataclass(frozen=True, eq=False)
class EnclosedTubes:
    """An `EnclosedBody` whose cells are the knot spans of its surfaces.

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
    def between(self) -> Region:
        return between_ends(self.body)

    @property
    def own(self) -> list[int]:
        return [number for number, spans in enumerate(self.spans) if spans.own.any()]

    @cached_property
    def closed(self) -> list[Patches]:
        """Each surface as patches, with the end discs of chambers."""
        return [patches(surface, spans) for surface, spans in zip(self.body.surfaces, self.spans, strict=True)]

    @cached_property
    def tubes(self) -> list[Patches]:
        """The same without discs."""
        return [without_discs(surface) for surface in self.closed]

    def position(self, number: int, at: Floats) -> Floats:
        return positions_at(self.body, number, at)

    def farthest(self, number: int, value: Callable[[Floats], Floats], accuracy: Accuracy, worst: float) -> CellBounds:
        """See `EnclosedBody.farthest`.

        Parameters
        ----------
        number, value, accuracy, worst
            As for `EnclosedBody.farthest`.
        """
        spans = self.spans[number]
        return hull_bounds(spans.x, lambda net: value(np.moveaxis(net, 1, -1)), spans, accuracy, worst)

    def faceted(
        self,
        number: int,
        bounds: Callable[[Floats, Floats], tuple[Floats, Floats]],
        accuracy: Accuracy,
        worst: float,
    ) -> CellBounds:
        """See `EnclosedBody.faceted`.

        Parameters
        ----------
        number, bounds, accuracy, worst
            As for `EnclosedBody.faceted`.
        """
        return facet_bounds(bounds, self.spans[number], accuracy, worst)

    def near(self, first: int, second: int) -> Gaps:
        return nearest(*self._sides(first, second))

    def gaps(self, first: int, second: int, accuracy: Accuracy, known: Gaps, worst: float) -> tuple[Gaps, float]:
        """See `EnclosedBody.gaps`.

        Parameters
        ----------
        first, second, accuracy, known, worst
            As for `EnclosedBody.gaps`.
        """
        return gaps(*self._sides(first, second), accuracy, known, worst)

    def _sides(self, first: int, second: int) -> tuple[Patches, Patches, float]:
        """Both surfaces, and the neighbourhood in which distances do not count, see `gaps`."""
        if first == second:
            return self.tubes[first], self.tubes[first], self.spec.fold.neighbourhood
        return self.closed[first], self.closed[second], 0.0


def enclosed_tubes(body: Body, spec: Limits, own: Sequence[Mask] | None = None) -> EnclosedTubes:
    """A body of tubes by its knot spans.

    Parameters
    ----------
    body : Body
    spec : problem.Limits
    own : sequence of (n,) bool
        For a symmetric body the knot spans of each surface that are not images of others; certificates are of all, with
        places in these alone. See `LimitSamples`.
    """
    masks = [None] * len(body.surfaces) if own is None else own
    return EnclosedTubes(body, spec, tuple(map(knot_spans, body.surfaces, masks)))
