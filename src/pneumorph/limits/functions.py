"""All limits of a problem as normalised, differentiable constraint values c ≤ 0 in arrays of fixed shapes.

An optimiser can use them in different ways: in the paper's penalties (32) through `paper_arguments`, or in an augmented
Lagrangian with a multiplier for each entry.
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import jax.numpy as jnp
from jax import Array
from numpy.typing import ArrayLike

from pneumorph.geometry import Body
from pneumorph.limits.table import KINDS, OF_SHAPE
from pneumorph.limits.tube.measures.grid import grid
from pneumorph.limits.tube.rows.smooth import Partners, SmoothBody, SmoothSamples

if TYPE_CHECKING:
    from pneumorph.problem import Limits


@dataclass(frozen=True, eq=False)
class LimitFunctions(SmoothSamples):
    """The limits of a problem as functions of the control points; built by `build_limit_functions`."""

    def values(self, points: ArrayLike, partners: Partners) -> dict[str, Array]:
        """Constraint values c ≤ 0 at control points (n_points, 3) or flat, for jax.jit and jax.grad too.

        Returns
        -------
        dict of 1-d arrays of fixed lengths
            By the names of limits: distances from the bound relative to `Limit.scale`, as the kinds of limits say.
        """
        at = SmoothBody(self, points, partners)
        return {name: value for kind in KINDS for name, value in kind.smooth(at).items()}

    def paper_arguments(self, values: dict[str, Array], tolerance: float = 0.05) -> dict[str, Array]:
        """Arguments of the barrier f of (32) in (33), from `values`: g/ε_t for distances g in mm, otherwise h/h_max.

        The barrier of a quantity h is zero at h = 0 and one at its limit, that of a distance is zero up to its limit.
        """
        scale = {limit.name: limit.scale(self.spec) for limit in OF_SHAPE if limit.per}
        return {
            name: value * (scale[name] / tolerance) if name in scale else jnp.maximum(value + 1.0, 0.0)
            for name, value in values.items()
        }


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
        spec=spec,
        reach=reach,
    )
