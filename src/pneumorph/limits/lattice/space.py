"""The limit on the space that must contain the exterior, where that is given by a closed surface of triangles.

The value is how far it reaches beyond that surface, see `Space.beyond`.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.cad.space import TOUCHING, Space
from pneumorph.cad.stl import unpack
from pneumorph.geometry.lattice.pieces import Pieces
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.lattice.enclosed import EnclosedLattices
from pneumorph.limits.lattice.neighbours import balls, close_pairs
from pneumorph.limits.lattice.sampled import SampledLattices
from pneumorph.limits.lattice.triangles import distances
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.regions import rows_beyond
from pneumorph.limits.rows.sampled import Near, RowBlock, by_surface

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]

EXTERIOR = 0


def _bound(limits: Limits) -> float | None:
    return None if limits.envelope is None or limits.envelope.triangles is None else 0.0


SPACE = Limit("space", "envelope", "mm", False, 0.002, "envelope_mm", _bound, "wall")


@dataclass(frozen=True)
class Spaces:
    """The exterior is in a space from a file."""

    limits: tuple[Limit, ...] = (SPACE,)

    def rows(self, at: SampledLattices, near: Near) -> Iterator[RowBlock]:
        space = _space(at.spec)
        if space is not None:
            scale = SPACE.scale(at.spec)
            # Every node is a node of several triangles.
            surface = at.body.surfaces[EXTERIOR]
            c = (space.beyond(surface.shell()[0]) / scale)[surface.patches]
            yield rows_beyond(at, at.worst(EXTERIOR, c, -near.reach / scale), space, 0.0, scale)

    def rows_at(self, at: SampledLattices, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Points)
        space = _space(at.spec)
        if space is not None:
            for points in by_surface(at, places):
                yield rows_beyond(at, points, space, 0.0, SPACE.scale(at.spec))

    def certify(self, body: EnclosedLattices, tallies: Mapping[str, Tally]) -> None:
        space = _space(body.spec)
        if space is not None:
            tally = tallies[SPACE.name]

            def bounds(pieces: Pieces) -> tuple[Floats, Floats]:
                return _enclosed(space, pieces)

            accuracy = replace(tally.accuracy, scale=SPACE.scale(body.spec))
            tally.points(EXTERIOR, body.bounded(EXTERIOR, bounds, accuracy, tally.worst))

    def shares(self, at: SampledLattices, number: int) -> Iterator[tuple[str, Floats]]:
        space = _space(at.spec)
        if space is not None and number == EXTERIOR:
            surface = at.body.surfaces[number]
            yield SPACE.name, SPACE.used(space.beyond(surface.shell()[0])[surface.patches], 0.0)

    def smooth(self, at: Any) -> dict[str, Any]:
        return {}


def _space(spec: Limits) -> Space | None:
    text = None if spec.envelope is None else spec.envelope.triangles
    return None if text is None else _unpacked(text)


@lru_cache(maxsize=4)
def _unpacked(text: str) -> Space:
    return Space(*unpack(text))


def _enclosed(space: Space, pieces: Pieces) -> tuple[Floats, Floats]:
    """Upper bounds (n,) of how far pieces are beyond a space, and values (n, 3) at their corners.

    The distance changes no faster than places do. Where that does not decide, a piece is moved inwards by as much as
    its corners are outside, and `TOUCHING`: if its flat triangle then is within the space, and farther from its surface
    than the piece is from the triangle, no point of the piece is farther beyond than the motion less the difference.
    """
    attained = space.beyond(pieces.x)
    centres, radii = balls(pieces.x)
    above = space.beyond(centres) + radii + pieces.error
    some = np.flatnonzero(above > 0.0)
    x, error = pieces.x[some], pieces.error[some]
    motion = np.maximum(attained[some].max(axis=1) + TOUCHING, 0.0) + TOUCHING
    # The way in of the middle, and that of the corner that has the longest.
    for start in (centres[some], x[np.arange(len(some)), attained[some].argmax(axis=1)]):
        moved = x - (motion[:, None] * space.outward(start))[:, None]
        inside = space.beyond(moved.mean(axis=1)) < -TOUCHING
        gap = motion + radii[some] + error
        i, j = close_pairs(moved, space.corners, gap)
        np.minimum.at(gap, i, distances(moved, space.corners, i, j, gap[i])[0])
        within = np.where(inside & (gap > error), motion - TOUCHING - (gap - error), np.inf)
        above[some] = np.minimum(above[some], within)
    return np.maximum(above, attained.max(axis=1)), attained
