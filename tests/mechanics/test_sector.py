"""A sector in place of the whole body: the same answers and gradients, where the problem allows it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from parts import RUBBER, around, part_mesh, solved_both, symmetric

from pneumorph.geometry.tube.start import starting_body
from pneumorph.mechanics import (
    NoEquilibrium,
    Skin,
    Tangent,
    Whole,
    build_loads,
    build_model,
    configure,
    contact_forces,
    part_of,
    restored,
    solve,
    whole_of,
)
from pneumorph.mechanics.assembly.products import tangent_product
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.pairs import Pairs
from pneumorph.mechanics.contact.samples import surface_of
from pneumorph.mechanics.solve.balance import residual_at
from pneumorph.mesh import unfold
from pneumorph.mesh.tets import TetMesh
from pneumorph.mesh.tube import mesh_body
from pneumorph.objective import Objective, equidistant
from pneumorph.problem import Problem
from pneumorph.sensitivity import boundary_gradient, gradient
from pneumorph.symmetry.operations import turned
from pneumorph.symmetry.part import sector, turns_of

SAME = 1e-10


def problem(symmetry=3, *placed, motion="twist", **others) -> Problem:
    symmetry = symmetry if isinstance(symmetry, dict) else {"rotation": symmetry}
    return symmetric(symmetry, *placed, motion=motion, body={"control_density": "0.4 /mm"}, **others)


JUDGE = Objective(
    lambda f: (
        0.1 * f.translation[2]
        + f.rotation[2]
        + f.section_position[1, 2]
        + jnp.sum(f.section_rotation[:, 1, 0])
        + 1e-4 * sum(f.volume.values()) / 3
    ),
    equidistant(3, 24.0),
)
CASES = [
    pytest.param((3, ((0, 0),), 4.0, True, True), id="mixed", marks=pytest.mark.slow),
    pytest.param((2, ((0, 0),), 4.0, False, False), id="half, free tip"),
    pytest.param((3, ((0, 0), *around(3, 4.5)), 1.2, True, False), id="one and three chambers"),
    pytest.param((5, ((0, 0),), 4.0, False, True), id="five, free tip, mixed", marks=pytest.mark.slow),
]


@pytest.fixture(scope="module", params=CASES)
def case(request):
    turns, centres, radius, plate, mixed = request.param
    mesh = part_mesh(problem(turns, centres, radius))
    assert mesh.part == (sector(turns),)
    weight, wrench = np.array([0.0, 0.0, -9810.0]), np.array([0.0, 0.0, 0.1, 0.0, 0.0, 30.0])
    return mesh, *solved_both(mesh, plate, mixed, weight, wrench)


def test_states_are_those_of_the_whole(case):
    _, (at, _, part), whole, (there, both) = case
    np.testing.assert_allclose(part.plate, both.plate, atol=SAME)
    assert np.abs(part.plate).max() > 0.02
    assert (part.plate[[0, 1, 3, 4]] == 0.0).all()
    np.testing.assert_allclose(whole.image.vectors(part.u), both.u, atol=SAME)
    assert part.volumes == pytest.approx(both.volumes, rel=SAME)
    ours, theirs = JUDGE.features(at.model, at.X, part.state), JUDGE.features(there.model, there.X, both.state)
    for mine, other in zip(*(jax.tree.leaves(one._replace(volume={})) for one in (ours, theirs)), strict=True):
        np.testing.assert_allclose(mine, other, atol=SAME)
    assert part.max_stretch == pytest.approx(both.max_stretch, rel=SAME)
    assert whole.negative_pivots(at, part.state) == 0
    state = whole.state(part.state)
    assert np.abs(residual_at(there, there.model.vector(state))).max() < SAME
    again = restored(at.model, at.X, part.u, part.state.plate, np.zeros((0, 6)))
    np.testing.assert_allclose(at.model.vector(again), at.model.vector(part.state), atol=1e-8)


def gathered(mesh: TetMesh, forces: np.ndarray) -> np.ndarray:
    """What acts on the nodes of a sector where images follow and nodes on the axis stay there."""
    (nodes, sources), answer = mesh.tied, forces.copy()
    answer[sources] += answer[nodes] @ turned(turns_of(mesh.part))[1]
    answer[nodes] = 0.0
    answer[mesh.axis, :2] = 0.0
    return answer


def folded(mesh: TetMesh, whole: Whole, forces: np.ndarray) -> np.ndarray:
    """The same from what acts on the nodes of the whole body."""
    answer = np.zeros((whole.part.nodes, 3))
    np.add.at(answer, whole.image.source, np.einsum("nji,nj->ni", whole.image.turn, forces))
    return gathered(mesh, answer)


def test_gradients_are_those_of_the_whole(case):
    mesh, (at, tangent, part), whole, (there, both) = case
    tangent.move_to(at, part.state)
    whole.tangent.move_to(there, both.state)
    ours, theirs = gradient(at, tangent, part, JUDGE), gradient(there, whole.tangent, both, JUDGE)
    assert ours.value == pytest.approx(theirs.value, abs=SAME)
    expected = folded(mesh, whole, theirs.X)
    np.testing.assert_allclose(gathered(mesh, ours.X), expected, atol=SAME * np.abs(expected).max())
    assert sum(ours.pressure.values()) == pytest.approx(sum(theirs.pressure.values()), rel=SAME)
    boundary = gathered(mesh, boundary_gradient(at, mesh, part, ours.adjoint))
    expected = folded(mesh, whole, boundary_gradient(there, whole.image.mesh, both, theirs.adjoint))
    np.testing.assert_allclose(boundary, expected, atol=10 * SAME * np.abs(expected).max())


def test_blocked_it_pushes_like_the_whole():
    mesh = part_mesh(problem())
    part, blocked = build_model(mesh, RUBBER), np.ones(6, bool)
    at = configure(part, mesh.points, build_loads(part, {"A": 0.05}), blocked)
    whole = whole_of(part, mesh)
    mine, other = solve(at, Tangent(part)), solve(whole.configuration(at), whole.tangent)
    assert not isinstance(mine, NoEquilibrium) and not isinstance(other, NoEquilibrium)
    assert mine.reaction[2] > 0.1
    np.testing.assert_allclose(mine.reaction, other.reaction, atol=1e-7)


def test_a_column_buckles_though_a_sector_does_not():
    """A round column pressed beyond Euler's load buckles to any side: two modes, which only the whole one knows."""
    asked = problem()
    column = starting_body(asked.tubes)
    P = column.control_points() * [0.375, 0.375, 2.5]
    mesh = mesh_body(column.with_control_points(P), 3.0, (sector(3),)).mesh
    part = build_model(mesh, RUBBER)
    whole = whole_of(part, mesh)
    # Of a column clamped at its base: π² E I / (4 L²) with E of about 1.4 MPa, with a bore of half the radius.
    euler = np.pi**2 * 1.4 * np.pi / 4 * (3.0**4 - 1.5**4) / (4 * 60**2)
    pivots = []
    for force in (0.5 * euler, 2 * euler):
        at = configure(part, mesh.points, build_loads(part, {}, wrench=np.array([0, 0, -force, 0, 0, 0])))
        found = solve(at, Tangent(part))
        assert not isinstance(found, NoEquilibrium) and found.stable
        pivots.append(whole.negative_pivots(at, found.state))
    assert pivots == [0, 2]


def test_a_sector_without_contact_goes_through_its_images():
    mesh = part_mesh(problem(3, radius=6.0))
    part, skin, since = build_model(mesh, RUBBER), Skin(mesh), None
    tangent, seen = Tangent(part), []
    # In between, how far the few elements collapse depends on the mesh.
    for pressure in (0.05, 0.15, 0.25):
        at = configure(part, mesh.points, build_loads(part, {"A": -pressure}), np.array([1, 1, 0, 1, 1, 0], bool))
        found = solve(at, tangent, since=since)
        assert not isinstance(found, NoEquilibrium), found
        since = at, found.state
        seen.append(skin.intersects_itself(at.X + found.u))
    assert not seen[0] and seen[-1]


def test_the_surface_of_a_sector_touches_its_images():
    """A tube that collapses on its axis, where nothing but the other sectors is in the way."""
    asked = problem(3, radius=6.0)
    mesh = part_mesh(asked)
    image = unfold(mesh)
    own = Pairs(surface_of(image.mesh), mesh.points, True, [], 2.0, 0.1, image)
    part = build_model(mesh, RUBBER, contact=Contact(surface_of(mesh), {}, {}, own))
    whole, tangent, since = whole_of(part, mesh), Tangent(part), None
    for pressure in (0.05, 0.15, 0.25):
        at = configure(part, mesh.points, build_loads(part, {"A": -pressure}), np.array([1, 1, 0, 1, 1, 0], bool))
        found = solve(at, tangent, since=since, tolerance=1e-11)
        assert not isinstance(found, NoEquilibrium), found
        since = at, found.state
    there, state = whole.configuration(at), whole.state(found.state)
    touching = contact_forces(at, found.state).own
    assert touching > 1.0
    assert touching == pytest.approx(contact_forces(there, state).own, rel=SAME)
    assert np.abs(residual_at(there, there.model.vector(state))).max() < 1e-9
    random = np.random.default_rng(0)
    direction = np.where(at.constrained, 0.0, random.normal(size=part.size))
    tangent.move_to(at, found.state)
    product = part.vector(tangent_product(part.potential, at.X, found.state, at.loads, part.state(direction)))
    back = tangent.precondition(np.where(at.constrained, 0.0, product))
    np.testing.assert_allclose(back, direction, atol=1e-8)


BESIDE = around(3, 4.5)
FREE = {name: {"start": "50 kPa", "min": "40 kPa", "max": "60 kPa"} for name in "ABC"}


ALONG = {"force": ["0 N", "0 N", "1 N"], "moment": ["0 N*mm", "0 N*mm", "5 N*mm"]}
OPPOSITE = {"A": "60 kPa", "B": "50 kPa", "C": "60 kPa", "D": "50 kPa"}
WALL = {"kind": "plane", "name": "wall", "point": ["20 mm", "0 mm", "0 mm"], "normal": [-1, 0, 0]}


@pytest.mark.parametrize(
    ("asked", "part"),
    [
        (problem(), ("sector 3",)),
        (problem(1), ()),
        (problem(2), ("sector 2",)),
        (problem({"rotation": 6, "half_turn": "x"}), ("sector 6",)),
        (problem({"half_turn": "x"}), ()),
        (problem(motion="extension"), ("sector 3",)),
        (problem(motion="bending_x", gravity={"direction": [0, 1, 0]}), ()),
        (problem({"mirror": ["xz", "yz"]}, motion="extension"), ("xz", "yz")),
        (problem({"mirror": ["xz"], "rotation": 3}, motion="extension"), ("sector 3",)),
        (problem({"mirror": ["xz"], "rotation": 2}, motion="extension"), ("xz", "yz")),
        (problem({"mirror": ["xz"], "rotation": 6}, motion="extension"), ("sector 6",)),
        (problem(gravity={"direction": [0, 0, -1]}), ("sector 3",)),
        (problem(gravity={"direction": [1, 0, 0]}), ()),
        (
            problem(end_effector=ALONG),
            ("sector 3",),
        ),
        (problem(end_effector={"force": ["0 N", "1 N", "0 N"]}), ()),
        (problem(objective={"kind": "reach", "position": ["0 mm", "0 mm", "26 mm"]}), ("sector 3",)),
        (problem(objective={"kind": "reach", "position": ["1 mm", "0 mm", "26 mm"]}), ()),
        (problem(3, BESIDE, 1.5), ("sector 3",)),
        (problem(3, BESIDE, 1.5, pressure={"A": "60 kPa"}), ()),
        (problem(3, BESIDE, 1.5, pressure=FREE), ()),
        (problem(3, ((0, 0),), pressure={"A": FREE["A"]}), ("sector 3",)),
        (problem(4, around(4, 4.5), 1.2), ("sector 4",)),
        (
            problem(4, around(4, 4.5), 1.2, pressure=OPPOSITE),
            ("sector 2",),
        ),
        (problem(contact={"self": True}), ("sector 3",)),
        (
            problem(obstacle=[WALL]),
            (),
        ),
    ],
)
def test_where_a_sector_tells_all(asked, part):
    assert part_of(asked) == part


def test_pressures_that_are_given_count_in_place_of_the_tasks():
    asked = problem(3, BESIDE, 1.5, pressure={"A": "60 kPa"})
    assert part_of(asked, [dict.fromkeys("ABC", 0.06)]) == ("sector 3",)
    assert part_of(asked, [dict.fromkeys("ABC", 0.06), {"A": 0.06}]) == ()
