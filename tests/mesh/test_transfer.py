"""Fields carried between meshes of one body."""

import numpy as np

from pneumorph.geometry import Body
from pneumorph.mesh import Morph, transfer
from pneumorph.mesh.transfer import locate
from pneumorph.mesh.tube import mesh_body


def wavy(points: np.ndarray) -> np.ndarray:
    x, y, z = points.T
    return np.stack([np.sin(x / 5) * z / 20, np.cos(z / 8), np.exp(x / 9) * np.sin(y / 7)], axis=1)


def test_quadratic_field_is_exact_on_straight_elements(tube_morph: Morph) -> None:
    straight = tube_morph.mesh.at(tube_morph.reference)
    centres = straight.points[straight.tets[:, :4]].mean(axis=1)
    x, y, z = straight.points.T
    field = np.stack([x * y - z**2, x + 2 * y * z, np.ones_like(x)], axis=1)
    x, y, z = centres.T
    exact = np.stack([x * y - z**2, x + 2 * y * z, np.ones_like(x)], axis=1)
    np.testing.assert_allclose(transfer(straight, field, centres), exact, atol=1e-9)


def test_nodes_find_themselves(tube_morph: Morph) -> None:
    mesh = tube_morph.mesh
    np.testing.assert_allclose(transfer(mesh, wavy(mesh.points), mesh.points), wavy(mesh.points), atol=1e-6)


def test_smooth_field_is_carried_to_third_order(tube: Body, tube_morph: Morph) -> None:
    target = mesh_body(tube, 3.5).mesh.points
    errors = []
    for morph in (tube_morph, mesh_body(tube, 1.5)):
        carried = transfer(morph.mesh, wavy(morph.mesh.points), target)
        errors.append(np.sqrt(np.mean((carried - wavy(target)) ** 2)))
    assert errors[0] < 3e-3
    assert errors[1] < errors[0] / 4


def test_points_outside_stay_near_an_element(tube_morph: Morph) -> None:
    element, xi = locate(tube_morph.mesh, np.array([[0.0, 0.0, -50.0], [30.0, 0.0, 20.0]]))
    assert (element >= 0).all()
    assert (np.minimum(xi.min(axis=1), 1 - xi.sum(axis=1)) >= -0.15 - 1e-12).all()
