"""Where the error of the mesh comes from: what each element contributes to that of a function of the state.

Weighted residuals (Becker and Rannacher 2001, Acta Numerica 10, 1–102): on a refined mesh the residual R and the
adjoint z of a function give its change −zᵀR. The state is in balance with the coarser fields, so that only what z has
beyond these counts, s and q at new nodes (`refined.py`). It follows from the coarser adjoint z₀ by the blocks of the
new nodes, from the forces that K z₀ leaves there. Contributions are taken without signs, and shared out among the
elements around each node.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.products import tangent_map
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.solve.refined import on_refined
from pneumorph.mechanics.solve.split import Split, surplus_of
from pneumorph.mesh.refine import Refined

PARTS = 8
"""Elements of the refined mesh in each of the coarser one, one after another."""


def contributions(
    fine: Refined, at: Configuration, tangent: Tangent, state: State, there: Configuration, seeds: Sequence[State]
) -> np.ndarray | None:
    """What each element of a mesh contributes to the errors of some functions by it, (k, M), without signs.

    None where small parts of the body are unstable, or the tangent has no inverse.

    Parameters
    ----------
    fine, at, tangent, state, there : see `near_refined`; the refinement is uniform.
    seeds : of k functions
        Their derivatives by the state, on the refined mesh at `on_refined`.
    """
    start = on_refined(fine, at, state)
    split = Split(fine, at, state, there)
    surplus = surplus_of(split, there, start)
    if surplus is None:
        return None
    _, residual = kernels.value_and_residual(there.model.potential, there.X, start, there.loads)
    forces = split.forces(residual)[split.coarse :]
    product = tangent_map(there.model.potential, there.X, start, there.loads)
    nodes = np.zeros((len(seeds), there.model.nodes))
    end = 3 * len(split.new)
    for row, seed in zip(nodes, seeds, strict=True):
        pulled = split.forces(seed)
        try:
            adjoint = tangent.solve_at(at, state, pulled[: split.coarse])
        except SingularMatrix:
            return None
        left = pulled - split.forces(product(split.direction(split.of_coarse(adjoint))))
        shares = surplus.solved(left[split.coarse :]) * forces
        row[split.new] += np.abs(shares[:end].reshape(-1, 3).sum(axis=1))
        np.add.at(row, split.inside % there.model.nodes, np.abs(shares[end:]))
    owners = np.repeat(np.arange(len(fine.mesh.tets) // PARTS), PARTS * fine.mesh.tets.shape[1])
    around = np.unique(np.column_stack([owners, fine.mesh.tets.ravel()]), axis=0)
    owner, node = around.T
    shared = nodes / np.maximum(np.bincount(node, minlength=nodes.shape[1]), 1)
    return np.array([np.bincount(owner, row[node], owners[-1] + 1) for row in shared])
