"""The state of a body whose displacements are known: where a search starts from what was stored."""

from __future__ import annotations

import numpy as np
from scipy.sparse import coo_matrix, diags
from scipy.sparse.linalg import cg

from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.elements.element import TET_CORNER_N, TET_DN, TET_WEIGHT
from pneumorph.mechanics.elements.kinematics import State, deformation_gradients, volume_ratio

ACCURACY = 1e-10
"""Relative residual of the equations for π."""


def restored(model: Model, X: np.ndarray, u: np.ndarray, plate: np.ndarray, objects: np.ndarray) -> State:
    """The state with displacements u (N, 3) and a plate at [c, θ] (6,); π is that at which Π is stationary in it.

    `objects` (J, 6) are the unknowns of free obstacles. So of an equilibrium it is the state itself: Π is quadratic in
    π, and ∫ N (J − 1 − π/κ) = 0.

    Parameters
    ----------
    model : Model
    X, u : (N, 3) array
        Nodes and their displacements, mm.
    plate : (6,) array
        mm and rad.
    objects : (J, 6) array
        Unknowns of free obstacles, mm and rad.
    """
    if not model.mixed:
        return State(u, plate, objects=objects)
    tets = model.tets.nodes[: model.elements]
    unknowns, slack = model.source[tets[:, :4]], np.zeros(len(tets))
    # Where two rubbers meet, π jumps: every region has an entry for each node.
    for number, (region, rubber) in enumerate(model.rubbers.items()):
        unknowns[model.regions[region]] += number * model.nodes
        slack[model.regions[region]] = 1.0 / rubber.bulk_modulus
    jacobian = np.einsum("mai,qak->qmik", X[tets], TET_DN)
    measure = TET_WEIGHT * np.linalg.det(jacobian)
    growth = volume_ratio(deformation_gradients(tets, X, u)) - 1.0
    count = len(model.sparsity.rank)
    right = np.bincount(unknowns.ravel(), ((measure * growth).T @ TET_CORNER_N).ravel(), minlength=count)
    mass = np.einsum("qc,qd,qm->mcd", TET_CORNER_N, TET_CORNER_N, measure * slack)
    rows, columns = np.repeat(unknowns, 4, axis=1).ravel(), np.tile(unknowns, 4).ravel()
    used = model.sparsity.corners
    matrix = coo_matrix((mass.ravel(), (rows, columns)), shape=(count, count)).tocsr()[used][:, used]
    hydrostatic = np.zeros(count)
    hydrostatic[used] = cg(matrix, right[used], rtol=ACCURACY, M=diags(1.0 / matrix.diagonal()))[0]
    return State(u, plate, hydrostatic.reshape(-1, model.nodes)[:, model.source].ravel(), objects)
