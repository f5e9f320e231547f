"""A body from a file at the nodes of the triangles of its faces, as linearised limits ask about it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.lattice.pieces import Displaced, Patches, Pieces, displaced
from pneumorph.geometry.regions import Region
from pneumorph.limits.lattice.enclosed import coordinates
from pneumorph.limits.lattice.neighbours import Links, close_pairs
from pneumorph.limits.lattice.rims import Rims
from pneumorph.limits.lattice.triangles import distances
from pneumorph.limits.rows.sampled import DIGITS, Couples, Placed, Sums, worst_of_cells

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

NODES = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])
"""Second and third barycentric coordinates of the nodes of a triangle."""


@dataclass(frozen=True, eq=False)
class SampledLattices:
    """A `SampledBody` whose cells are the triangles of its faces, and whose samples (m, 6) are their nodes.

    Points are triangles with their second and third barycentric coordinates.

    Attributes
    ----------
    body : Body
    spec : problem.Limits
    between : Region
        See `SampledBody`.
    patches : sequence of Patches
        Of each surface, the exterior first.
    links : sequence of Links
        Which triangles of each surface are neighbours.
    rims : Rims
        Where surfaces meet.
    margins : sequence of (m,) array
        Of each surface, how far the faces of the file may be from its triangles, mm.
    """

    body: Body
    spec: Limits
    between: Region
    patches: Sequence[Patches]
    links: Sequence[Links]
    rims: Rims
    margins: Sequence[Floats]

    @cached_property
    def first(self) -> Ints:
        """The first cell of each surface, and their number."""
        return np.concatenate([[0], np.cumsum([len(each.nodes) for each in self.patches])])

    @cached_property
    def surfaces(self) -> list[Displaced]:
        """Each surface as it is displaced."""
        return [displaced(*each) for each in zip(self.body.surfaces, self.patches, strict=True)]

    @cached_property
    def whole(self) -> list[Pieces]:
        """The triangles of each surface, each in four: of every part the nearest points get a row."""
        return [surface.divided(surface.pieces()) for surface in self.surfaces]

    def positions(self, number: int) -> Floats:
        surface = self.body.surfaces[number]
        return self.surfaces[number].map(surface.outline)[surface.patches]

    def in_end_planes(self, number: int) -> NDArray[np.bool_]:
        return np.zeros(self.body.surfaces[number].patches.shape, bool)

    def worst(self, number: int, c: Floats, least: float) -> Placed:
        node = np.round(c, DIGITS).argmax(axis=1)
        patch = np.flatnonzero(c[np.arange(len(c)), node] > least)
        return self.placed(number, np.column_stack([patch, NODES[node[patch]]]).astype(float))

    def placed(self, number: int, at: Floats) -> Placed:
        patch = at[:, 0].astype(int)
        return Placed(number, self.first[number] + patch, at, self.margins[number][patch])

    def sums(self, points: Placed) -> Sums:
        numbers, weights = self.body.surfaces[points.number].lattice.sums(self.places(points.number, points.at))
        return Sums(self.body.slices[points.number].start + numbers, weights)

    def places(self, number: int, at: Floats) -> Floats:
        """Where points (n, 3) are in the reference, (n, 3) in mm."""
        return self.patches[number].places(*coordinates(at))

    def couples(self, first: int, second: int, bound: float, reach: float) -> Couples:
        """See `SampledBody.couples`.

        Parameters
        ----------
        first, second, bound, reach
            As for `SampledBody.couples`.
        """
        i, j, distance, u, v = self._near(first, second, bound + reach)
        # Of every part of a triangle the nearest one, of either surface.
        pick = np.unique(np.concatenate([worst_of_cells(-distance, i), worst_of_cells(-distance, j)]))
        i, j, u, v = i[pick], j[pick], u[pick], v[pick]
        one, other = self.placed(first, self._at(first, i, u)), self.placed(second, self._at(second, j, v))
        outward = None
        if first != second:
            a, b, c = np.moveaxis(self.whole[second].x[j], 1, 0)
            normals = np.cross(b - a, c - a)
            outward = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        return Couples(one.cell, self.sums(one), self.sums(other), outward, one.margin + other.margin)

    def apart(self, number: int, bound: float) -> Floats:
        found = np.full(len(self.patches[number].nodes), np.inf)
        for other in range(len(self.patches)):
            if other != number:
                i, _, distance, _, _ = self._near(number, other, bound)
                np.minimum.at(found, self.whole[number].patch[i], distance)
        return np.repeat(found[:, None], 6, axis=1)

    def folded(self, number: int, bound: float) -> Floats:
        found = np.full(len(self.patches[number].nodes), np.inf)
        i, j, distance, _, _ = self._near(number, number, bound)
        for part in (i, j):
            np.minimum.at(found, self.whole[number].patch[part], distance)
        return np.repeat(found[:, None], 6, axis=1)

    def pooled(self, number: int, values: Floats) -> Floats:
        surface = self.body.surfaces[number]
        found = np.full(len(surface.outline), -np.inf)
        np.maximum.at(found, surface.patches, values)
        return found

    def _at(self, number: int, piece: Ints, bary: Floats) -> Floats:
        """Points (n, 3) of parts of triangles, given by barycentric coordinates there, see `places.Points`."""
        pieces = self.whole[number]
        inside = np.einsum("nc,ncb->nb", bary, pieces.bary[piece])[:, 1:]
        return np.column_stack([pieces.patch[piece].astype(float), inside])

    def _near(self, first: int, second: int, within: float) -> tuple[Ints, Ints, Floats, Floats, Floats]:
        """Pairs of parts of triangles within a distance, mm, their distances, and the closest points (n, 3) of both.

        Triangles are taken as flat, and their distances count as less by the margins. On one surface points count that
        are not within the neighbourhood, on two those that are not beside each other at a rim.
        """
        one, other = self.whole[first], self.whole[second]
        own, their = self.margins[first][one.patch], self.margins[second][other.patch]
        i, j = close_pairs(one.x, other.x, within + own + their.max(initial=0.0))
        if first == second:
            i, j = i[i < j], j[i < j]
        less = own[i] + their[j]
        distance, u, v = distances(one.x, other.x, i, j, within + less)
        distance = distance - less
        some = np.flatnonzero(distance < within)
        sides = ((first, i, u), (second, j, v))
        here, there = (self.places(number, self._at(number, k[some], part[some])) for number, k, part in sides)
        rim = self.rims.get((min(first, second), max(first, second)))
        if rim is not None:
            some = some[rim.away(here) + rim.away(there) >= rim.reach]
        if first == second:
            near = np.linalg.norm(here - there, axis=1) < self.spec.fold.neighbourhood
            some = some[~(near & self.links[first].hold(one.patch[i[some]], other.patch[j[some]]))]
        return i[some], j[some], distance[some], u[some], v[some]
