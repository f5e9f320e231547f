"""Surfaces of bodies from files in pieces, each within a known distance of a flat triangle.

A point of the reference faces, which are six-node triangles x̂(λ), moves to φ(x̂), where φ is the spline map of the
lattice. On the part of a face between three of its points, with the flat triangle x̃(λ) = Σ λ_i x̂_i in reference
coordinates,

    |φ(x̂(λ)) − Σ λ_i φ(x̂_i)| ≤ |φ(x̂) − φ(x̃)| + |φ(x̃) − Σ λ_i φ(x̂_i)|
                              ≤ 4/3 max_e Σ_k A_k |m_e,k| + 1/6 max_e Σ_k Q_k d_e,k²,

with the edges d_e and the distances m_e of their middles on the face from those of the chords: x̂ is quadratic, and
Σ_{i<j} λ_i λ_j ≤ 1/3. A_k bounds |∂φ/∂x_k|, and Q_k = Σ_l |∂²φ/∂x_k∂x_l| r_l / r_k with the extents r of the piece,
since 2 |w_k| |w_l| ≤ w_k² r_l / r_k + w_l² r_k / r_l. Derivatives are bounded in the knot cells around the face by the
largest of their B-spline coefficients, which are differences of control points; second ones also by their values in the
middle of a piece and third ones. Both terms fall to a quarter, or more, where a piece is divided into four.

Where that is too coarse, the quadratic triangle through the corners and the middles of the edges tells the direction
in which the surface deviates. The rest is at most c (Σ T_klm w_k w_l w_m + 3 Σ Q_kl w_k z_l): T and Q bound the third
and second derivatives of φ, w and z the first and second ones of x̂ along barycentric coordinates. It is the sum of
Taylor's remainders from the six nodes, each times the function N_a of its node (Ciarlet & Raviart 1972, "General
Lagrange and Hermite interpolation in Rⁿ"), so that c = max Σ_a |N_a| t_a³ / 6, where t_a is half the sum of the
differences of barycentric coordinates. It falls to an eighth.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations_with_replacement, permutations
from math import comb

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.bspline import Basis
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.surface import Lattice

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

# Corners of the four parts of a triangle among its corners and the middles of its edges 01, 12, 20.
PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
_MIDDLES = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]])
# Where the derivatives along two axes are among xx, xy, xz, yy, yz and zz.
_SECOND = np.array([[0, 1, 2], [1, 3, 4], [2, 4, 5]])
# The uniform cubic B-splines (columns) of a knot span, by the powers of the fraction of the way through it.
_POWERS = np.array([[1, 4, 1, 0], [-3, 0, 3, 0], [3, -6, 3, 0], [-1, 3, -3, 1]]) / 6.0
_DIVIDED = np.vstack([np.eye(3), _MIDDLES])
_REST = 0.034  # c of the quadratic triangle, at (0.155, 0.155, 0.69)


@dataclass(frozen=True, eq=False)
class Patches:
    """The faces of a surface as they are in the file.

    Attributes
    ----------
    lattice : Lattice
    nodes : (m, 6, 3) array
        Of six-node triangles, mm.
    """

    lattice: Lattice
    nodes: Floats

    @cached_property
    def spans(self) -> tuple[Ints, Ints]:
        """The first and the last knot span (m, 3) along each axis of the box that holds each triangle."""
        counts = np.array(self.lattice.spans)
        shares = [(end - self.lattice.lower) / (self.lattice.upper - self.lattice.lower) for end in self.boxes]
        ends = (np.floor(end * counts + by).astype(int) for end, by in zip(shares, (-1e-9, 1e-9), strict=True))
        first, last = (np.clip(end, 0, counts - 1) for end in ends)
        return first, last

    @cached_property
    def boxes(self) -> tuple[Floats, Floats]:
        """The lower and the upper corners (m, 3) of boxes that hold the triangles, mm."""
        a, b, c, ab, bc, ca = np.moveaxis(self.nodes, 1, 0)
        # The control points of a quadratic triangle.
        hull = np.stack([a, b, c, 2 * ab - (a + b) / 2, 2 * bc - (b + c) / 2, 2 * ca - (c + a) / 2], axis=1)
        return hull.min(axis=1), hull.max(axis=1)

    def places(self, patch: Ints, bary: Floats) -> Floats:
        """Reference places (n, 3) of points (n, 3) of triangles (n,), given by barycentric coordinates, mm."""
        return places_on(self.nodes, patch, bary)


def places_on(nodes: Floats, patch: Ints, bary: Floats) -> Floats:
    """Places (n, 3) on six-node triangles with nodes (m, 6, 3), given by triangles (n,) and barycentric coordinates."""
    return _places(nodes, np.ascontiguousarray(patch), np.ascontiguousarray(bary))


@numba.njit(cache=True, nogil=True)
def _places(nodes, patch, bary):
    found = np.zeros((len(patch), 3))
    for n in range(len(patch)):
        a, b, c = bary[n]
        six, here = nodes[patch[n]], found[n]
        for k in range(3):
            here[k] = (
                a * (2.0 * a - 1.0) * six[0, k]
                + b * (2.0 * b - 1.0) * six[1, k]
                + c * (2.0 * c - 1.0) * six[2, k]
                + 4.0 * (a * b * six[3, k] + b * c * six[4, k] + c * a * six[5, k])
            )
    return found


def patches_of(surface: LatticeSurface) -> Patches:
    """The faces of a surface."""
    return Patches(surface.lattice, np.ascontiguousarray(surface.outline[surface.patches]))


@dataclass(frozen=True, eq=False)
class Pieces:
    """Parts of triangles of a displaced surface.

    Attributes
    ----------
    patch : (n,) array
        The triangle of each.
    bary : (n, 3, 3) array
        Barycentric coordinates of their corners there.
    place, x : (n, 3, 3) arrays
        Their corners in the reference and displaced, mm.
    error : (n,) array
        How far points of the surface may be from the flat triangle of the displaced corners, mm.
    bulge : (n,) array
        The same in the reference.
    bends : (n, 3, 3) array
        Bounds of the lengths of second derivatives of the map on each, 1/mm.
    area : (n,) array
        Bounds of the area of each, displaced, of its flat triangle, and of all triangles between the two, mm².
    """

    patch: Ints
    bary: Floats
    place: Floats
    x: Floats
    error: Floats
    bulge: Floats
    bends: Floats
    area: Floats

    def __getitem__(self, some: Ints) -> Pieces:
        return Pieces(*(part[some] for part in vars(self).values()))


@dataclass(frozen=True, eq=False)
class Displaced:
    """A surface with its faces, and bounds of the derivatives of its map."""

    patches: Patches
    net: Floats

    def at(self, patch: Ints, bary: Floats) -> Floats:
        """Displaced points (n, 3) given by triangles and barycentric coordinates, mm."""
        return self.map(self.patches.places(patch, bary))

    def map(self, places: Floats) -> Floats:
        """Where reference places (n, 3) are moved, mm."""
        return self._evaluated(places, 0)[:, :, 0]

    def gradients(self, places: Floats) -> Floats:
        """Derivatives (n, 3, 3) of the map there: of each component along x, y and z."""
        return self._evaluated(places, 1)[:, :, 1:]

    def seconds(self, places: Floats) -> Floats:
        """Second derivatives (n, 3, 6) of each component of the map there: xx, xy, xz, yy, yz and zz, 1/mm."""
        return self._evaluated(places, 2)[:, :, 4:]

    def _evaluated(self, places: Floats, order: int) -> Floats:
        """Where places (n, 3) are moved, and derivatives up to an order: (n, 3, 1), (n, 3, 4) or (n, 3, 10)."""
        lattice = self.patches.lattice
        found = np.zeros((len(places), 3, (1, 4, 10)[order]))
        box, spans = np.stack([lattice.lower, lattice.upper]), np.array(lattice.spans)
        net = self.net.reshape(*(basis.count for basis in lattice.bases), 3)
        _evaluate(np.ascontiguousarray(places), box, spans, net, found)
        return found

    @cached_property
    def still(self) -> NDArray[np.bool_]:
        """Which triangles (m,) no control point that is displaced can move."""
        lattice = self.patches.lattice
        moved = np.any(self.net != lattice.points(), axis=1).reshape([basis.count for basis in lattice.bases])
        within = np.pad(moved.astype(int).cumsum(0).cumsum(1).cumsum(2), ((1, 0), (1, 0), (1, 0)))
        (low, high), counts = self.patches.boxes, np.array(lattice.spans)
        low, high = (
            np.round((end - lattice.lower) / (lattice.upper - lattice.lower) * counts, 9) for end in (low, high)
        )
        # The functions that do not vanish everywhere on the box.
        first = np.clip(np.floor(low).astype(int), 0, counts + 2)
        stop = np.clip(np.ceil(high).astype(int) + 3, first + 1, counts + 3)
        count = np.zeros(len(first), int)
        for signs in np.ndindex(2, 2, 2):
            corner = np.where(signs, stop, first)
            count += (-1) ** (3 - sum(signs)) * within[tuple(corner.T)]
        return count == 0

    @cached_property
    def slopes(self) -> Floats:
        """A (m, 3): bounds of |∂φ/∂x_k| on the knot cells around each triangle."""
        return np.stack([self._over(size, *self.patches.spans) for size in self._sizes[0]], axis=1)

    @cached_property
    def bends(self) -> Floats:
        """(m, 3, 3): bounds of |∂²φ/∂x_k∂x_m| there, 1/mm."""
        found = np.empty((len(self.patches.nodes), 3, 3))
        for (k, m), size in self._sizes[1].items():
            found[:, k, m] = found[:, m, k] = self._over(size, *self.patches.spans)
        return found

    @cached_property
    def _sizes(self) -> tuple[list[Floats], dict[tuple[int, int], Floats]]:
        """Bounds of the lengths of first and second derivatives on every knot cell."""
        axes = np.eye(3, dtype=int)
        pairs = combinations_with_replacement(range(3), 2)
        return [self._size(axis) for axis in axes], {(k, m): self._size(axes[k] + axes[m]) for k, m in pairs}

    @cached_property
    def _twists(self) -> Floats:
        """(m, 3, 3, 3): bounds of third derivatives on the knot cells around each triangle, 1/mm²."""
        found = np.empty((len(self.patches.nodes), 3, 3, 3))
        for axes in combinations_with_replacement(range(3), 3):
            bound = self._over(self._size(np.bincount(axes, minlength=3)), *self.patches.spans)
            for each in set(permutations(axes)):
                found[:, each[0], each[1], each[2]] = bound
        return found

    def bends_near(self, patch: Ints, middles: Floats, reach: Floats) -> Floats:
        """Bounds (n, 3, 3) of second derivatives within `reach` (n, 3) of places (n, 3) on triangles, 1/mm."""
        here = np.linalg.norm(self.seconds(middles), axis=1)[:, _SECOND]
        near = here + np.einsum("nkmc,nc->nkm", self._twists[patch], reach)
        return np.where(self.still[patch, None, None], 0.0, np.minimum(near, self.bends[patch]))

    def _size(self, order: Ints) -> Floats:
        """Bounds of the length of a partial derivative of the map on every knot cell."""
        lattice = self.patches.lattice
        net = self.net.reshape(*(basis.count for basis in lattice.bases), 3)
        for axis, basis in enumerate(lattice.bases):
            width = lattice.upper[axis] - lattice.lower[axis]
            for times in range(order[axis]):
                net = _differentiated(net, axis, basis, times) / width
        size = np.linalg.norm(net, axis=-1)
        for axis, basis in enumerate(lattice.bases):
            # Of the functions that do not vanish in a knot span.
            wide = basis.degree + 1 - order[axis]
            size = np.lib.stride_tricks.sliding_window_view(size, wide, axis=axis).max(axis=-1)
        return size

    def _over(self, size: Floats, first: Ints, last: Ints) -> Floats:
        """The largest values (n,) on boxes of knot cells."""
        found = np.zeros(len(first))
        for step in np.ndindex(*((last - first).max(axis=0, initial=0) + 1)):
            found = np.maximum(found, size[tuple(np.minimum(first + step, last).T)])
        return found

    def hulls(self, lower: Floats, upper: Floats) -> Iterator[tuple[Ints, Floats]]:
        """Control points (k, 64, 3) in mm whose convex hulls hold what boxes (n, 3) in the reference are moved to.

        Of each box there is one set for every knot cell in which a part of it is; with the numbers (k,) of the boxes.
        """
        lattice = self.patches.lattice
        net, counts = self.net.reshape(*(basis.count for basis in lattice.bases), 3), np.array(lattice.spans)
        ends = ((end - lattice.lower) / (lattice.upper - lattice.lower) * counts for end in (lower, upper))
        low, high = (np.clip(end, 0.0, counts) for end in ends)
        first = np.minimum(np.floor(low).astype(int), counts - 1)
        last = np.clip(np.ceil(high).astype(int) - 1, first, counts - 1)
        for step in np.ndindex(*((last - first).max(axis=0, initial=0) + 1)):
            some = np.flatnonzero((first + step <= last).all(axis=1))
            cell = first[some] + step
            start, stop = (np.clip(end[some] - cell, 0.0, 1.0) for end in (low, high))
            i, j, k = (cell[:, axis, None] + np.arange(4) for axis in range(3))
            near = net[i[:, :, None, None], j[:, None, :, None], k[:, None, None, :]]
            for axis in range(3):
                by = _bernstein(start[:, axis], stop[:, axis])
                near = np.moveaxis(np.einsum("nbf,nf...->nb...", by, np.moveaxis(near, 1 + axis, 1)), 1, 1 + axis)
            yield some, near.reshape(len(some), 64, 3)

    def pieces(self) -> Pieces:
        """Every triangle as one piece."""
        count = len(self.patches.nodes)
        bary = np.tile(np.eye(3), (count, 1, 1))
        return self._made(np.arange(count), bary, self.patches.nodes[:, :3], None)

    def between(self, patch: Ints, bary: Floats) -> Pieces:
        """Parts of triangles (n,) between points (n, 3, 3) in barycentric coordinates."""
        place = self.patches.places(np.repeat(patch, 3), bary.reshape(-1, 3)).reshape(bary.shape)
        return self._made(patch, bary, place, None)

    def divided(self, pieces: Pieces) -> Pieces:
        """Each piece in four, one after the other."""
        bary = np.einsum("sc,ncb->nsb", _DIVIDED, pieces.bary)[:, PARTS]
        middles = np.einsum("sc,ncb->nsb", _MIDDLES, pieces.bary).reshape(-1, 3)
        patch = np.repeat(pieces.patch, 3)
        place = self.patches.places(patch, middles)
        x = np.concatenate([pieces.x, self.map(place).reshape(-1, 3, 3)], axis=1)[:, PARTS]
        place = np.concatenate([pieces.place, place.reshape(-1, 3, 3)], axis=1)[:, PARTS]
        shape = (-1, 3, 3)
        return self._made(np.repeat(pieces.patch, 4), bary.reshape(shape), place.reshape(shape), x.reshape(shape))

    def bows(self, pieces: Pieces) -> tuple[Floats, Floats]:
        """How far the middles of the edges 01, 12 and 20 of pieces are from those of flat triangles, (n, 3, 3) in mm.

        And how far the surface may be from the quadratic triangles through corners and middles, (n,) in mm.
        """
        around = np.roll(np.arange(3), -1)
        bary = (pieces.bary + pieces.bary[:, around]) / 2.0
        place = self.patches.places(np.repeat(pieces.patch, 3), bary.reshape(-1, 3))
        off = np.abs(place.reshape(bary.shape) - (pieces.place + pieces.place[:, around]) / 2.0).max(axis=1)
        w, z = np.ptp(pieces.place, axis=1) + 8.0 * off, 10.0 * off
        third = np.where(self.still[pieces.patch, None, None, None], 0.0, self._twists[pieces.patch])
        rest = np.einsum("nklm,nk,nl,nm->n", third, w, w, w) + 3.0 * np.einsum("nkl,nk,nl->n", pieces.bends, w, z)
        return self.map(place).reshape(bary.shape) - (pieces.x + pieces.x[:, around]) / 2.0, _REST * rest

    def twisted(self, pieces: Pieces) -> Floats:
        """How far gradients of the map on pieces are from those that are linear between their corners, (n,).

        The error of linear interpolation as in the first bound above, of the derivative along every axis, and what the
        way from the flat triangle in the reference to the face changes.
        """
        edges = np.abs(pieces.place - pieces.place[:, np.roll(np.arange(3), -1)])
        third = np.where(self.still[pieces.patch, None, None, None], 0.0, self._twists[pieces.patch])
        weight = _over_extents(np.einsum("nmkl,nl->nmk", third, edges.max(axis=1)), edges.max(axis=1)[:, None])
        along = np.einsum("nek,nmk->nem", edges**2, weight).max(axis=1) / 6.0
        return np.linalg.norm(along, axis=1) + np.linalg.norm(pieces.bends, axis=(1, 2)) * pieces.bulge

    def _made(self, patch: Ints, bary: Floats, place: Floats, x: Floats | None) -> Pieces:
        if x is None:
            x = self.map(place.reshape(-1, 3)).reshape(place.shape)
        around = np.roll(np.arange(3), -1)
        edges = np.abs(place - place[:, around])
        middles = self.patches.places(np.repeat(patch, 3), ((bary + bary[:, around]) / 2.0).reshape(-1, 3))
        off = np.abs(middles.reshape(place.shape) - (place + place[:, around]) / 2.0)
        bulge = np.linalg.norm(off, axis=2).max(axis=1) * 4.0 / 3.0
        center = place.mean(axis=1)
        bends = self.bends_near(patch, center, np.abs(place - center[:, None]).max(axis=1) + bulge[:, None])
        longest = edges.max(axis=1)
        weight = _over_extents(np.einsum("nkm,nm->nk", bends, longest), longest)
        straight = np.einsum("nek,nk->ne", edges**2, weight).max(axis=1) / 6.0
        slopes = self.slopes[patch]
        # A quadratic triangle's derivatives differ from the edges of its flat one by no more than eight such distances.
        tangents = np.einsum("nek,nk->ne", edges + 8.0 * off.max(axis=1, keepdims=True), slopes)
        area = np.sort(tangents, axis=1)[:, :2].prod(axis=1) / 2.0
        off = np.einsum("nek,nk->ne", off, slopes).max(axis=1) * 4.0 / 3.0
        return Pieces(patch, bary, place, x, straight + off, bulge, bends, area)


def _over_extents(sums: Floats, extents: Floats) -> Floats:
    """Quotients, zero along axes in which pieces have no extent."""
    return np.divide(sums, extents, out=np.zeros_like(sums), where=extents > 0)


def displaced(surface: LatticeSurface, patches: Patches) -> Displaced:
    """A surface with its faces in the reference."""
    return Displaced(patches, np.ascontiguousarray(surface.net))


def _bernstein(start: Floats, stop: Floats) -> Floats:
    """From the four B-splines of a knot span to Bernstein coefficients on parts of it, (n, 4, 4): by polar forms."""
    found = np.empty((len(start), 4, 4))
    for number in range(4):
        rest = 3 - number
        once = rest * start + number * stop
        twice = comb(rest, 2) * start**2 + rest * number * start * stop + comb(number, 2) * stop**2
        found[:, number] = np.stack([np.ones_like(start), once / 3, twice / 3, start**rest * stop**number], 1) @ _POWERS
    return found


def _differentiated(net: Floats, axis: int, basis: Basis, times: int) -> Floats:
    """Coefficients of the derivative of a spline along an axis, of which it has been differentiated some times."""
    degree = basis.degree - times
    knots = basis.knots[times : len(basis.knots) - times]
    widths = knots[degree + 1 : -1] - knots[1 : -degree - 1]
    change = np.moveaxis(np.diff(net, axis=axis), axis, 0)
    return np.moveaxis(change * (degree / widths).reshape(-1, *[1] * (change.ndim - 1)), 0, axis)


@numba.njit(cache=True, nogil=True)
def _evaluate(places, box, spans, net, found):
    """Fill in values and derivatives of a trivariate uniform cubic spline, see `Displaced._evaluated`."""
    functions, first = np.zeros((3, 3, 4)), np.zeros(3, np.int64)
    line, plane = np.zeros((3, 3)), np.zeros((6, 3))
    orders = 1 if found.shape[2] == 1 else 2 if found.shape[2] == 4 else 3
    for n in range(len(places)):
        for axis in range(3):
            scale = spans[axis] / (box[1, axis] - box[0, axis])
            t = min(max((places[n, axis] - box[0, axis]) * scale, 0.0), float(spans[axis]))
            first[axis] = min(int(t), spans[axis] - 1)
            u = t - first[axis]
            v, own, by, twice = 1.0 - u, functions[axis, 0], functions[axis, 1], functions[axis, 2]
            own[0], own[3] = v * v * v / 6.0, u * u * u / 6.0
            own[1], own[2] = (4.0 - 6.0 * u * u + 3.0 * u * u * u) / 6.0, (4.0 - 6.0 * v * v + 3.0 * v * v * v) / 6.0
            by[0], by[3] = -v * v / 2.0 * scale, u * u / 2.0 * scale
            by[1], by[2] = (3.0 * u - 4.0) * u / 2.0 * scale, -(3.0 * v - 4.0) * v / 2.0 * scale
            twice[0], twice[3] = v * scale * scale, u * scale * scale
            twice[1], twice[2] = (3.0 * u - 2.0) * scale * scale, (3.0 * v - 2.0) * scale * scale
        # Sums over one axis after another: `line` has derivatives along z, `plane` those along y and z.
        x, y, z = functions
        for i in range(4):
            plane[:] = 0.0
            for j in range(4):
                points = net[first[0] + i, first[1] + j]
                for m in range(orders):
                    for c in range(3):
                        line[m, c] = 0.0
                        for k in range(4):
                            line[m, c] += z[m, k] * points[first[2] + k, c]
                for c in range(3):
                    plane[0, c] += y[0, j] * line[0, c]
                    if orders > 1:
                        plane[1, c] += y[1, j] * line[0, c]
                        plane[2, c] += y[0, j] * line[1, c]
                    if orders > 2:
                        plane[3, c] += y[2, j] * line[0, c]
                        plane[4, c] += y[1, j] * line[1, c]
                        plane[5, c] += y[0, j] * line[2, c]
            for c in range(3):
                found[n, c, 0] += x[0, i] * plane[0, c]
                if orders > 1:
                    found[n, c, 1] += x[1, i] * plane[0, c]
                    found[n, c, 2] += x[0, i] * plane[1, c]
                    found[n, c, 3] += x[0, i] * plane[2, c]
                if orders > 2:
                    found[n, c, 4] += x[2, i] * plane[0, c]
                    found[n, c, 5] += x[1, i] * plane[1, c]
                    found[n, c, 6] += x[1, i] * plane[2, c]
                    found[n, c, 7] += x[0, i] * plane[3, c]
                    found[n, c, 8] += x[0, i] * plane[4, c]
                    found[n, c, 9] += x[0, i] * plane[5, c]
