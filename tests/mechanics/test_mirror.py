"""Half or a quarter of a body in place of the whole: the same answers and gradients, where the problem allows it."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from parts import RUBBER, part_mesh, solved_both, symmetric

from pneumorph.mechanics import (
    NoEquilibrium,
    Skin,
    Tangent,
    build_loads,
    build_model,
    configure,
    mirrors_of,
    solve,
    whole_of,
)
from pneumorph.mesh.tets import TetMesh
from pneumorph.objective import Objective, equidistant
from pneumorph.problem import Problem
from pneumorph.sensitivity import boundary_gradient, gradient
from pneumorph.verify.solids import block

NORMAL = {"xz": 1, "yz": 0}
SAME = 1e-10


def problem(mirror=("xz",), *placed, **others) -> Problem:
    symmetry = mirror if isinstance(mirror, dict) else {"mirror": list(mirror)}
    return symmetric(symmetry, *placed, body={"control_density": "0.4 /mm"}, **others)


def judge(mirrors):
    """A symmetric objective of every symmetric feature."""
    if len(mirrors) == 2:
        return Objective(
            lambda f: 0.1 * f.translation[2] + f.section_position[1, 2] + 1e-4 * sum(f.volume.values()) / 3,
            equidistant(3, 24.0),
        )
    along = 1 - NORMAL[mirrors[0]]

    def value(f):
        sections = jnp.sum(f.section_rotation[:, along, 2]) + f.section_position[1, along]
        plate = 0.1 * f.translation[2] + f.rotation[1 - along] ** 2 + f.translation[along]
        return plate + sections + 1e-4 * sum(f.volume.values()) / 3

    return Objective(value, equidistant(3, 24.0))


FOUR = ((3.5, 3.5), (-3.5, 3.5), (3.5, -3.5), (-3.5, -3.5))
CASES = [
    pytest.param((("xz",), ((0, 0),), 4.0, True, False), id="plate"),
    pytest.param((("xz",), ((0, 0),), 4.0, True, True), id="mixed", marks=pytest.mark.slow),
    pytest.param((("yz",), ((-3.5, 0), (3.5, 0)), 2.0, False, False), id="free tip, a pair of chambers"),
    pytest.param((("xz", "yz"), ((0, 0),), 4.0, True, False), id="quarter"),
    pytest.param((("xz", "yz"), ((0, 0),), 4.0, True, True), id="quarter, mixed", marks=pytest.mark.slow),
    pytest.param((("xz", "yz"), ((-3.5, 0), (3.5, 0)), 2.0, False, False), id="quarter, free tip, a pair"),
    pytest.param((("xz", "yz"), FOUR, 1.8, True, False), id="quarter, four chambers"),
]


@pytest.fixture(scope="module", params=CASES)
def case(request):
    mirrors, centres, radius, plate, mixed = request.param
    mesh = part_mesh(problem(mirrors, centres, radius))
    assert mesh.mirrors == mirrors
    weight, wrench = np.array([0.0, 0.0, -9810.0]), np.array([0.0, 0.0, 0.1, 0.0, 0.0, 0.0])
    if len(mirrors) == 1:
        along, axis = 1 - NORMAL[mirrors[0]], NORMAL[mirrors[0]]
        weight[along], wrench[along], wrench[3 + axis] = 9810.0, 0.1, 3.0
    return mirrors, mesh, *solved_both(mesh, plate, mixed, weight, wrench)


def test_states_are_those_of_the_whole(case):
    mirrors, _, (at, _, part), whole, (there, both) = case
    np.testing.assert_allclose(part.plate, both.plate, atol=SAME)
    assert np.abs(part.plate).max() > 0.02
    np.testing.assert_allclose(whole.image.vectors(part.u), both.u, atol=SAME)
    assert part.volumes == pytest.approx(both.volumes, rel=SAME)
    J = judge(mirrors)
    ours, theirs = J.features(at.model, at.X, part.state), J.features(there.model, there.X, both.state)
    for mine, other in zip(*(jax.tree.leaves(one._replace(volume={})) for one in (ours, theirs)), strict=True):
        np.testing.assert_allclose(mine, other, atol=SAME)
    if len(mirrors) == 1:
        assert abs(float(ours.rotation[NORMAL[mirrors[0]]])) > 5e-4
    assert part.max_stretch == pytest.approx(both.max_stretch, rel=SAME)
    assert whole.negative_pivots(at, part.state) == 0


def folded(whole, gradient):
    """From a gradient by the whole body's nodes to that by the part's, the images following."""
    answer = np.zeros((whole.part.nodes, 3))
    np.add.at(answer, whole.image.source, np.einsum("nji,nj->ni", whole.image.turn, gradient))
    return answer


def test_gradients_are_those_of_the_whole(case):
    mirrors, mesh, (at, tangent, part), whole, (there, both) = case
    J = judge(mirrors)
    tangent.move_to(at, part.state)
    whole.tangent.move_to(there, both.state)
    ours, theirs = gradient(at, tangent, part, J), gradient(there, whole.tangent, both, J)
    assert ours.value == pytest.approx(theirs.value, abs=SAME)
    moving = np.ones((len(mesh.points), 3), bool)
    for plane in mirrors:
        moving[mesh.mirror_nodes(plane), NORMAL[plane]] = False
    expected = folded(whole, theirs.X)
    np.testing.assert_allclose(ours.X[moving], expected[moving], atol=SAME * np.abs(expected).max())
    assert sum(ours.pressure.values()) == pytest.approx(sum(theirs.pressure.values()), rel=SAME)
    boundary = boundary_gradient(at, mesh, part, ours.adjoint)
    expected = folded(whole, boundary_gradient(there, whole.image.mesh, both, theirs.adjoint))
    np.testing.assert_allclose(boundary[moving], expected[moving], atol=10 * SAME * np.abs(expected).max())


@pytest.mark.parametrize("mirrors", [("xz",), ("xz", "yz")])
def test_blocked_it_pushes_like_the_whole(mirrors):
    mesh = part_mesh(problem(mirrors))
    part = build_model(mesh, RUBBER)
    blocked = np.array([1, 1, 1, 1, 1, 1], bool)
    at = configure(part, mesh.points, build_loads(part, {"A": 0.05}), blocked)
    whole = whole_of(part, mesh)
    mine, other = solve(at, Tangent(part)), solve(whole.configuration(at), whole.tangent)
    assert not isinstance(mine, NoEquilibrium) and not isinstance(other, NoEquilibrium)
    assert mine.reaction[2] > 0.1
    np.testing.assert_allclose(mine.reaction, other.reaction, atol=1e-7)


@pytest.mark.parametrize(
    ("mirrors", "sides", "modes"),
    [
        pytest.param(("xz",), (6.0, 3.0), 1, id="half a strip"),
        pytest.param(("xz", "yz"), (6.0, 3.0), 1, id="a quarter of a strip, across its thickness"),
        pytest.param(("xz", "yz"), (3.0, 6.0), 1, id="a quarter of a strip, across its width"),
        pytest.param(("xz", "yz"), (4.2426, 4.2426), 2, id="a quarter of a square column, both ways"),
    ],
)
def test_what_part_of_a_body_cannot_see(mirrors, sides, modes):
    """A column pressed along its length buckles out of a mirror plane, and only the whole one knows."""
    on = {"base": lambda r: r[:, 2] == 0, "tip": lambda r: r[:, 2] == 1}
    on |= {f"mirror {plane}": lambda r, normal=NORMAL[plane]: r[:, normal] == 0 for plane in mirrors}
    shares = np.array([0.5 if plane in mirrors else 1.0 for plane in ("yz", "xz")])
    size, start = np.array([*(shares * sides), 40.0]), np.array([*(shares == 1.0), 0.0]) / 2
    mesh = block((2, 2, 10), lambda r: (r - start) * size, on)
    part = build_model(mesh, RUBBER)
    assert part.part == mirrors
    whole = whole_of(part, mesh)
    assert np.ptp(whole.image.mesh.points, axis=0) == pytest.approx([*sides, 40])
    # Euler's load of a column clamped at its base: π² E I / (4 L²) with E of about 1.4 MPa.
    euler = np.pi**2 * 1.4 * max(sides) * min(sides) ** 3 / 12 / (4 * 40**2)
    pivots = []
    for force in (0.5 * euler, 2 * euler):
        at = configure(part, mesh.points, build_loads(part, {}, wrench=np.array([0, 0, -force, 0, 0, 0])))
        found = solve(at, Tangent(part))
        assert not isinstance(found, NoEquilibrium) and found.stable
        pivots.append(whole.negative_pivots(at, found.state))
    assert pivots == [0, modes]


def test_a_quarter_that_twists():
    """A strip pressed between ends that stay level twists, which is odd about both of its mirror planes."""
    on = {"base": lambda r: r[:, 2] == 0, "tip": lambda r: r[:, 2] == 1}
    on |= {f"mirror {plane}": lambda r, normal=normal: r[:, normal] == 0 for plane, normal in NORMAL.items()}
    mesh = block((4, 1, 6), lambda r: r * [10, 1, 20], on)
    part = build_model(mesh, RUBBER)
    whole, level = whole_of(part, mesh), np.array([1, 1, 0, 1, 1, 0], bool)
    # A strip of width b and thickness t, free to warp, twists under 4 G t³ / b: here a little later.
    warping = 4 * 0.49 * 2**3 / 20
    pivots = []
    for force, blocked in ((warping, level), (2.5 * warping, level), (2.5 * warping, level | [0, 0, 0, 0, 0, 1])):
        at = configure(part, mesh.points, build_loads(part, {}, wrench=np.array([0, 0, -force, 0, 0, 0])), blocked)
        found = solve(at, Tangent(part))
        assert not isinstance(found, NoEquilibrium) and found.stable
        pivots.append(whole.negative_pivots(at, found.state))
    assert pivots == [0, 1, 0]


PAIR = ((0, -4), (0, 4))
UNLIKE = {"A": "60 kPa", "B": "50 kPa"}
FREE = {name: {"start": "50 kPa", "min": "40 kPa", "max": "60 kPa"} for name in "AB"}


@pytest.mark.parametrize(
    ("asked", "planes"),
    [
        (problem(()), []),
        (problem(), ["xz"]),
        (problem(("yz",)), ["yz"]),
        (problem(("xy",)), []),
        (problem(("yz", "xz")), ["xz", "yz"]),
        (problem({"mirror": ["yz"], "rotation": 2}), ["xz", "yz"]),
        (problem(motion="bending_y"), ["xz"]),
        (problem(("yz",), motion="-bending_x"), ["yz"]),
        (problem(("xz", "yz"), motion="bending_x", gravity={"direction": [0, 1, 0]}), ["yz"]),
        (problem({"mirror": ["yz"], "rotation": 2}, motion="bending_y", gravity={"direction": [1, 0, 0]}), ["xz"]),
        (problem(gravity={"direction": [1, 0, -1]}), ["xz"]),
        (problem(gravity={"direction": [0, 1, 0]}), []),
        (problem(("xz", "yz"), gravity={"direction": [0, 1, 0]}), ["yz"]),
        (problem(("xz", "yz"), gravity={"direction": [0, 0, 1]}), ["xz", "yz"]),
        (problem(("xz", "yz"), gravity={"direction": [1, 1, 0]}), []),
        (problem(end_effector={"force": ["1 N", "0 N", "1 N"], "moment": ["0 N*mm", "1 N*mm", "0 N*mm"]}), ["xz"]),
        (problem(end_effector={"force": ["0 N", "1 N", "0 N"]}), []),
        (problem(end_effector={"moment": ["0 N*mm", "0 N*mm", "1 N*mm"]}), []),
        (problem(centres=PAIR, radius=1.5), ["xz"]),
        (problem(centres=PAIR, radius=1.5, pressure=UNLIKE), []),
        (problem(centres=PAIR, radius=1.5, pressure={"A": "60 kPa"}), []),
        (problem(centres=PAIR, radius=1.5, pressure=FREE), []),
        (problem(("xz", "yz"), centres=PAIR, radius=1.5), ["xz", "yz"]),
        (problem(("xz", "yz"), centres=PAIR, radius=1.5, pressure=UNLIKE), ["yz"]),
        (problem(("xz", "yz"), centres=PAIR, radius=1.5, pressure=FREE), ["yz"]),
        (problem(pressure={"A": FREE["A"]}), ["xz"]),
        (problem(("xz", "yz"), pressure={"A": FREE["A"]}), ["xz", "yz"]),
    ],
)
def test_where_part_of_a_body_tells_all(asked, planes):
    assert list(mirrors_of(asked)) == planes


def test_pressures_that_are_given_count_in_place_of_the_tasks():
    asked = problem(centres=PAIR, radius=1.5, pressure=UNLIKE)
    assert mirrors_of(asked, [{"A": 0.06, "B": 0.06}]) == ("xz",)
    assert mirrors_of(asked, [{"A": 0.06, "B": 0.06}, {"A": 0.06, "B": 0.05}]) == ()


def test_a_half_that_goes_through_its_image():
    mesh = part_mesh(problem())
    X, (x, _, z) = mesh.points, mesh.points.T
    dent = np.zeros_like(mesh.points)
    dent[:, 1] = -8.0 * np.maximum(0.0, 1.0 - (x / 3.0) ** 2) * np.maximum(0.0, 1.0 - ((z - 12.0) / 7.0) ** 2)
    assert Skin(mesh).intersects_itself(X + dent) and not Skin(mesh).intersects_itself(X + 0.3 * dent)
    alone = TetMesh(mesh.points, mesh.tets, {name: face for name, face in mesh.faces.items() if name != "mirror xz"})
    assert not Skin(alone).intersects_itself(X + dent), "the half itself does not"
