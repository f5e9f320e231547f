"""End discs that do not contain their centre, or hardly: sound triangles that follow the control points."""

from dataclasses import replace

import numpy as np
import pytest

from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import enclosed_volume
from pneumorph.mesh import scaled_jacobian
from pneumorph.mesh.plane import quality_of
from pneumorph.mesh.tets import TRIANGLE_EDGES, area_and_volume
from pneumorph.mesh.tube import mesh_body
from pneumorph.mesh.tube.surface import surface_mesh
from pneumorph.symmetry.part import Part, onwards, sector

PARTS = {"whole": (), "half": ("xz",)}


def bent(body: Body) -> Body:
    """The body with its round chamber of radius 4 mm flattened and bent about a line beside it: a crescent."""
    chamber = body.chambers[0]
    x, y, z = np.moveaxis(chamber.net, -1, 0)
    radius, turn = 4.0 + 0.3 * x, 0.45 * y
    crescent = np.stack([radius * np.cos(turn) - 1.0, radius * np.sin(turn), z], axis=-1)
    return replace(body, chambers=(replace(chamber, net=crescent),))


@pytest.fixture(scope="module", params=PARTS.values(), ids=list(PARTS))
def case(tube: Body, request: pytest.FixtureRequest) -> tuple[Body, Part]:
    return bent(tube), request.param


def discs(body: Body, part: Part, size: float) -> list[np.ndarray]:
    """The triangles of the chamber's discs, (nt, 6, 2) each, counter-clockwise."""
    mesh = surface_mesh(body, size, part=part)
    nodes, height = mesh.B @ body.control_points(), body.chambers[0].end_centres[:, 2]
    triangles = nodes[mesh.faces["chamber A"]]
    ends = [triangles[np.abs(triangles[..., 2] - z).max(axis=1) < 1e-9, :, :2] for z in height]
    return [ends[0], ends[1][..., ::-1]] if quality_of(ends[0]).max() > 0 else [ends[0][..., ::-1], ends[1]]


def test_triangles_are_sound(case: tuple[Body, Part]) -> None:
    body, part = case
    for size in (1.0, 2.0):
        for triangles in discs(body, part, size):
            assert quality_of(triangles).min() > 0.3
    morph = mesh_body(body, 2.0, part)
    assert scaled_jacobian(morph.mesh.points, morph.mesh.tets).min() > 0.1


def test_the_surface_is_closed_and_encloses_the_chamber(case: tuple[Body, Part]) -> None:
    body, part = case
    mesh = surface_mesh(body, 2.0, part=part)
    nodes = mesh.B @ body.control_points()
    net, volume = area_and_volume(nodes, mesh.faces["chamber A"])
    np.testing.assert_allclose(net[[0, 2]], 0, atol=1e-10)
    np.testing.assert_allclose(-volume, enclosed_volume(body.chambers[0]) / (1 + len(part)), rtol=1e-2)
    used = np.unique(mesh.triangles)
    np.testing.assert_array_equal(used, np.arange(len(nodes)))
    edges = np.sort(mesh.triangles[:, TRIANGLE_EDGES].reshape(-1, 2), axis=1)
    edges, times = np.unique(edges, axis=0, return_counts=True)
    assert (times <= 2).all()
    open_ends = nodes[edges[times == 1]]
    assert len(open_ends) > 0 if part else len(open_ends) == 0
    np.testing.assert_allclose(open_ends[..., 1], 0, atol=1e-9)


def test_nodes_follow_the_control_points(case: tuple[Body, Part]) -> None:
    body, part = case
    mesh = surface_mesh(body, 2.0, part=part)
    P, linear = body.control_points(), np.array([[1.1, 0.0, 0.0], [0.0, 0.9, 0.0], [0.0, 0.0, 1.2]])
    np.testing.assert_allclose(mesh.B @ (P @ linear), (mesh.B @ P) @ linear, atol=1e-9)
    np.testing.assert_allclose(mesh.B.sum(axis=1), 1.0, atol=1e-9)


@pytest.mark.parametrize(("turns", "around"), [(2, 18), (3, 15)])
def test_a_sector_keeps_its_seam(tube: Body, turns: int, around: int) -> None:
    """The cuts of a half are in one line across the disc, as a mirror plane's, yet their nodes have images."""
    chamber = tube.chambers[0]
    angle, z = np.meshgrid(-2.0 * np.pi * np.arange(around) / around, chamber.net[:, 0, 2])
    radius = 4.0 * (0.7 + 0.4 * np.cos(turns * angle))
    swirled = angle + 0.3 * radius
    lobes = np.stack([radius * np.cos(swirled), radius * np.sin(swirled), z], axis=-1)
    body = replace(tube, chambers=(replace(chamber, net=lobes),))
    mesh = surface_mesh(body, 2.0, part=(sector(turns),))
    nodes = mesh.B @ body.control_points()
    np.testing.assert_allclose(nodes[mesh.seam[:, 0]] @ onwards(turns).T, nodes[mesh.seam[:, 1]], atol=1e-4)
    assert mesh_body(body, 2.0, (sector(turns),)).size == 2.0
