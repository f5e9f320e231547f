"""The scaled Jacobian of quadratic tetrahedra."""

import numpy as np

from pneumorph.mesh import scaled_jacobian
from pneumorph.mesh.tets import TET_EDGES

REGULAR = np.array([[1.0, 1, 1], [-1, 1, -1], [1, -1, -1], [-1, -1, 1]])
TET = np.arange(10)[None]


def nodes(corners: np.ndarray) -> np.ndarray:
    return np.concatenate([corners, corners[TET_EDGES].mean(axis=1)])


def test_regular_is_one_at_any_size() -> None:
    for scale in (1e-3, 1.0, 1e3):
        np.testing.assert_allclose(scaled_jacobian(scale * nodes(REGULAR), TET), 1.0)


def test_mirrored_is_minus_one() -> None:
    np.testing.assert_allclose(scaled_jacobian(nodes(REGULAR) * [1, 1, -1], TET), -1.0)


def test_bent_edge_lowers_it_and_inverts_it() -> None:
    bent = nodes(REGULAR)
    towards = REGULAR.mean(axis=0) - bent[4]
    bent[4] += 0.3 * towards
    fair = scaled_jacobian(bent, TET)[0]
    assert 0 < fair < 1
    bent[4] += 1.2 * towards
    assert scaled_jacobian(bent, TET)[0] < 0
