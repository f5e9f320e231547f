"""A body from a file at the nodes of the triangles of its faces, as linearised limits ask about it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.lattice.pieces import Displaced, Patches, displaced
from pneumorph.geometry.regions import Region
from pneumorph.limits.lattice.enclosed import coordinates
from pneumorph.limits.lattice.neighbours import Links
from pneumorph.limits.lattice.parts import Kept, Parts, foremost, kept_pairs
from pneumorph.limits.lattice.rims import Rims
from pneumorph.limits.rows.sampled import DIGITS, Couples, Placed, Sums, worst_of_cells

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]
Mask = NDArray[np.bool_]

NODES = np.array([[0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])
"""Second and third barycentric coordinates of the nodes of a triangle."""


UNFOLDED = 0.8
"""Of the least scaling at nodes, as it may be between them."""


def scalings(gradients: Floats) -> Floats:
    """The least and the largest singular value (..., 2) of gradients (..., 3, 3): roots of eigenvalues of GᵀG."""
    return np.sqrt(np.maximum(extremes(np.swapaxes(gradients, -1, -2) @ gradients), 0.0))


def extremes(symmetric: Floats) -> Floats:
    """The least and the largest eigenvalue (..., 2) of symmetric matrices (..., 3, 3).

    In closed form, which takes a third of the time of a decomposition.
    """
    mean = np.trace(symmetric, axis1=-2, axis2=-1) / 3.0
    rest = symmetric - mean[..., None, None] * np.eye(3)
    spread = np.sqrt((rest**2).sum(axis=(-2, -1)) / 6.0)
    unit = rest / np.maximum(spread, 1e-300)[..., None, None]
    angle = np.arccos(np.clip(np.linalg.det(unit) / 2.0, -1.0, 1.0)) / 3.0
    ends = [mean + 2.0 * spread * np.cos(angle + turn) for turn in (2.0 * np.pi / 3.0, 0.0)]
    return np.stack(ends, axis=-1)


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
    parts : sequence of Parts
        Of each surface: of every part the nearest points get a row.
    kept : {(int, int): Kept}
        Of two surfaces, the lower number first, or of one with itself: the pairs that may get rows.
    group : sequence of (3, 3) array
        The symmetries: of images of each other only the foremost get rows.
    """

    body: Body
    spec: Limits
    between: Region
    patches: Sequence[Patches]
    links: Sequence[Links]
    rims: Rims
    margins: Sequence[Floats]
    parts: Sequence[Parts]
    kept: Mapping[tuple[int, int], Kept]
    group: Sequence[Floats]

    @cached_property
    def first(self) -> Ints:
        """The first cell of each surface, and their number."""
        return np.concatenate([[0], np.cumsum([len(each.nodes) for each in self.patches])])

    @cached_property
    def surfaces(self) -> list[Displaced]:
        """Each surface as it is displaced."""
        return [displaced(*each) for each in zip(self.body.surfaces, self.patches, strict=True)]

    @cached_property
    def nodes(self) -> list[Floats]:
        """Where the nodes (k, 3) of each surface are displaced, mm."""
        each = zip(self.surfaces, self.body.surfaces, strict=True)
        return [shown.map(surface.outline) for shown, surface in each]

    @cached_property
    def corners(self) -> list[Floats]:
        """The corners (n, 3, 3) of the parts of each surface, mm."""
        return [nodes[parts.nodes] for nodes, parts in zip(self.nodes, self.parts, strict=True)]

    @cached_property
    def scalings(self) -> list[Floats]:
        """The least and the largest scaling (k, 2) of the map at the nodes of each surface."""
        each = zip(self.surfaces, self.body.surfaces, strict=True)
        return [scalings(shown.gradients(surface.outline)) for shown, surface in each]

    def positions(self, number: int) -> Floats:
        return self.nodes[number][self.body.surfaces[number].patches]

    def in_end_planes(self, number: int) -> NDArray[np.bool_]:
        return np.zeros(self.body.surfaces[number].patches.shape, bool)

    def worst(self, number: int, c: Floats, least: float) -> Placed:
        node = np.round(c, DIGITS).argmax(axis=1)
        patch = np.flatnonzero((c[np.arange(len(c)), node] > least) & self._foremost[number])
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
        i, j, distance, u, v = self._near(self.kept, first, second, bound + reach)
        # Of every part of a triangle the nearest one, of either surface.
        pick = np.unique(np.concatenate([worst_of_cells(-distance, i), worst_of_cells(-distance, j)]))
        i, j, u, v = i[pick], j[pick], u[pick], v[pick]
        one, other = self.placed(first, self._at(first, i, u)), self.placed(second, self._at(second, j, v))
        outward = None
        if first != second:
            a, b, c = np.moveaxis(self.corners[second][j], 1, 0)
            normals = np.cross(b - a, c - a)
            outward = normals / np.maximum(np.linalg.norm(normals, axis=1), 1e-300)[:, None]
        return Couples(one.cell, self.sums(one), self.sums(other), outward, one.margin + other.margin)

    def apart(self, number: int, bound: float) -> Floats:
        found = np.full(len(self.patches[number].nodes), np.inf)
        for other in range(len(self.patches)):
            if other != number:
                i, _, distance, _, _ = self._near(self._all, number, other, bound)
                np.minimum.at(found, self.parts[number].patch[i], distance)
        return np.repeat(found[:, None], 6, axis=1)

    def folded(self, number: int, bound: float) -> Floats:
        found = np.full(len(self.patches[number].nodes), np.inf)
        i, j, distance, _, _ = self._near(self._all, number, number, bound)
        for part in (i, j):
            np.minimum.at(found, self.parts[number].patch[part], distance)
        return np.repeat(found[:, None], 6, axis=1)

    def pooled(self, number: int, values: Floats) -> Floats:
        surface = self.body.surfaces[number]
        found = np.full(len(surface.outline), -np.inf)
        np.maximum.at(found, surface.patches, values)
        return found

    def _at(self, number: int, part: Ints, bary: Floats) -> Floats:
        """Points (n, 3) of parts of triangles, given by barycentric coordinates there, see `places.Points`."""
        parts = self.parts[number]
        inside = np.einsum("nc,ncb->nb", bary, parts.bary[part])[:, 1:]
        return np.column_stack([parts.patch[part].astype(float), inside])

    @cached_property
    def _foremost(self) -> list[Mask]:
        """Which triangles (m,) of each surface are the foremost of their images."""
        found = []
        for parts in self.parts:
            centres, radii = parts.ball
            some = np.zeros(int(parts.patch.max(initial=-1)) + 1, bool)
            np.logical_or.at(some, parts.patch, foremost(self.group, centres, radii))
            found.append(some)
        return found

    @cached_property
    def _all(self) -> Mapping[tuple[int, int], Kept]:
        """The same with all images of pairs."""
        return kept_pairs(self.parts, self.links, self.spec.fold.neighbourhood, self.rims)

    def _unfolded(self, number: int, within: float) -> Mask:
        """Which parts (n,) of a surface are so little compressed that no points beyond the neighbourhood are within a
        distance, mm.

        This takes the scaling of the map between two points as that at the nodes beside them.
        """
        patches = self.body.surfaces[number].patches
        least = self.scalings[number][:, 0][patches].min(axis=1)
        return (UNFOLDED * self.spec.fold.neighbourhood * least > within)[self.parts[number].patch]

    def _near(
        self, kept: Mapping[tuple[int, int], Kept], first: int, second: int, within: float
    ) -> tuple[Ints, Ints, Floats, Floats, Floats]:
        """Pairs of parts of triangles within a distance, mm, their distances, and the closest points (n, 3) of both.

        Triangles are taken as flat, and their distances count as less by the margins. On one surface points count that
        are not within the neighbourhood, on two those that are not beside each other at a rim.
        """
        if first > second:
            i, j, distance, u, v = self._near(kept, second, first, within)
            return j, i, distance, v, u
        beside = self._unfolded(first, within) if first == second else None
        i, j, distance, u, v = kept[first, second].within(self.corners[first], self.corners[second], within, beside)
        rim = self.rims.get((first, second))
        if rim is None and first != second:
            return i, j, distance, u, v
        here, there = (self.places(n, self._at(n, part, at)) for n, part, at in ((first, i, u), (second, j, v)))
        if rim is not None:
            counts = rim.away(here) + rim.away(there) >= rim.reach
        else:
            patch = self.parts[first].patch
            near = np.linalg.norm(here - there, axis=1) < self.spec.fold.neighbourhood
            counts = ~(near & self.links[first].hold(patch[i], patch[j]))
        return i[counts], j[counts], distance[counts], u[counts], v[counts]
