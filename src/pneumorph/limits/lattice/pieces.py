"""Surfaces of bodies from files in pieces, each within a known distance of a flat triangle.

A point of the reference faces, which are six-node triangles x̂(λ), moves to φ(x̂), where φ is the spline map of the
lattice. On the part of a face between three of its points, with the flat triangle x̃(λ) = Σ λ_i x̂_i in reference
coordinates,

    |φ(x̂(λ)) − Σ λ_i φ(x̂_i)| ≤ |φ(x̂) − φ(x̃)| + |φ(x̃) − Σ λ_i φ(x̂_i)|
                              ≤ 4/3 max_e Σ_k A_k |m_e,k| + 1/6 max_e Σ_k Q_k d_e,k²,

with the edges d_e and the distances m_e of their middles on the face from those of the chords: x̂ is quadratic, and
Σ_{i<j} λ_i λ_j ≤ 1/3. A_k bounds |∂φ/∂x_k|, and Q_k = Σ_l |∂²φ/∂x_k∂x_l|, in the knot cells around the face, by the
largest of their B-spline coefficients, which are differences of control points. Both terms fall to a quarter where a
piece is divided into four.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.bspline import Basis
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.surface import Lattice

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

# Corners of the four parts of a triangle among its corners and the middles of its edges 01, 12, 20.
_PARTS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
_MIDDLES = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]])
_DIVIDED = np.vstack([np.eye(3), _MIDDLES])


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
        return _places(self.nodes, np.ascontiguousarray(patch), np.ascontiguousarray(bary))


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
    """

    patch: Ints
    bary: Floats
    place: Floats
    x: Floats
    error: Floats
    bulge: Floats

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
        return self._evaluated(places, slopes=False)[:, :, 0]

    def gradients(self, places: Floats) -> Floats:
        """Derivatives (n, 3, 3) of the map there: of each component along x, y and z."""
        return self._evaluated(places, slopes=True)[:, :, 1:]

    def _evaluated(self, places: Floats, slopes: bool) -> Floats:
        """Where places (n, 3) are moved, and derivatives if asked for, (n, 3, 1 or 4)."""
        lattice = self.patches.lattice
        counts = np.array([basis.count for basis in lattice.bases])
        knots = np.zeros((3, max(counts) + 4))
        for axis, basis in enumerate(lattice.bases):
            knots[axis, : basis.count + 4] = basis.knots
        found = np.zeros((len(places), 3, 4 if slopes else 1))
        box, spans = np.stack([lattice.lower, lattice.upper]), np.array(lattice.spans)
        _evaluate(np.ascontiguousarray(places), box, spans, knots, self.net.reshape(*counts, 3), found)
        return found

    @cached_property
    def slopes(self) -> Floats:
        """A (m, 3): bounds of |∂φ/∂x_k| on the knot cells around each triangle."""
        return np.stack([self._over(size, *self.patches.spans) for size in self._sizes[0]], axis=1)

    @cached_property
    def bends(self) -> Floats:
        """(m, 3, 3): bounds of |∂²φ/∂x_k∂x_m| there, 1/mm."""
        return self.bends_over(*self.patches.spans)

    def bends_over(self, first: Ints, last: Ints) -> Floats:
        """The same (n, 3, 3) on boxes from the first to the last knot span (n, 3) along each axis."""
        return np.stack(
            [np.stack([self._over(size, first, last) for size in row], axis=1) for row in self._sizes[1]], 1
        )

    @cached_property
    def _sizes(self) -> tuple[list[Floats], list[list[Floats]]]:
        """Bounds of the lengths of first and second derivatives on every knot cell."""
        axes = np.eye(3, dtype=int)
        return [self._size(axis) for axis in axes], [[self._size(one + other) for one in axes] for other in axes]

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

    def pieces(self) -> Pieces:
        """Every triangle as one piece."""
        count = len(self.patches.nodes)
        bary = np.tile(np.eye(3), (count, 1, 1))
        return self._made(np.arange(count), bary, self.patches.nodes[:, :3], None)

    def divided(self, pieces: Pieces) -> Pieces:
        """Each piece in four, one after the other."""
        bary = np.einsum("sc,ncb->nsb", _DIVIDED, pieces.bary)[:, _PARTS]
        middles = np.einsum("sc,ncb->nsb", _MIDDLES, pieces.bary).reshape(-1, 3)
        patch = np.repeat(pieces.patch, 3)
        place = self.patches.places(patch, middles)
        x = np.concatenate([pieces.x, self.map(place).reshape(-1, 3, 3)], axis=1)[:, _PARTS]
        place = np.concatenate([pieces.place, place.reshape(-1, 3, 3)], axis=1)[:, _PARTS]
        shape = (-1, 3, 3)
        return self._made(np.repeat(pieces.patch, 4), bary.reshape(shape), place.reshape(shape), x.reshape(shape))

    def _made(self, patch: Ints, bary: Floats, place: Floats, x: Floats | None) -> Pieces:
        if x is None:
            x = self.map(place.reshape(-1, 3)).reshape(place.shape)
        around = np.roll(np.arange(3), -1)
        edges = np.abs(place - place[:, around])
        middles = self.patches.places(np.repeat(patch, 3), ((bary + bary[:, around]) / 2.0).reshape(-1, 3))
        off = np.abs(middles.reshape(place.shape) - (place + place[:, around]) / 2.0)
        straight = np.einsum("nek,nk->ne", edges**2, self.bends[patch].sum(axis=2)).max(axis=1) / 6.0
        bulge = np.einsum("nek,nk->ne", off, self.slopes[patch]).max(axis=1) * 4.0 / 3.0
        return Pieces(patch, bary, place, x, straight + bulge, np.linalg.norm(off, axis=2).max(axis=1) * 4.0 / 3.0)


def displaced(surface: LatticeSurface, patches: Patches) -> Displaced:
    """A surface with its faces in the reference."""
    return Displaced(patches, np.ascontiguousarray(surface.net))


def _differentiated(net: Floats, axis: int, basis: Basis, times: int) -> Floats:
    """Coefficients of the derivative of a spline along an axis, of which it has been differentiated some times."""
    degree = basis.degree - times
    knots = basis.knots[times : len(basis.knots) - times]
    widths = knots[degree + 1 : -1] - knots[1 : -degree - 1]
    change = np.moveaxis(np.diff(net, axis=axis), axis, 0)
    return np.moveaxis(change * (degree / widths).reshape(-1, *[1] * (change.ndim - 1)), 0, axis)


@numba.njit(cache=True, nogil=True)
def _evaluate(places, box, spans, knots, net, found):
    """Fill in the values (n, 3, 1) of a trivariate cubic spline on uniform knots, or derivatives too, (n, 3, 4)."""
    values, slopes, first = np.zeros((3, 4)), np.zeros((3, 4)), np.zeros(3, np.int64)
    left, right = np.zeros(4), np.zeros(4)
    for n in range(len(places)):
        for axis in range(3):
            width = box[1, axis] - box[0, axis]
            t = min(max((places[n, axis] - box[0, axis]) / width, 0.0), 1.0)
            span = min(int(t * spans[axis]), spans[axis] - 1)
            first[axis] = span
            own, by, knot = values[axis], slopes[axis], knots[axis]
            own[0] = 1.0
            for degree in range(1, 4):
                if degree == 3:
                    for r in range(4):
                        below = own[r - 1] / (knot[span + r + 3] - knot[span + r]) if r > 0 else 0.0
                        above = own[r] / (knot[span + r + 4] - knot[span + r + 1]) if r < 3 else 0.0
                        by[r] = 3.0 * (below - above) / width
                left[degree], right[degree] = t - knot[span + 4 - degree], knot[span + 3 + degree] - t
                saved = 0.0
                for r in range(degree):
                    part = own[r] / (right[r + 1] + left[degree - r])
                    own[r] = saved + right[r + 1] * part
                    saved = left[degree - r] * part
                own[degree] = saved
        for i in range(4):
            for j in range(4):
                for k in range(4):
                    point = net[first[0] + i, first[1] + j, first[2] + k]
                    weight = values[0, i] * values[1, j] * values[2, k]
                    for c in range(3):
                        found[n, c, 0] += weight * point[c]
                    if found.shape[2] == 4:
                        along_x = slopes[0, i] * values[1, j] * values[2, k]
                        along_y = values[0, i] * slopes[1, j] * values[2, k]
                        along_z = values[0, i] * values[1, j] * slopes[2, k]
                        for c in range(3):
                            found[n, c, 1] += along_x * point[c]
                            found[n, c, 2] += along_y * point[c]
                            found[n, c, 3] += along_z * point[c]
