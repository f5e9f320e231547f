"""The effect of ports, against a mesh whose port is exactly the round bar that it is."""

import numpy as np
import pytest
from netgen.occ import Cylinder, Glue, OCCGeometry, X, Z

from pneumorph.analysis.ports import Port, compared, with_and_without, with_tubes
from pneumorph.errors import ComputationError
from pneumorph.geometry.tube.start import starting_body
from pneumorph.mesh import TetMesh, scaled_jacobian, unfold
from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import load

RADIUS, HEIGHT = 2.0, 10.0
SIDE = Port(np.array([3.4, 0.0, HEIGHT]), np.array([1.0, 0.0, 0.0]), RADIUS)
PRESSURES = {"extend": {"A": 0.03}}


@pytest.fixture(scope="module")
def problem():
    # A round tube without the coarse control net's departure from it.
    return load("examples/small.toml").with_changes({"mesh.size": "2.5 mm", "body.control_density": "0.6 /mm"})


def exact_mesh(size):
    """The body of `problem` with a bar through its side as a region of its own."""
    outside, inside = Cylinder((0, 0, 0), Z, 8, 24), Cylinder((0, 0, 3), Z, 4, 18)
    bar = Cylinder((0, 0, HEIGHT), X, RADIUS, 20)
    wall = outside - inside
    rubber, plug = wall - bar, wall * bar
    rubber.solids.name, plug.solids.name = "rubber", "tubes"
    mesh = OCCGeometry(Glue([rubber, plug])).GenerateMesh(maxh=size)
    points = np.array([tuple(point.p) for point in mesh.Points()])
    tets = mesh.Elements3D().NumPy()
    corners = tets["nodes"][:, [0, 2, 1, 3]].astype(np.int64) - 1
    tubes = np.array([mesh.GetMaterial(int(index)) for index in range(1, 3)])[tets["index"] - 1] == "tubes"
    every = np.concatenate([np.sort(corners[:, pair], axis=1) for pair in TET_EDGES])
    edges, number = np.unique(every, axis=0, return_inverse=True)
    quadratic = np.hstack([corners, len(points) + number.reshape(6, -1).T])
    # The faces of single elements, outward.
    sides = np.concatenate([corners[:, side] for side in ([0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2])])
    _, first, count = np.unique(np.sort(sides, axis=1), axis=0, return_index=True, return_counts=True)
    outer = sides[first[count == 1]]
    keys = {tuple(pair): len(points) + k for k, pair in enumerate(edges.tolist())}
    mids = [[keys[tuple(sorted(face[pair].tolist()))] for pair in TRIANGLE_EDGES] for face in outer]
    faces = np.hstack([outer, mids])
    centre = points[outer].mean(axis=1)
    radius, z = np.hypot(*centre[:, :2].T), centre[:, 2]
    base, tip = z < 1e-6, z > 24 - 1e-6
    chamber = ~base & ~tip & (radius < 5.0)
    named = {"base": base, "tip": tip, "chamber A": chamber, "exterior": ~base & ~tip & ~chamber}
    return TetMesh(
        np.concatenate([points, points[edges].mean(axis=1)]),
        quadratic,
        {name: faces[chosen] for name, chosen in named.items()},
        {"rubber": np.flatnonzero(~tubes), "tubes": np.flatnonzero(tubes)},
    )


def shift(motions):
    without, tubes = motions["extend"]
    return np.concatenate([tubes.translation - without.translation, 24.0 * (tubes.rotation - without.rotation)])


@pytest.fixture(scope="module")
def told(problem):
    """What a port in the side does."""
    return shift(with_and_without(problem, starting_body(problem.tubes), PRESSURES, [SIDE]))


def test_the_effect_is_that_of_the_exact_port(problem, told):
    exact = exact_mesh(1.5)
    assert exact.volume() == pytest.approx(np.pi * (64 * 24 - 16 * 18), rel=0.03)
    real = shift(compared(problem, exact, PRESSURES))
    assert np.linalg.norm(told) == pytest.approx(np.linalg.norm(real), rel=0.25)
    assert real @ told > 0.98 * np.linalg.norm(real) * np.linalg.norm(told)


@pytest.mark.parametrize("mirrors", [("xz",), ("xz", "yz")])
def test_ports_beyond_a_mirror_plane_are_left_to_the_images(problem, mirrors):
    """Ports on both sides of a plane: the part has one of them, and unfolded it has both."""
    ports = [Port(np.array([0.0, side * 3.4, HEIGHT]), np.array([0.0, side, 0.0]), RADIUS) for side in (1.0, -1.0)]
    mesh = unfold(with_tubes(mesh_body(starting_body(problem.tubes), 2.5, mirrors).mesh, ports)).mesh
    tubes = mesh.points[mesh.tets[mesh.regions["tubes"], :4]]
    volumes = np.abs(np.linalg.det(tubes[:, 1:] - tubes[:, :1])) / 6
    assert volumes.sum() == pytest.approx(2 * np.pi * RADIUS**2 * 4.0, rel=0.3)
    above = tubes.mean(axis=1)[:, 1] > 0
    assert volumes[above].sum() == pytest.approx(volumes[~above].sum(), rel=1e-12)


def test_a_port_beside_the_mirror_plane_needs_the_whole_body(problem, told):
    """The same port a quarter turn farther does the same; half the body would have it twice."""
    aside = Port(np.array([0.0, 3.4, HEIGHT]), np.array([0.0, 1.0, 0.0]), RADIUS)
    other = shift(with_and_without(problem, starting_body(problem.tubes), PRESSURES, [aside]))
    assert abs(other[0]) < 0.1 * abs(other[1])
    assert np.linalg.norm(other) == pytest.approx(np.linalg.norm(told), rel=0.3)


def test_a_task_without_equilibrium_is_named(problem):
    with pytest.raises(ComputationError, match="effect of the ports on task extend is not known"):
        coarse = problem.with_changes({"mesh.size": "6 mm"})
        with_and_without(coarse, starting_body(coarse.tubes), {"extend": {"A": 1.0}}, [SIDE])


def test_elements_of_a_port_fill_it_and_stay_well_shaped(problem):
    for size in (2.5, 1.5):
        mesh = mesh_body(starting_body(problem.tubes), size).mesh
        found = with_tubes(mesh, [SIDE])
        corners = found.points[found.tets[found.regions["tubes"], :4]]
        volume = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6.0
        assert volume == pytest.approx(np.pi * RADIUS**2 * 4.0, rel=0.2)
        assert len(found.regions["tubes"]) + len(found.regions["rubber"]) == len(mesh.tets)
        assert scaled_jacobian(found.points, found.tets).min() >= 0.1
        assert found.volume() == pytest.approx(mesh.volume(), rel=0.01)
