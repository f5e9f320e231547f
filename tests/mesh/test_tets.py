"""Shape functions and integrals over curved triangles."""

import numpy as np

from pneumorph.mesh.tets import (
    TET_EDGES,
    TRIANGLE_EDGES,
    TetMesh,
    area_and_volume,
    tet_gradient,
    tet_shape,
    triangle_gradient,
    triangle_shape,
)

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])


def test_shape_functions_are_one_at_their_own_node() -> None:
    nodes = np.concatenate([CORNERS, CORNERS[TET_EDGES].mean(axis=1)])
    np.testing.assert_allclose(tet_shape(nodes), np.eye(10), atol=1e-15)
    corners = CORNERS[:3, :2]
    nodes = np.concatenate([corners, corners[TRIANGLE_EDGES].mean(axis=1)])
    np.testing.assert_allclose(triangle_shape(nodes), np.eye(6), atol=1e-15)


def test_gradients_are_the_slopes_of_the_shape_functions() -> None:
    for shape, gradient, dim in ((tet_shape, tet_gradient, 3), (triangle_shape, triangle_gradient, 2)):
        xi = np.random.default_rng(0).uniform(0, 0.3, (5, dim))
        step = 1e-6 * np.eye(dim)
        slopes = [(shape(xi + h) - shape(xi - h)) / 2e-6 for h in step]
        np.testing.assert_allclose(gradient(xi), np.stack(slopes, axis=-1), atol=1e-8)


def test_volume_of_one_tetrahedron() -> None:
    corners = 2 * CORNERS
    points = np.concatenate([corners, corners[TET_EDGES].mean(axis=1)])
    # Corners of the faces seen from outside, with their mid-side nodes among 4…9.
    faces = np.array([[0, 2, 1, 6, 5, 4], [0, 1, 3, 4, 8, 7], [1, 2, 3, 5, 9, 8], [0, 3, 2, 7, 9, 6]])
    closed, volume = area_and_volume(points, faces)
    np.testing.assert_allclose(closed, 0, atol=1e-14)
    np.testing.assert_allclose(volume, 8 / 6)
    np.testing.assert_allclose(TetMesh(points, np.arange(10)[None], {"all": faces}).volume(), 8 / 6)
