"""Quality of quadratic tetrahedra."""

from __future__ import annotations

import numpy as np

from pneumorph.mesh.tets import TET_EDGES, TET_RULE, tet_gradient

_CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
_POINTS = np.concatenate([TET_RULE, _CORNERS, _CORNERS[TET_EDGES].mean(axis=1)])
# Columns: derivatives with respect to ξ₁ at every point, then ξ₂, then ξ₃.
_GRADIENTS = np.ascontiguousarray(np.moveaxis(tet_gradient(_POINTS), 1, 0).transpose(0, 2, 1).reshape(10, -1))


def scaled_jacobian(points: np.ndarray, tets: np.ndarray) -> np.ndarray:
    """Quality of each element: √2·min det(dX/dξ) / ℓ³ with ℓ the root mean square of the six corner distances.

    The minimum is over quadrature points, corners and mid-side nodes. A regular straight tetrahedron has quality 1, one
    that is inverted at any of these points has a negative quality.

    Parameters
    ----------
    points : (N, 3) float
    tets : (M, 10) int

    Returns
    -------
    (M,) float
    """
    determinant, length = jacobians(points, tets)
    return np.sqrt(2) * determinant.min(axis=1) / length**3


def jacobians(points: np.ndarray, tets: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """det(dX/dξ) at the 14 points above (M, 14), and the root mean square of the corner distances (M,)."""
    x, y, z = ((points[:, k][tets] @ _GRADIENTS).reshape(len(tets), 3, len(_POINTS)) for k in range(3))
    determinant = (
        x[:, 0] * (y[:, 1] * z[:, 2] - y[:, 2] * z[:, 1])
        - x[:, 1] * (y[:, 0] * z[:, 2] - y[:, 2] * z[:, 0])
        + x[:, 2] * (y[:, 0] * z[:, 1] - y[:, 1] * z[:, 0])
    )
    corners = points[tets[:, :4]]
    sides = corners[:, TET_EDGES[:, 1]] - corners[:, TET_EDGES[:, 0]]
    return determinant, np.sqrt((sides**2).sum(axis=(1, 2)) / 6)
