"""All limits of a problem on tubes as normalised, differentiable constraint values c ≤ 0 in arrays of fixed shapes.

An optimiser can use them in different ways: in the paper's penalties (32) through `paper_arguments`, or in an augmented
Lagrangian with a multiplier for each entry.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.typing import ArrayLike, NDArray

from pneumorph.geometry.regions import Region
from pneumorph.limits.tube.measures.distances import (
    ClosestPoints,
    distances,
    fold_closest,
    joined,
    sampled_surface,
    wall_closest,
)
from pneumorph.limits.tube.measures.formulas import measures
from pneumorph.limits.tube.measures.grid import Grid, SampledFields, closed_positions, every_second

if TYPE_CHECKING:
    from pneumorph.limits.kinds.kind import Kind
    from pneumorph.problem import Limits


class Partners(NamedTuple):
    """Closest points of all samples at the control points `points` (n_points, 3), in arrays of fixed shapes."""

    wall: ClosestPoints
    fold: ClosestPoints
    points: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LimitFunctions:
    """The limits of a problem on fixed samples of tubes, as functions of the control points.

    Attributes
    ----------
    kinds : tuple of Kind
        Of limits.
    grids : tuple of Grid
        Samples of each surface, the exterior first.
    slices : tuple of slice
        Control points of each surface.
    between : Region
        What is between the planes of the body's ends, in which its end discs lie.
    spec : problem.Limits
    reach : float
        Partners are found up to this distance beyond the limit, mm.
    """

    kinds: tuple[Kind, ...]
    grids: tuple[Grid, ...]
    slices: tuple[slice, ...]
    between: Region
    spec: Limits
    reach: float

    def values(self, points: ArrayLike, partners: Partners) -> dict[str, Array]:
        """Constraint values c ≤ 0 at control points (n_points, 3) or flat, for jax.jit and jax.grad too.

        Returns
        -------
        dict of 1-d arrays of fixed lengths
            By the names of limits: distances from the bound relative to `Limit.scale`, as the kinds of limits say.
        """
        at = SmoothTubes(self, points, partners)
        return {name: value for kind in self.kinds for name, value in kind.smooth(at).items()}

    def paper_arguments(self, values: dict[str, Array], tolerance: float = 0.05) -> dict[str, Array]:
        """Arguments of the barrier f of (32) in (33), from `values`: g/ε_t for distances g in mm, otherwise h/h_max.

        The barrier of a quantity h is zero at h = 0 and one at its limit, that of a distance is zero up to its limit.
        """
        scale = {limit.name: limit.scale(self.spec) for kind in self.kinds for limit in kind.limits if limit.per}
        return {
            name: value * (scale[name] / tolerance) if name in scale else jnp.maximum(value + 1.0, 0.0)
            for name, value in values.items()
        }

    def partners(self, points: ArrayLike) -> Partners:
        """Find the partners of all samples at the control points (n_points, 3) or flat."""
        points = np.asarray(points, dtype=float).reshape(-1, 3)
        fields = self.fields(points)
        closed = [
            sampled_surface(field, grid, discs=grid.cavity) for field, grid in zip(fields, self.grids, strict=True)
        ]
        return Partners(
            wall=joined(
                [
                    wall_closest(closed[a].x, closed[b], self.spec.wall + self.reach, self._first[b])
                    for a, b in self._neighbours
                ]
            ),
            fold=joined(
                [
                    fold_closest(
                        sampled_surface(field, grid, discs=False),
                        self.spec.fold.neighbourhood,
                        self.spec.fold.distance + self.reach,
                        tube.start,
                    )
                    for field, grid, tube in zip(fields, self.grids, self._tubes, strict=True)
                ]
            ),
            points=points,
        )

    def moved(self, points: ArrayLike, partners: Partners) -> bool:
        """Whether control points have moved so far since the partners were found that they must be found again."""
        step = np.asarray(points, dtype=float).reshape(-1, 3) - partners.points
        return bool(np.sqrt((step**2).sum(axis=1).max()) > self.reach / 4.0)

    # Each pair of surfaces is compared once. The exterior has the denser samples, so its samples get partners on the
    # chambers and not vice versa. Its own discs need no samples, because "ends" covers the planes of the body's ends.

    @cached_property
    def _neighbours(self) -> list[tuple[int, int]]:
        return [(a, b) for a in range(len(self.grids)) for b in range(a + 1, len(self.grids))]

    @cached_property
    def _first(self) -> list[int]:
        """Index of each surface's first sample among all positions."""
        counts = [len(grid.q) * (len(grid.r) + (sum(grid.on_discs) if grid.cavity else 0)) for grid in self.grids]
        return [0, *np.cumsum(counts).tolist()]

    @cached_property
    def wall_source(self) -> NDArray[np.int32]:
        """Samples that have partners on other surfaces."""
        blocks = [np.arange(self._first[a], self._first[a + 1]) for a, _ in self._neighbours]
        return np.concatenate(blocks).astype(np.int32)

    @cached_property
    def _tubes(self) -> list[slice]:
        """Positions that are the samples of each tube."""
        starts = [
            first + (grid.on_discs[0] * len(grid.q) if grid.cavity else 0)
            for grid, first in zip(self.grids, self._first, strict=False)
        ]
        return [slice(start, start + len(grid.q) * len(grid.r)) for start, grid in zip(starts, self.grids, strict=True)]

    @cached_property
    def fold_source(self) -> NDArray[np.int32]:
        """Samples that have partners on their own surface."""
        blocks = [tube.start + every_second(grid) for grid, tube in zip(self.grids, self._tubes, strict=True)]
        return np.concatenate(blocks).astype(np.int32)

    def nets(self, points: ArrayLike) -> list[Array]:
        """Control nets (n_r, n_q, 3) of all surfaces."""
        points = jnp.asarray(points).reshape(-1, 3)
        return [points[where].reshape(*grid.net_shape, 3) for grid, where in zip(self.grids, self.slices, strict=True)]

    @cached_property
    def fields(self) -> Callable[[ArrayLike], list[SampledFields]]:
        """Function from control points to the fields of every surface's samples."""

        @jax.jit
        def fields(points: ArrayLike) -> list[SampledFields]:
            return [grid.fields(net) for net, grid in zip(self.nets(points), self.grids, strict=True)]

        return fields

    def positions(self, tubes: list[Array]) -> Array:
        """Positions (n, 3) of all samples used for distances: the tube of the exterior, then the closed chambers."""
        parts = [
            (closed_positions(x, grid) if grid.cavity else x).reshape(3, -1).T
            for x, grid in zip(tubes, self.grids, strict=True)
        ]
        return jnp.concatenate(parts)


class SmoothTubes:
    """A body at such samples, in JAX.

    Attributes
    ----------
    samples : LimitFunctions
    partners : Partners
    tubes : list of (3, rows, columns) arrays
        Positions on the tube of each surface.
    """

    def __init__(self, samples: LimitFunctions, points: ArrayLike, partners: Partners) -> None:
        self.samples, self.partners = samples, partners
        pairs = list(zip(samples.nets(points), samples.grids, strict=True))
        self.tubes = [grid.positions(net) for net, grid in pairs]
        self._measures = [measures(net, grid, samples.spec.stretch.form) for net, grid in pairs]
        self._positions = samples.positions(self.tubes)

    def measured(self, name: str) -> Array:
        """One of `Measures` at all samples, (n,)."""
        return self.joined([getattr(each, name).ravel() for each in self._measures])

    @property
    def spec(self) -> Limits:
        return self.samples.spec

    @property
    def between(self) -> Region:
        return self.samples.between

    def positions(self) -> list[tuple[bool, Array]]:
        return [(grid.cavity, x.reshape(3, -1).T) for x, grid in zip(self.tubes, self.samples.grids, strict=True)]

    def walls(self, bound: float) -> Array:
        return self._apart(self.samples.wall_source, self.partners.wall, bound)

    def folds(self, bound: float) -> Array:
        return self._apart(self.samples.fold_source, self.partners.fold, bound)

    def _apart(self, source: NDArray[np.int32], closest: ClosestPoints, bound: float) -> Array:
        return jnp.where(closest.active, 1.0 - distances(self._positions, source, closest) / bound, -1.0)

    def joined(self, parts: list[Array]) -> Array:
        """Concatenate arrays (n,), of which there may be none."""
        return jnp.concatenate([jnp.zeros(0), *parts])
