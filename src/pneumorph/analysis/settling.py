"""How a block of rubber with holes settles under its weight."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from pneumorph.doing import doing
from pneumorph.errors import ComputationError
from pneumorph.mechanics import NoEquilibrium, Rubber, Tangent, build_loads, build_model, configure, solve
from pneumorph.mechanics.setup import asks_for_mixed
from pneumorph.mesh import TetMesh
from pneumorph.mesh.block import block
from pneumorph.units import STANDARD_GRAVITY

_TOLERANCE = 1e-5
"""Relative residual: far below what casting is accurate to."""


@doing("finding how the silicone sags")
def settle(
    rubber: Rubber,
    low: Sequence[float] | np.ndarray,
    high: Sequence[float] | np.ndarray,
    filled: NDArray[np.bool_],
    fixed: Callable[[np.ndarray], NDArray[np.bool_]],
) -> tuple[np.ndarray, np.ndarray]:
    """Displacements under gravity along −z.

    Parameters
    ----------
    low, high : (3,) arrays
        Corners of a block, mm.
    filled : (n, m, k) bool array
        Which of its cells are rubber.
    fixed : callable
        Which displacement components (N, 3) are zero at nodes (N, 3).

    Returns
    -------
    (N, 3) array, (N, 3) array
        Nodes of the rubber and their displacements, mm.

    Raises
    ------
    ComputationError
        If no equilibrium is found.
    """
    low, high = np.asarray(low, dtype=float), np.asarray(high, dtype=float)
    whole = block(filled.shape, lambda x: low + x * (high - low), {})
    # `block` repeats its cells for each of their six tetrahedra.
    tets = whole.tets[np.tile(filled.ravel(), 6)]
    used, renumbered = np.unique(tets, return_inverse=True)
    mesh = TetMesh(whole.points[used], renumbered.reshape(tets.shape), {})
    model = build_model(mesh, rubber, plate=False, supports=fixed(mesh.points), mixed=asks_for_mixed(rubber))
    at = configure(model, mesh.points, build_loads(model, {}, acceleration=np.array([0.0, 0.0, -STANDARD_GRAVITY])))
    equilibrium = solve(at, Tangent(model), tolerance=_TOLERANCE)
    if isinstance(equilibrium, NoEquilibrium):
        raise ComputationError(f"the sag of the silicone is not known: {equilibrium.reason}")
    return mesh.points, equilibrium.u
