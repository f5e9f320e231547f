"""All limits of a problem as normalised, differentiable constraint values c ≤ 0 in arrays of fixed shapes.

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

from pneumorph.geometry import Body
from pneumorph.limits.measures.distances import (
    ClosestPoints,
    distances,
    fold_closest,
    joined,
    sampled_surface,
    wall_closest,
)
from pneumorph.limits.measures.formulas import MIN_AREA, Form, measures
from pneumorph.limits.measures.grid import Grid, SampledFields, closed_positions, every_second, grid, heights, rim_share
from pneumorph.limits.table import OF_SHAPE

if TYPE_CHECKING:
    from pneumorph.problem import Limits


class Partners(NamedTuple):
    """Closest points of all samples at the control points `found_at` (n_points, 3), in arrays of fixed shapes."""

    wall: ClosestPoints
    fold: ClosestPoints
    found_at: NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class LimitFunctions:
    """The limits of a problem on fixed samples of a body's surfaces; built by `build_limit_functions`.

    Attributes
    ----------
    grids : tuple of Grid
        Samples of each surface, the exterior first.
    slices : tuple of slice
        Control points of each surface.
    length : float
        The body's length in mm: its end discs lie at z = 0 and z = length.
    wall, fold, neighbourhood, curvature, skew, stretch : float
        Bounds in mm, mm, mm, 1/mm², 1 and 1/mm².
    form : "per_mm" or "printed"
        Of the stretch, see `measures`.
    envelope : float or None
        Largest distance from the z axis in mm.
    reach : float
        Partners are found up to this distance beyond the limit, mm.
    """

    grids: tuple[Grid, ...]
    slices: tuple[slice, ...]
    length: float
    wall: float
    fold: float
    neighbourhood: float
    curvature: float
    skew: float
    stretch: float
    form: Form
    envelope: float | None
    reach: float

    def values(self, points: ArrayLike, partners: Partners) -> dict[str, Array]:
        """Constraint values c ≤ 0 at control points (n_points, 3) or flat, for jax.jit and jax.grad too.

        Returns
        -------
        dict of 1-d arrays of fixed lengths, where d is a distance and t its limit
            wall : 1 - d/t between surfaces; -1 if nothing is within reach
            ends : 1 - d/t between samples of chambers and the planes of the body's ends; and the distance of samples
                of the exterior beyond these planes, divided by t
            fold : 1 - d/t within a surface; -1 if nothing is within reach
            rim : 1 - d/t between tubes with flat ends and the planes of these ends, with t reduced near the rim
            curvature, skew, stretch : h/h_max - 1
            area : 1 - sqrt(EG - F²)/(0.1·starting value), which prevents folded nets
            envelope : distance of samples of the exterior beyond the envelope, divided by t; absent without envelope
        """
        nets = self._nets(points)
        shapes = [measures(net, grid, self.form) for net, grid in zip(nets, self.grids, strict=True)]
        tubes = [grid.positions(net) for net, grid in zip(nets, self.grids, strict=True)]
        X = self.positions(tubes)
        wall = distances(X, self._wall_source, partners.wall)
        fold = distances(X, self._fold_source, partners.fold)
        clear = [jnp.minimum(x[2], self.length - x[2]).ravel() for x in tubes]

        def over(name: str) -> Array:
            return jnp.concatenate([getattr(shape, name).ravel() for shape in shapes])

        result = {
            "wall": jnp.where(partners.wall.active, 1.0 - wall / self.wall, -1.0),
            "ends": jnp.concatenate([-clear[0] / self.wall, *(1.0 - height / self.wall for height in clear[1:])]),
            "fold": jnp.where(partners.fold.active, 1.0 - fold / self.fold, -1.0),
            "rim": jnp.concatenate([self._rim(x, grid) for x, grid in zip(tubes, self.grids, strict=True)]),
            "curvature": over("curvature") / self.curvature - 1.0,
            "skew": over("skew") / self.skew - 1.0,
            "stretch": over("stretch") / self.stretch - 1.0,
            "area": 1.0 - over("area") / MIN_AREA,
        }
        if self.envelope is not None:
            x, y, _ = tubes[0]
            result["envelope"] = (jnp.sqrt(x**2 + y**2 + 1e-12).ravel() - self.envelope) / self.wall
        return result

    def paper_arguments(self, values: dict[str, Array], tolerance: float = 0.05) -> dict[str, Array]:
        """Arguments of the barrier f of (32) in (33), from `values`: g/ε_t for distances g in mm, otherwise h/h_max.

        The barrier of a quantity h is zero at h = 0 and one at its limit, that of a distance is zero up to its limit.
        """
        scale = {limit.name: getattr(self, limit.per) for limit in OF_SHAPE if limit.per}
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
                    wall_closest(closed[a].x, closed[b], self.wall + self.reach, self._first[b])
                    for a, b in self._neighbours
                ]
            ),
            fold=joined(
                [
                    fold_closest(
                        sampled_surface(field, grid, discs=False),
                        self.neighbourhood,
                        self.fold + self.reach,
                        tube.start,
                    )
                    for field, grid, tube in zip(fields, self.grids, self._tubes, strict=True)
                ]
            ),
            found_at=points,
        )

    def moved(self, points: ArrayLike, partners: Partners) -> bool:
        """Whether control points have moved so far since the partners were found that they must be found again."""
        step = np.asarray(points, dtype=float).reshape(-1, 3) - partners.found_at
        return bool(np.sqrt((step**2).sum(axis=1).max()) > self.reach / 4.0)

    # Each pair of surfaces is compared once. The exterior has the denser samples, so its samples get partners on the
    # chambers and not vice versa. Its own discs need no samples, because "ends" covers the planes of the body's ends.

    @cached_property
    def _neighbours(self) -> list[tuple[int, int]]:
        return [(a, b) for a in range(len(self.grids)) for b in range(a + 1, len(self.grids))]

    @cached_property
    def _first(self) -> list[int]:
        """Index of each surface's first sample among all positions."""
        counts = [len(grid.q) * (len(grid.r) + (2 * len(grid.rings) if grid.cavity else 0)) for grid in self.grids]
        return [0, *np.cumsum(counts).tolist()]

    @cached_property
    def _wall_source(self) -> NDArray[np.int32]:
        blocks = [np.arange(self._first[a], self._first[a + 1]) for a, _ in self._neighbours]
        return np.concatenate(blocks).astype(np.int32)

    @cached_property
    def _tubes(self) -> list[slice]:
        """Positions that are the samples of each tube."""
        starts = [
            first + (len(grid.rings) * len(grid.q) if grid.cavity else 0)
            for grid, first in zip(self.grids, self._first, strict=False)
        ]
        return [slice(start, start + len(grid.q) * len(grid.r)) for start, grid in zip(starts, self.grids, strict=True)]

    @cached_property
    def _fold_source(self) -> NDArray[np.int32]:
        blocks = [tube.start + every_second(grid) for grid, tube in zip(self.grids, self._tubes, strict=True)]
        return np.concatenate(blocks).astype(np.int32)

    def _nets(self, points: ArrayLike) -> list[Array]:
        points = jnp.asarray(points).reshape(-1, 3)
        return [points[where].reshape(*grid.net_shape, 3) for grid, where in zip(self.grids, self.slices, strict=True)]

    def _rim(self, x: Array, grid: Grid) -> Array:
        """Constraint values of a tube x (3, rows, columns) over the planes of its own ends; empty with poles."""
        if not len(grid.rings):
            return jnp.zeros(0)
        base, tip = (
            height[1:-1] / (self.fold * share[1:-1])
            for share, height in zip(rim_share(grid, self.neighbourhood), heights(x, grid), strict=True)
        )
        # On the rim itself the value is that of the wall's slope, found by extrapolation.
        rims = [2.0 * base[0] - base[1], 2.0 * tip[-1] - tip[-2]]
        return 1.0 - jnp.concatenate([jnp.minimum(base, tip).ravel(), *rims])

    @cached_property
    def fields(self) -> Callable[[ArrayLike], list[SampledFields]]:
        """Function from control points to the fields of every surface's samples."""

        @jax.jit
        def fields(points: ArrayLike) -> list[SampledFields]:
            return [grid.fields(net) for net, grid in zip(self._nets(points), self.grids, strict=True)]

        return fields

    def positions(self, tubes: list[Array]) -> Array:
        """Positions (n, 3) of all samples used for distances: the tube of the exterior, then the closed chambers."""
        parts = [
            (closed_positions(x, grid) if grid.cavity else x).reshape(3, -1).T
            for x, grid in zip(tubes, self.grids, strict=True)
        ]
        return jnp.concatenate(parts)


def build_limit_functions(
    body: Body, spec: Limits, per_span: tuple[int, int] = (4, 8), reach: float = 0.5
) -> LimitFunctions:
    """Build the limits of a problem on samples of a body.

    Parameters
    ----------
    body : Body
        Any body of the run: only properties that never change (net shapes, starting sizes, kinds of ends, length) are
        used.
    spec : problem.Limits
    per_span : (int, int)
        Samples per knot span in q and in r. Curvature has its peaks on knots, stretch has them anywhere: in a fold of a
        bellows, one span of r turns by more than a right angle, and four samples would miss a quarter of h₃.
    reach : float
        See `LimitFunctions`.
    """
    return LimitFunctions(
        grids=tuple(grid(surface, per_span) for surface in body.surfaces),
        slices=body.slices,
        length=float(body.exterior.net[-1, 0, 2]),
        wall=spec.wall,
        fold=spec.fold.distance,
        neighbourhood=spec.fold.neighbourhood,
        curvature=spec.curvature,
        skew=spec.skew,
        stretch=spec.stretch.limit,
        form=spec.stretch.form,
        envelope=spec.envelope.radius if spec.envelope else None,
        reach=reach,
    )
