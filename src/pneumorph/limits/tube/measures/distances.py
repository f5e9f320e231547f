"""Distances between surfaces and within one surface (the paper's (23)), by a spatial search for closest points.

The partner of a sample is the closest point of the other surface itself, not its closest sample, which would
overestimate a wall of 2 mm by up to 0.05 mm. It is found from the second-order expansion at the closest sample and then
kept as a fixed combination of four samples plus a fixed vector, so that distances are smooth in the control points and
exact for those at which the partners were found.

Points of one surface are neighbours if their distance on the starting tube is small: the chord across the tube and the
length along it. With the arc instead of the chord, points on opposite sides of a pole would not be neighbours, although
they are near each other.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
import numba
import numpy as np
from jax import Array
from numpy.typing import NDArray

from pneumorph.limits.rows.sampled import DIGITS
from pneumorph.limits.tube.measures import expansion
from pneumorph.limits.tube.measures.grid import Grid, SampledFields, every_second, with_discs
from pneumorph.limits.tube.measures.nearest_samples import facing_samples, nearest_samples

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


class ClosestPoints(NamedTuple):
    """Partners of n samples, in arrays of fixed shape.

    The partner of sample i is Σ_k weight[i, k]·X[sample[i, k]] + rest[i] with X the positions of all samples.
    """

    sample: Ints  # (n, 4)
    weight: Floats  # (n, 4)
    rest: Floats  # (n, 3) mm
    active: NDArray[np.bool_]  # (n,): false if no partner is within reach


def distances(X: Array, source: Ints, partners: ClosestPoints) -> Array:
    """Distances (n,) in mm of the samples X[source] from their partners, meaningful only for active ones.

    X is (n_samples, 3). Differentiable, even at distance zero.
    """
    closest = jnp.einsum("nk,nkc->nc", partners.weight, X[partners.sample]) + partners.rest
    return jnp.sqrt(jnp.sum((X[source] - closest) ** 2, axis=1) + 1e-12)


@dataclass(frozen=True, eq=False)
class SampledSurface:
    """Samples of a surface on which closest points are searched: a tube and, for a closed chamber, its end discs.

    Samples are numbered row by row, n of them in all.

    Attributes
    ----------
    grid : Grid
        Samples of the tube.
    rings : (int, int)
        Numbers of rings of samples on the discs, before and after the tube's rows; 0 without one.
    fields : SampledFields
        Position and derivatives per mm, each (n, 3).
    ahead, behind : (rows,) arrays
        Distance in mm of the second parameter to the next and the previous row. Tube and disc meet at an angle on the
        rim, so the expansion at a sample on the rim, which is that of the tube, is used on the tube only.
    """

    grid: Grid
    rings: tuple[int, int]
    fields: SampledFields
    ahead: Floats
    behind: Floats

    @property
    def x(self) -> Floats:
        """Positions of the samples, (n, 3)."""
        return self.fields.x

    @property
    def columns(self) -> int:
        """Number of samples in each row."""
        return len(self.grid.q)

    @property
    def across(self) -> float:
        """Distance in mm of the first parameter to the next column."""
        return self.grid.step[0]

    @property
    def steps(self) -> tuple[float, Floats, Floats]:
        """`across`, `ahead` and `behind`."""
        return self.across, self.ahead, self.behind

    @property
    def tube(self) -> slice:
        """The samples that lie on the tube."""
        first = self.rings[0] * self.columns
        return slice(first, first + len(self.grid.r) * self.columns)

    def normals(self) -> Floats:
        """Unit normals, (n, 3)."""
        n = np.cross(self.fields.q, self.fields.r)
        return n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-9)

    def closest(self, points: Floats, near: Ints) -> tuple[Floats, Floats, Floats]:
        """Points of the surface closest to given points, by Newton's method on the expansion at a nearby sample.

        Parameters
        ----------
        points : (n, 3) array
        near : (n,) array
            A sample of this surface for each point.

        Returns
        -------
        distance : (n,) array
        closest : (n, 3) array
        offset : (n, 2) array
            From the sample to the closest point, in mm along q and r; zero if the sample itself is closest.
        """
        distance, offset = np.empty(len(near)), np.empty((len(near), 2))
        expansion.closest(points, near, tuple(self.fields), self.columns, self.steps, distance, offset)
        return distance, self.positions(near, offset), offset

    def positions(self, near: Ints, offset: Floats) -> Floats:
        """Positions (n, 3) at offsets (n, 2) in mm from samples (n,), by the expansions."""
        x = np.empty((len(near), 3))
        expansion.positions(near, offset, tuple(self.fields), x)
        return x

    def corners(self, near: Ints, offset: Floats) -> tuple[Ints, Floats]:
        """Indices and weights (n, 4) of the four samples around points given by a sample and an offset (n, 2) in mm."""
        row, column = np.divmod(near, self.columns)
        forward = offset[:, 1] >= 0.0
        room = np.where(forward, self.ahead[row], self.behind[row])
        u = np.abs(offset[:, 0]) / self.across
        v = np.divide(np.abs(offset[:, 1]), room, out=np.zeros(len(near)), where=room > 0.0)
        beside = (column + np.where(offset[:, 0] >= 0.0, 1, -1)) % self.columns
        beyond = np.where(room > 0.0, row + np.where(forward, 1, -1), row)
        corners = [(row, column), (row, beside), (beyond, column), (beyond, beside)]
        index = np.stack([r * self.columns + c for r, c in corners], axis=1)
        return index, np.stack([(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v], axis=1)

    def between(self, near: Ints, offset: Floats) -> Floats:
        """Positions (n, 3) interpolated between the four samples around such points."""
        index, weight = self.corners(near, offset)
        return np.einsum("nk,nkc->nc", weight, self.x[index])


def sampled_surface(fields: SampledFields, grid: Grid, discs: bool) -> SampledSurface:
    """Build a sampled surface from the fields of its tube, with or without its end discs."""
    before, after = grid.on_discs if discs else (0, 0)
    whole = with_discs(fields, grid) if discs else fields
    rows = before + len(grid.r) + after
    ahead = np.full(rows, grid.step[1])
    ahead[:before] = ahead[rows - after :] = grid.size[0] / (2.0 * np.pi) / len(grid.rings)
    behind = ahead.copy()
    behind[before] = ahead[rows - after - 1] = 0.0
    behind[0] = ahead[-1] = 0.0
    return SampledSurface(
        grid=grid,
        rings=(before, after),
        fields=SampledFields(*(np.ascontiguousarray(np.asarray(field).reshape(3, -1).T) for field in whole)),
        ahead=ahead,
        behind=behind,
    )


def nearest(points: Floats, surface: SampledSurface, bound: float) -> tuple[NDArray[np.bool_], Ints]:
    """For each point whether a sample of the surface is within `bound` mm, and the index of the nearest (0 if not)."""
    distance, near = nearest_samples(points, surface.x, bound)
    return np.isfinite(distance), near


def closest_within(points: Floats, surface: SampledSurface, bound: float) -> tuple[Ints, Ints, Floats, Floats]:
    """The points closer than `bound` mm: their indices and nearest samples (m,), distances (m,) and offsets (m, 2)."""
    # The nearest sample is farther away than the closest point, but by less than the diagonal of a cell.
    within, near = nearest(points, surface, bound + 0.5 * float(np.hypot(surface.across, surface.grid.step[1])))
    some = np.flatnonzero(within)
    distance, _, offset = surface.closest(points[some], near[some])
    keep = distance < bound
    return some[keep], near[some[keep]], distance[keep], offset[keep]


def wall_closest(points: Floats, surface: SampledSurface, bound: float, first: int) -> ClosestPoints:
    """Partners of points on another surface, whose samples are numbered from `first`; active within `bound` mm.

    Parameters
    ----------
    points : (n, 3) array
        mm.
    surface : SampledSurface
        The other surface.
    bound : float
        mm.
    first : int
        Number of its first sample.
    """
    # The nearest sample is farther away than the closest point, but by less than the diagonal of a cell.
    within, near = nearest(points, surface, bound + 1.0)
    some = np.flatnonzero(within)
    distance, closest, offset = surface.closest(points[some], near[some])
    active = distance <= bound
    some = some[active]
    return _closest_points(len(points), surface, first, some, near[some], offset[active], closest[active])


def fold_closest(tube: SampledSurface, neighbourhood: float, bound: float, first: int) -> ClosestPoints:
    """Partners of every second sample of a tube on itself, outside the neighbourhood; active within `bound` mm.

    Parameters
    ----------
    tube : SampledSurface
        Without discs.
    neighbourhood : float
        Points nearer than this on the starting tube do not count, mm.
    bound : float
        mm.
    first : int
        Number of its first sample.
    """
    source = every_second(tube.grid)
    fold = nearest_fold(tube, neighbourhood, bound + 0.5, source)
    some = np.flatnonzero(np.isfinite(fold.distance))
    near, offset, facing = fold.near[some], fold.offset[some], fold.facing[some]
    points, closest = tube.x[source[some]], tube.between(near, offset)
    _, closest[facing], offset[facing] = tube.closest(points[facing], near[facing])
    active = np.linalg.norm(closest - points, axis=1) <= bound
    return _closest_points(len(source), tube, first, some[active], near[active], offset[active], closest[active])


def joined(sets: list[ClosestPoints]) -> ClosestPoints:
    """Concatenate several sets of closest points."""
    return ClosestPoints(*(np.concatenate(parts) for parts in zip(*sets, strict=True)))


def _closest_points(
    n: int, surface: SampledSurface, first: int, some: Ints, near: Ints, offset: Floats, closest: Floats
) -> ClosestPoints:
    """The closest points of n samples, of which only `some` have one."""
    index, weight, rest = np.full((n, 4), first, dtype=np.int32), np.zeros((n, 4)), np.zeros((n, 3))
    corner, weight[some] = surface.corners(near, offset)
    index[some] = corner + first
    rest[some] = closest - surface.between(near, offset)
    active = np.zeros(n, dtype=bool)
    active[some] = True
    return ClosestPoints(index, weight, rest, active)


# Search for opposite walls: weight in mm of normals, and largest deviation from exactly opposite normals.
_FACING, _TOLERANCE = 1.5, 0.8


class NearestFold(NamedTuple):
    """The nearest point of the same tube outside the neighbourhood, for n of its samples."""

    distance: Floats  # (n,) mm; infinite if nothing is within the bound
    near: Ints  # (n,) the sample near that point
    offset: Floats  # (n, 2) mm, from that sample to the point
    facing: NDArray[np.bool_]  # (n,) whether the point is on a facing wall, not on the edge of the neighbourhood


def nearest_fold(tube: SampledSurface, neighbourhood: float, bound: float, source: Ints) -> NearestFold:
    """Find the nearest point of the same tube outside the neighbourhood, for some of its samples.

    Two searches are combined. Walls that face each other have opposite normals, while a sample's neighbours have nearly
    its own normal. So the facing sample is the nearest one in (position, normal) when the sign of one normal is
    changed. Where the surface has shrunk, the nearest point is instead on the edge of the neighbourhood, which is the
    same ellipse on the grid around every sample.

    Parameters
    ----------
    tube : SampledSurface
        Without discs.
    neighbourhood : float
        Distance in mm on the starting tube; points within it are ignored.
    bound : float
        Largest distance in mm that is searched.
    source : (n,) array
        Samples for which the nearest point is searched.
    """
    edge_distance, edge_near = np.full(len(source), np.inf), np.zeros(len(source), dtype=np.int64)
    edge_offset = np.zeros((len(source), 2))
    small = np.flatnonzero(neighbourhood * _AS_SHORT * _least_stretch(tube)[source] < bound)
    edge_distance[small], edge_near[small], edge_offset[small] = _edge(tube, neighbourhood, source[small])
    normals = _FACING * tube.normals()
    reach = float(np.hypot(bound, _FACING * _TOLERANCE))
    x = tube.x[source]
    away, near = facing_samples(x, -normals[source], tube.x, normals, reach)
    counts = np.isfinite(away) & (apart(tube.grid, source, near) >= neighbourhood)
    distance = np.where(counts, np.linalg.norm(x - tube.x[near], axis=1), np.inf)

    facing = distance < edge_distance
    distance = np.where(facing, distance, edge_distance)
    return NearestFold(
        distance=np.where(distance <= bound, distance, np.inf),
        near=np.where(facing, near, edge_near),
        offset=np.where(facing[:, None], 0.0, edge_offset),
        facing=facing & (distance <= bound),
    )


_AS_SHORT = 0.7
"""Smallest ratio of a chord across a neighbourhood to its length along the curved surface."""


def _least_stretch(tube: SampledSurface) -> Floats:
    """Smallest stretch (n,) of the surface in any tangent direction, relative to the starting tube, at all samples."""
    E, F, G = _dot(tube.fields.q, tube.fields.q), _dot(tube.fields.q, tube.fields.r), _dot(tube.fields.r, tube.fields.r)
    return np.sqrt(np.maximum(0.5 * (E + G - np.hypot(E - G, 2.0 * F)), 0.0))


def _edge(tube: SampledSurface, neighbourhood: float, source: Ints) -> tuple[Floats, Ints, Floats]:
    """Distance, nearest sample and offset of the nearest point on the edge of each source's neighbourhood."""
    step_q, step_r = tube.grid.step
    diameter = tube.grid.size[0] / np.pi
    ring = np.array([place for place in _ring(neighbourhood, step_r) if abs(place[0]) <= diameter]).reshape(-1, 2)
    around = diameter * np.arcsin(ring[:, 0] / diameter)
    whole = np.rint(np.stack([around / step_q, ring[:, 1] / step_r], axis=1))
    rest = np.stack([around, ring[:, 1]], axis=1) - whole * [step_q, step_r]
    best, near = np.full(len(source), np.inf), np.zeros(len(source), dtype=np.int64)
    offset = np.zeros((len(source), 2))
    shrink = np.ascontiguousarray(tube.grid.frame.shrink[:, 0])
    places, into = (ring, whole.astype(np.int64), rest), (best, near, offset)
    _least_on_ring(tube.x, shrink, source, tube.columns, (step_q, step_r), places, neighbourhood, into)
    return best, near, offset


TURNS = np.radians([-7.5, -3.75, 0.0, 3.75, 7.5])
"""Turns that are tried between the places of `_ring`."""


def closest_on_edge(
    tube: SampledSurface, neighbourhood: float, source: Ints, near: Ints, offset: Floats
) -> tuple[Ints, Floats, Floats]:
    """The nearest points on the edge of a neighbourhood, between the samples and the places that `nearest_fold` tries.

    Parameters
    ----------
    tube, neighbourhood, source
        As for `nearest_fold`.
    near, offset : (n,) and (n, 2) arrays
        Its results.

    Returns
    -------
    near, offset
        The same of the closest points found.
    aside : (n, 2) array
        Offsets of their partners from the sources, mm.
    """
    near, offset, aside = near.copy(), offset.copy(), np.zeros((len(source), 2))
    shrink = np.ascontiguousarray(tube.grid.frame.shrink[:, 0])
    surface = tuple(tube.fields), tube.columns, shrink, tube.grid.step, tube.grid.size[0] / np.pi
    expansion.edge_around(source, near, offset, surface, neighbourhood, expansion.NEARBY, TURNS, DIGITS, aside)
    return near, offset, aside


@numba.njit(cache=True, nogil=True)
def _least_on_ring(x, shrink, source, columns, step, places, neighbourhood, into):
    """Fill distances (m,), samples (m,) and offsets (m, 2), `into`, with the nearest of some places around each source.

    `places` are chords and lengths along r (m, 2), whole grid steps (m, 2), and what is left beyond these in mm (m, 2).
    """
    ring, whole, rest = places
    best, near, offset = into
    rows = len(shrink)
    for k in range(len(source)):
        here, row, column = source[k], source[k] // columns, source[k] % columns
        for m in range(len(ring)):
            up = ring[m, 1] / step[1]
            if row + up < 0.0 or row + up > rows - 1:
                continue
            there = min(max(row + whole[m, 1], 0), rows - 1)
            # Near a pole steps around are shorter, and the point may still be within the neighbourhood.
            if np.hypot(ring[m, 0] * min(shrink[row], shrink[there]), ring[m, 1]) < neighbourhood - 1e-6:
                continue
            at = there * columns + (column + whole[m, 0]) % columns
            beside = there * columns + (column + whole[m, 0] + int(np.sign(rest[m, 0]))) % columns
            beyond = min(max(row + whole[m, 1] + int(np.sign(rest[m, 1])), 0), rows - 1) * columns
            beyond += (column + whole[m, 0]) % columns
            part_q, part_r = abs(rest[m, 0]) / step[0], abs(rest[m, 1]) / step[1]
            square = 0.0
            for c in range(3):
                gap = x[at, c] - x[here, c]
                gap += part_q * (x[beside, c] - x[at, c]) + part_r * (x[beyond, c] - x[at, c])
                square += gap * gap
            distance = np.sqrt(square)
            if distance < best[k]:
                best[k], near[k] = distance, at
                offset[k, 0], offset[k, 1] = rest[m, 0], rest[m, 1]


def _ring(radius: float, step: float) -> list[tuple[float, float]]:
    """Points about every 15 degrees on a circle, at whole grid steps along r except at its two extremes."""
    ups = {round(radius * np.sin(angle) / step) for angle in np.radians(np.arange(0, 90, 15))}
    quarter = [(float(np.sqrt(radius**2 - (up * step) ** 2)), up * step) for up in sorted(ups) if up * step < radius]
    quarter.append((0.0, radius))
    return sorted({(i * around, j * along) for around, along in quarter for i in (1, -1) for j in (1, -1)})


def apart(grid: Grid, i: Ints, j: Ints, aside: Floats | float = 0.0) -> Floats:
    """Distance (n,) in mm on the starting tube of samples i from samples j, moved from each other by `aside` (n, 2)."""
    columns = len(grid.q)
    (row_i, column_i), (row_j, column_j) = np.divmod(i, columns), np.divmod(j, columns)
    diameter = grid.size[0] / np.pi * np.minimum(grid.frame.shrink[row_i, 0], grid.frame.shrink[row_j, 0])
    moved = np.broadcast_to(aside, (len(i), 2))
    chord = diameter * np.abs(np.sin(np.pi * ((column_i - column_j) / columns + moved[:, 0] / grid.size[0])))
    return np.hypot(chord, (row_i - row_j) * grid.step[1] + moved[:, 1])


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("nc,nc->n", a, b)
