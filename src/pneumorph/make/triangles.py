"""Triangulation of bodies with a guaranteed chord error, the largest distance from the exact surfaces."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import manifold3d
import numpy as np
from numpy.typing import NDArray

from pneumorph.errors import ComputationError
from pneumorph.geometry.tube.surface import TubeSurface, turn_to

Array = NDArray[np.float64]

MAX_TRIANGLES = 5_000_000
"""Largest number of triangles of a part, about 250 MB of binary STL."""


@dataclass(frozen=True, eq=False)
class Triangles:
    """A closed surface of triangles, oriented with normals out of the solid.

    Attributes
    ----------
    points : (n, 3) array
        Vertices in mm, all different.
    corners : (m, 3) integer array
        Indices into `points`.
    """

    points: Array
    corners: NDArray[np.int64]

    @property
    def volume(self) -> float:
        """Enclosed volume in mm³, by the divergence theorem."""
        a, b, c = np.moveaxis(self.points[self.corners], 1, 0)
        return float(np.einsum("ni,ni->", a, np.cross(b, c)) / 6.0)


def triangulate(surfaces: Iterable[TubeSurface], chord: float) -> Triangles:
    """Triangulate surfaces that together bound a solid.

    Parameters
    ----------
    surfaces : iterable of TubeSurface
        Those of a body, or one chamber from `fill_chamber`.
    chord : float
        Largest distance in mm between the surfaces and the triangles.

    Raises
    ------
    ComputationError
        If a surface needs more than `MAX_TRIANGLES`.
    """
    return together([_tube(surface, chord) for surface in surfaces])


def together(parts: Sequence[Triangles]) -> Triangles:
    """The triangles of several parts as one; equal points are not merged."""
    first = np.cumsum([0, *(len(part.points) for part in parts)])
    corners = [part.corners + offset for part, offset in zip(parts, first, strict=False)]
    return Triangles(np.concatenate([part.points for part in parts]), np.concatenate(corners))


def _tube(surface: TubeSurface, chord: float) -> Triangles:
    """A grid in (q, r): equally many lines in every span of q, and in each span of r as many as its curvature needs."""
    around, along = _divisions(surface, chord)
    q = _divided(surface.basis_q.breaks, np.full(surface.basis_q.spans, around))[:-1]
    r = _divided(surface.basis_r.breaks, along)
    grid = surface.sample(q, r)
    points, corners = grid.reshape(-1, 3), [_cells(grid)]
    rim = np.arange(len(q))
    ends = (rim, rim + len(points) - len(rim))
    for tip, (pole, own, direction) in enumerate(zip(surface.poles, ends, surface.directions, strict=True)):
        if not pole:
            cap = _cap(surface, points @ turn_to(direction), own)
            corners.append(cap if tip else cap[:, ::-1])
    # The end row of a pole is a single point: keep its last copy at the base, its first at the tip.
    first, last = (rim[-1] if pole else 0 for pole in surface.poles)
    kept = np.clip(np.concatenate(corners), first, len(points) - 1 - last) - first
    proper = (kept != np.roll(kept, 1, axis=1)).all(axis=1)
    return Triangles(points[first : len(points) - last], kept[proper])


def _cap(surface: TubeSurface, points: Array, rim: NDArray[np.int64]) -> NDArray[np.int64]:
    """Triangles of an end disc, in a plane z = constant, between the points of its rim, in the sense of q."""
    # q runs clockwise on a chamber, but the polygon must be given counter-clockwise.
    rim = rim[::-1] if surface.cavity else rim
    triangles = rim[manifold3d.triangulate([points[rim, :2]])]
    return triangles[:, ::-1] if surface.cavity else triangles


def _divisions(surface: TubeSurface, chord: float) -> tuple[int, NDArray[np.int64]]:
    """Subdivisions of every knot span in q, and of each in r, that keep the chord error with few triangles.

    Over a right triangle with legs h_q, h_r the error of linear interpolation is at most
    (h_q² |S_qq| + 2 h_q h_r |S_qr| + h_r² |S_rr|) / 8 (Filip, Magedson and Markot 1986), with the derivatives bounded
    by their Bézier control points.
    """
    qq, qr, rr = _second_derivatives(surface)
    allowed = 8.0 * chord
    least = int(np.sqrt(qq.max() / allowed)) + 1
    if least * max(1.0, np.sqrt(rr.max() / allowed)) > MAX_TRIANGLES:
        raise ComputationError(_too_many(surface, chord))
    best: tuple[int, NDArray[np.int64]] | None = None
    for around in range(least, 4 * least + 1):
        across, mixed = qq / around**2, qr / around
        # The largest h_r, in spans, that the bound allows.
        step = (allowed - across) / (mixed + np.sqrt(mixed**2 + rr * (allowed - across)) + 1e-300)
        along = np.ceil(1.0 / np.minimum(step, 1.0)).max(axis=1).astype(np.int64)
        if best is None or around * along.sum() < best[0] * best[1].sum():
            best = around, along
    assert best is not None
    if 2 * best[0] * best[1].sum() * surface.basis_q.spans > MAX_TRIANGLES:
        raise ComputationError(_too_many(surface, chord))
    return best


def _too_many(surface: TubeSurface, chord: float) -> str:
    needed = f"needs more than {MAX_TRIANGLES} triangles for a chord error of {chord:g} mm"
    return f"{surface.name} {needed}; allow a larger error"


def _second_derivatives(surface: TubeSurface) -> tuple[Array, Array, Array]:
    """Bounds (n_r, n_q) in mm of |S_qq|, |S_qr| and |S_rr| on every knot span, with the span as unit of q and r."""
    nodes = np.arange(4) / 3.0
    bernstein = np.stack([(1 - nodes) ** 3, 3 * nodes * (1 - nodes) ** 2, 3 * nodes**2 * (1 - nodes), nodes**3], axis=1)
    inverse = np.linalg.inv(bernstein)
    q, r = (_divided(basis.breaks, np.full(basis.spans, 3)) for basis in (surface.basis_q, surface.basis_r))
    windows = np.lib.stride_tricks.sliding_window_view(surface.sample(q, r), (4, 4), axis=(0, 1))[::3, ::3]
    bezier = np.einsum("am,bn,rqimn->rqiab", inverse, inverse, windows)
    across = (6.0 * np.diff(bezier, 2, axis=4), 9.0 * np.diff(np.diff(bezier, axis=3), axis=4))
    qq, qr, rr = (np.linalg.norm(each, axis=2).max(axis=(2, 3)) for each in (*across, 6.0 * np.diff(bezier, 2, axis=3)))
    return qq, qr, rr


def _divided(breaks: Array, parts: NDArray[np.int64]) -> Array:
    """Divide every interval into the given number of equal parts."""
    inner = [
        np.linspace(start, stop, count, endpoint=False)
        for start, stop, count in zip(breaks[:-1], breaks[1:], parts, strict=True)
    ]
    return np.concatenate([*inner, breaks[-1:]])


def _cells(grid: Array) -> NDArray[np.int64]:
    """Two triangles for every cell of a grid that is closed in q, split along the shorter diagonal."""
    rows, columns = grid.shape[:2]
    number = np.arange(rows * columns).reshape(rows, columns)
    a, b = number[:-1], np.roll(number, -1, axis=1)[:-1]
    d, c = number[1:], np.roll(number, -1, axis=1)[1:]
    points = grid.reshape(-1, 3)
    diagonals = [np.linalg.norm(points[end] - points[start], axis=-1) for start, end in ((a, c), (b, d))]
    rising = (diagonals[0] <= diagonals[1])[..., None]
    first = np.where(rising, np.stack([a, b, c], axis=-1), np.stack([a, b, d], axis=-1))
    second = np.where(rising, np.stack([a, c, d], axis=-1), np.stack([b, c, d], axis=-1))
    return np.concatenate([first.reshape(-1, 3), second.reshape(-1, 3)])
