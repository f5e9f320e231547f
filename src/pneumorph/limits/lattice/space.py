"""The limit on the space that must contain the exterior, where that is given by a closed surface of triangles.

The value is the signed distance from that surface, positive outside. What is outside by less than `TOUCHING` counts as
within, so that faces may lie in the surface.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property, lru_cache
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.cad.boxes import Boxes, boxes_of, nearest
from pneumorph.cad.stl import unpack
from pneumorph.geometry.lattice.pieces import Pieces
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.lattice.enclosed import EnclosedLattices
from pneumorph.limits.lattice.neighbours import balls, close_pairs
from pneumorph.limits.lattice.sampled import SampledLattices
from pneumorph.limits.lattice.triangles import distances
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.sampled import Near, Placed, RowBlock, by_surface

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]

TOUCHING = 1e-4
"""mm; STL files have coordinates of seven digits."""

_ON_EDGE = 1e-9
"""Share of a triangle's corners in places up to which these are on its edges."""

EXTERIOR = 0


def _bound(limits: Limits) -> float | None:
    return None if limits.envelope is None or limits.envelope.triangles is None else 0.0


SPACE = Limit("space", "envelope", "mm", False, 0.002, "envelope_mm", _bound, "wall")


@dataclass(frozen=True, eq=False)
class Space:
    """What is within a closed surface: points (n, 3) in mm and triangles (m, 3), normals outwards."""

    points: Floats
    triangles: NDArray[np.integer]

    @cached_property
    def corners(self) -> Floats:
        """Of the triangles, (m, 3, 3) in mm."""
        return self.points[self.triangles]

    @cached_property
    def _boxes(self) -> Boxes:
        return boxes_of(self.points, self.triangles)

    @cached_property
    def _normals(self) -> Floats:
        """Normals (m, 7, 3) of each triangle, of its corners and of its edges 01, 12, 20.

        Those of corners are means by angles, those of edges by halves: what is beyond them is outside, whichever of the
        triangles around is found as the nearest (Bærentzen and Aanæs 2005).
        """
        corners, number = self.corners, self.triangles
        ahead = np.roll(corners, -1, axis=1) - corners
        lengths = np.linalg.norm(ahead, axis=2)
        flat = np.cross(ahead[:, 0], ahead[:, 1])
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        turn = -np.einsum("tkc,tkc->tk", ahead, np.roll(ahead, 1, axis=1)) / (lengths * np.roll(lengths, 1, axis=1))
        angle = np.arccos(np.clip(turn, -1.0, 1.0))
        at = np.zeros_like(self.points)
        np.add.at(at, number, angle[:, :, None] * flat[:, None])
        ends = np.sort(np.stack([number, np.roll(number, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
        _, edge = np.unique(ends, axis=0, return_inverse=True)
        along = np.zeros((edge.max() + 1, 3))
        np.add.at(along, edge.ravel(), np.repeat(flat, 3, axis=0))
        found = np.concatenate([flat[:, None], at[number], along[edge.reshape(-1, 3)]], axis=1)
        return found / np.maximum(np.linalg.norm(found, axis=2, keepdims=True), 1e-300)

    def _nearest(self, x: Floats) -> tuple[Floats, Floats]:
        """The nearest places (n, 3) to points (n, 3), and the normals (n, 3) there."""
        found = nearest(self._boxes, x)
        origin, one, other = np.moveaxis(self.corners[found.triangle], 1, 0)
        e, f, d = one - origin, other - origin, found.place - origin
        a, b, c = (np.einsum("ni,ni->n", *pair) for pair in ((e, e), (e, f), (f, f)))
        g, h = (np.einsum("ni,ni->n", each, d) for each in (e, f))
        v, w = (c * g - b * h) / (a * c - b * b), (a * h - b * g) / (a * c - b * b)
        share = np.column_stack([1.0 - v - w, v, w])
        # 0 for the triangle, from 1 on for corners, from 4 on for edges, of which 01 is opposite to corner 2.
        kind = np.where(share.min(axis=1) < _ON_EDGE, 4 + (share.argmin(axis=1) + 1) % 3, 0)
        kind = np.where(share.max(axis=1) > 1.0 - _ON_EDGE, 1 + share.argmax(axis=1), kind)
        return found.place, self._normals[found.triangle, kind]

    def beyond(self, x: Floats) -> Floats:
        """How far points (..., 3) are beyond it, mm; negative within, and within `TOUCHING` of the surface."""
        places = x.reshape(-1, 3)
        near, normal = self._nearest(places)
        away = places - near
        sign = np.where(np.einsum("ni,ni->n", away, normal) < 0.0, -1.0, 1.0)
        return (sign * np.linalg.norm(away, axis=1)).reshape(x.shape[:-1]) - TOUCHING

    def outward(self, x: Floats) -> Floats:
        """Unit vectors (n, 3) in which points (n, 3) leave it the fastest."""
        near, normal = self._nearest(x)
        away, beyond = x - near, self.beyond(x) + TOUCHING
        far = np.abs(beyond) > TOUCHING
        return np.where(far[:, None], away / np.where(far, beyond, 1.0)[:, None], normal)


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
            yield self._rows(space, at, at.worst(EXTERIOR, c, -near.reach / scale))

    def rows_at(self, at: SampledLattices, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Points)
        space = _space(at.spec)
        if space is not None:
            for points in by_surface(at, places):
                yield self._rows(space, at, points)

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

    @staticmethod
    def _rows(space: Space, at: SampledLattices, points: Placed) -> RowBlock:
        numbers, weights = at.sums(points)
        x = np.einsum("mk,mkc->mc", weights, at.body.control_points()[numbers])
        scale = SPACE.scale(at.spec)
        shape = len(x), 3 * numbers.shape[1]
        return RowBlock(
            np.zeros(len(x), dtype=np.int64),
            points.cell,
            space.beyond(x) / scale,
            (3 * numbers[:, :, None] + np.arange(3)).reshape(shape),
            (weights[:, :, None] * space.outward(x)[:, None, :] / scale).reshape(shape),
        )


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
