"""Distances between surfaces and within one (the paper's (23)): who is near whom, found by a spatial index.

A sample's partner is a *foot*: the closest point of the other surface itself, not its closest sample, which would
overrate a wall of 2 mm by up to 0.05 mm. The foot is found from the second-order expansion at the closest sample and
then held as a fixed combination of four samples plus a fixed rest, so that distances are smooth in the control points
and exact where they were found.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pneumorph.constraint.sampling import Fields, Grid, with_discs

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


class Feet(NamedTuple):
    """Partners of n samples, in arrays of fixed shape.

    The foot of sample i is Σ_k weight[i, k]·X[index[i, k]] + rest[i] with X the positions of all samples.
    """

    index: Ints  # (n, 4)
    weight: Floats  # (n, 4)
    rest: Floats  # (n, 3) mm
    active: NDArray[np.bool_]  # (n,): false where no partner is within reach


def distances(X: Array, source: Ints, feet: Feet) -> Array:
    """Distances (n,) in mm of the samples X[source] to their feet; only meaningful where the feet are active.

    X is (n_samples, 3). Differentiable, also at distance zero.
    """
    foot = jnp.einsum("nk,nkc->nc", feet.weight, X[feet.index]) + feet.rest
    return jnp.sqrt(jnp.sum((X[source] - foot) ** 2, axis=1) + 1e-12)


@dataclass(frozen=True, eq=False)
class Target:
    """A surface to which closest points are asked: the tube, with the end discs where it is a closed chamber.

    Samples are numbered row by row, n of them in all.

    Attributes
    ----------
    grid : Grid
        Samples of the tube.
    rings : int
        Number of rings of samples on each disc, before and after the tube's rows; 0 without discs.
    fields : Fields
        Position and derivatives per mm, each (n, 3).
    ahead, behind : (rows,) arrays
        Room to move in mm of the second parameter to the next and the previous row. Tube and disc meet in a kink at the
        rim, so an expansion on the rim, which is the tube's, stays on the tube.
    """

    grid: Grid
    rings: int
    fields: Fields
    ahead: Floats
    behind: Floats

    @property
    def x(self) -> Floats:
        """Positions of the samples, (n, 3)."""
        return self.fields.x

    @property
    def columns(self) -> int:
        return len(self.grid.q)

    @property
    def across(self) -> float:
        """Room to move in mm of the first parameter to the next column."""
        return self.grid.step[0]

    @property
    def tube(self) -> slice:
        """Which of the samples lie on the tube."""
        first = self.rings * self.columns
        return slice(first, first + len(self.grid.r) * self.columns)

    def normals(self) -> Floats:
        """Unit normals, (n, 3)."""
        n = np.cross(self.fields.q, self.fields.r)
        return n / np.maximum(np.linalg.norm(n, axis=1, keepdims=True), 1e-9)

    def closest(self, points: Floats, near: Ints) -> tuple[Floats, Floats, Floats]:
        """Closest points near given samples, by Newton's method on the second-order expansion there.

        Parameters
        ----------
        points : (n, 3) array
        near : (n,) array
            A sample of this surface for each point.

        Returns
        -------
        distance : (n,) array
        foot : (n, 3) array
        offset : (n, 2) array
            Where the foot is from the sample, in mm of the two parameters; zero where the sample itself is closest.
        """
        x, q, r, qq, qr, rr = (field[near] for field in self.fields)
        row = near // self.columns
        # A foot in the farther half of a cell belongs to the neighbouring sample, hence three quarters are room enough.
        low, high = -0.75 * self.behind[row], 0.75 * self.ahead[row]
        a, b = np.zeros(len(near)), np.zeros(len(near))
        gap = x - points
        for _ in range(4):
            to_q, to_r = q + a[:, None] * qq + b[:, None] * qr, r + a[:, None] * qr + b[:, None] * rr
            away = (
                gap
                + a[:, None] * (q + 0.5 * a[:, None] * qq + b[:, None] * qr)
                + b[:, None] * (r + 0.5 * b[:, None] * rr)
            )
            slope_a, slope_b = _dot(away, to_q), _dot(away, to_r)
            aa = _dot(to_q, to_q) + _dot(away, qq)
            ab = _dot(to_q, to_r) + _dot(away, qr)
            bb = _dot(to_r, to_r) + _dot(away, rr)
            lowest = 0.5 * (aa + bb) - np.hypot(0.5 * (aa - bb), ab)
            shift = np.maximum(0.05 - lowest, 0.0)
            aa, bb = aa + shift, bb + shift
            determinant = aa * bb - ab**2
            a = np.clip(a - (bb * slope_a - ab * slope_b) / determinant, -0.75 * self.across, 0.75 * self.across)
            b = np.clip(b - (aa * slope_b - ab * slope_a) / determinant, low, high)
        foot = x + a[:, None] * (q + 0.5 * a[:, None] * qq + b[:, None] * qr) + b[:, None] * (r + 0.5 * b[:, None] * rr)
        distance, at_sample = np.linalg.norm(foot - points, axis=1), np.linalg.norm(gap, axis=1)
        keep = ~(distance < at_sample)
        foot[keep], a[keep], b[keep] = x[keep], 0.0, 0.0
        return np.minimum(distance, at_sample), foot, np.stack([a, b], axis=1)

    def feet(self, near: Ints, foot: Floats, offset: Floats, first: int) -> tuple[Ints, Floats, Floats]:
        """Feet as combinations of the four samples around them; this surface's samples are numbered from `first`."""
        row, column = np.divmod(near, self.columns)
        forward = offset[:, 1] >= 0.0
        room = np.where(forward, self.ahead[row], self.behind[row])
        u = np.abs(offset[:, 0]) / self.across
        v = np.divide(np.abs(offset[:, 1]), room, out=np.zeros(len(near)), where=room > 0.0)
        beside = (column + np.where(offset[:, 0] >= 0.0, 1, -1)) % self.columns
        beyond = np.where(room > 0.0, row + np.where(forward, 1, -1), row)
        corners = [(row, column), (row, beside), (beyond, column), (beyond, beside)]
        index = np.stack([r * self.columns + c for r, c in corners], axis=1)
        weight = np.stack([(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v], axis=1)
        rest = foot - np.einsum("nk,nkc->nc", weight, self.x[index])
        return (index + first).astype(np.int32), weight, rest


def target(fields: Fields, grid: Grid, discs: bool) -> Target:
    """Make a surface searchable, from the fields of its tube, with or without its end discs."""
    rings = len(grid.rings) if discs else 0
    whole = with_discs(fields, grid) if discs else fields
    rows = len(grid.r) + 2 * rings
    radius = grid.size[0] / (2.0 * np.pi)
    ahead = np.full(rows, grid.step[1])
    if rings:
        ahead[:rings] = ahead[-rings:] = radius / rings
    behind = ahead.copy()
    behind[rings] = ahead[rows - rings - 1] = 0.0
    behind[0] = ahead[-1] = 0.0
    return Target(
        grid=grid,
        rings=rings,
        fields=Fields(*(np.ascontiguousarray(np.asarray(field).reshape(3, -1).T) for field in whole)),
        ahead=ahead,
        behind=behind,
    )


def nearest(points: Floats, target: Target, bound: float) -> tuple[NDArray[np.bool_], Ints]:
    """Whether a sample of the target is within `bound` of each point, and its number (0 where none is)."""
    distance, near = _tree(target.x).query(points, distance_upper_bound=bound, workers=-1)
    within = np.isfinite(distance)
    return within, np.where(within, near, 0)


# Weight in mm of the normals when opposite walls are looked for, and how far they may be from opposite.
_FACING, _TOLERANCE = 1.5, 0.8


def nearest_fold(tube: Target, neighbourhood: float, bound: float) -> tuple[NDArray[np.bool_], Ints, NDArray[np.bool_]]:
    """The nearest sample of the same tube outside the neighbourhood, for each of its n samples.

    Two searches find it. Walls that face each other have opposite normals: the nearest sample in (position, normal),
    the sign of one normal turned, is the facing one, since a sample's own neighbours have its own normal. Where the
    surface has shrunk, the nearest sample is instead one on the edge of the neighbourhood, and those are a fixed
    pattern of steps on the grid.

    Parameters
    ----------
    tube : Target
        Without discs.
    neighbourhood : float
        Distance in mm along the starting surface within which samples do not count.
    bound : float
        Distance in mm beyond which nothing is looked for.

    Returns
    -------
    within : (n,) bool array
        Whether there is one within the bound.
    near : (n,) array
        Its number (0 where there is none).
    facing : (n,) bool array
        Whether it is on a facing wall rather than on the edge of the neighbourhood.
    """
    edge_distance, edge_near = _nearest_on_edge(tube, neighbourhood)
    normals = tube.normals()
    reach = float(np.hypot(bound, _FACING * _TOLERANCE))
    tree = _tree(np.hstack([tube.x, _FACING * normals]))
    found, near = tree.query(np.hstack([tube.x, -_FACING * normals]), distance_upper_bound=reach, workers=-1)
    near = np.where(np.isfinite(found), near, 0)
    counts = np.isfinite(found) & (_apart(tube.grid, np.arange(len(near)), near) >= neighbourhood)
    distance = np.where(counts, np.linalg.norm(tube.x - tube.x[near], axis=1), np.inf)

    facing = distance < edge_distance
    distance, near = np.where(facing, distance, edge_distance), np.where(facing, near, edge_near)
    within = distance <= bound
    return within, np.where(within, near, 0), facing & within


def _tree(points: Floats) -> KDTree:
    # Surfaces fill space so unevenly that trees split at midpoints and left uncompacted answer twice as fast.
    return KDTree(points, balanced_tree=False, compact_nodes=False)


def _apart(grid: Grid, i: Ints, j: Ints) -> Floats:
    """Distance in mm of samples i and j along the starting tube."""
    columns = len(grid.q)
    (row_i, column_i), (row_j, column_j) = np.divmod(i, columns), np.divmod(j, columns)
    around = np.abs(column_i - column_j)
    around = np.minimum(around, columns - around) * np.minimum(grid.shrink[row_i, 0], grid.shrink[row_j, 0])
    return np.hypot(around * grid.step[0], (row_i - row_j) * grid.step[1])


def _nearest_on_edge(tube: Target, neighbourhood: float) -> tuple[Floats, Ints]:
    """Distance and number of the nearest among the samples just outside the neighbourhood, for each sample."""
    step_q, step_r = tube.grid.step
    rows, columns = tube.grid.shape
    shrink = tube.grid.shrink[:, 0]
    x = np.moveaxis(tube.x.reshape(rows, columns, 3), -1, 0)
    number = np.arange(rows * columns).reshape(rows, columns)
    best, near = np.full((rows, columns), np.inf), np.zeros((rows, columns), dtype=np.int64)
    for up in range(min(rows - 1, int(np.ceil(neighbourhood / step_r))) + 1):
        lower, upper = slice(0, rows - up), slice(up, rows)
        left = max(neighbourhood**2 - (up * step_r) ** 2, 0.0) ** 0.5
        aside = int(np.ceil(left / step_q - 1e-9))
        if aside > columns // 2:
            continue
        # Near a pole a step aside is shorter, and these samples may still be neighbours.
        around = aside * step_q * np.minimum(shrink[lower], shrink[upper])
        neighbours = np.hypot(around, up * step_r) < neighbourhood - 1e-6
        for shift in {aside, -aside}:
            gap = x[:, lower] - np.roll(x[:, upper], shift, axis=2)
            distance = np.sqrt(gap[0] ** 2 + gap[1] ** 2 + gap[2] ** 2)
            distance[neighbours] = np.inf
            back = np.roll(distance, -shift, axis=1)
            for mine, theirs, numbers in (
                (lower, distance, np.roll(number[upper], shift, axis=1)),
                (upper, back, np.roll(number[lower], -shift, axis=1)),
            ):
                closer = theirs < best[mine]
                best[mine][closer] = theirs[closer]
                near[mine][closer] = numbers[closer]
    return best.ravel(), near.ravel()


def _dot(a: Floats, b: Floats) -> Floats:
    return np.einsum("nc,nc->n", a, b)
