"""Displacements fitted to deformation gradients.

A predicted state, or one interpolated from another mesh, is right in the large and rough in detail: in thin and small
elements the strain of its displacements may be anything, while the deformation gradients that it was made from are
smooth. The displacements nearest to these make a much better start.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import LinearOperator, cg

from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.assembly.tangent import Configuration
from pneumorph.mechanics.elements.element import TET_DN, TET_WEIGHT
from pneumorph.mechanics.elements.kinematics import State, deformation_gradients

ACCURACY, MOST_STEPS = 1e-3, 100
"""Relative residual, and most steps of conjugate gradients: what they leave is smooth."""


def fitted(at: Configuration, state: State, F: np.ndarray) -> State:
    """The state near a given one whose deformation gradients are nearest to F (3, 3, 4, E), in the mean of squares.

    The plate moves too; what is supported or blocked does not, nor do π and obstacles.
    """
    model = at.model
    tets = model.tets.nodes[: model.elements]
    slopes, measure = _slopes(at.X[tets])
    laplacian = _laplacian(tets, slopes, measure, model.nodes)
    nodes = Displacement(model.tip, at.X, state)
    missing = F - deformation_gradients(tets, at.X, nodes.u)
    pull = np.einsum("qm,mqaj,ijqm->mai", measure, slopes, missing, optimize=True)
    by_node = np.stack([np.bincount(tets.ravel(), each.ravel(), model.nodes) for each in np.moveaxis(pull, -1, 0)], -1)

    def on_unknowns(forces: np.ndarray) -> np.ndarray:
        return np.where(still, 0.0, model.vector(nodes.pulled(forces)))

    def product(change: np.ndarray) -> np.ndarray:
        return on_unknowns(laplacian @ nodes.along(model.state(change))) + np.where(still, change, 0.0)

    still = at.constrained.copy()
    still[model.hydrostatic_unknowns] = still[model.object_unknowns] = True
    diagonal = np.ones(model.size)
    diagonal[: 3 * len(model.independent)] = np.repeat(laplacian.diagonal()[model.independent], 3)
    for unknown in np.flatnonzero(~still[-6:]) + model.size - 6:
        unit = np.zeros(model.size)
        unit[unknown] = 1.0
        diagonal[unknown] = product(unit)[unknown]
    operator = LinearOperator((model.size, model.size), product)  # pyright: ignore[reportCallIssue]
    jacobi = sparse.diags_array(1.0 / np.where(still, 1.0, diagonal))
    change, _ = cg(operator, on_unknowns(by_node), rtol=ACCURACY, maxiter=MOST_STEPS, M=jacobi)
    return model.state(model.vector(state) + change)


def _slopes(x: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """∂N/∂X (M, 4, 10, 3) and the volumes (4, M) of the quadrature points of tetrahedra at x (M, 10, 3)."""
    jacobian = np.einsum("mai,qak->mqik", x, TET_DN, optimize=True)
    return TET_DN @ np.linalg.inv(jacobian), TET_WEIGHT * np.linalg.det(jacobian).T


def _laplacian(tets: np.ndarray, slopes: np.ndarray, measure: np.ndarray, nodes: int) -> sparse.csr_array:
    """∫ ∇N·∇N (nodes, nodes)."""
    weighted = (slopes * measure.T[:, :, None, None]).transpose(0, 2, 1, 3).reshape(len(tets), 10, 12)
    blocks = weighted @ slopes.transpose(0, 1, 3, 2).reshape(len(tets), 12, 10)
    rows, columns = np.repeat(tets, 10, axis=1).ravel(), np.tile(tets, 10).ravel()
    return sparse.coo_array((blocks.ravel(), (rows, columns)), shape=(nodes, nodes)).tocsr()
