"""Half a body in place of the whole: the same answers and gradients, wherever the problem allows it."""

import jax.numpy as jnp
import numpy as np
import pytest

from pneumorph.geometry import build_design_space, starting_body
from pneumorph.mechanics import (
    NoEquilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    mirror_of,
    neo_hookean_rubber,
    solve,
    whole_of,
)
from pneumorph.mesh import mesh_body
from pneumorph.mesh.tets import TetMesh
from pneumorph.objective import Objective, equidistant
from pneumorph.problem import Problem
from pneumorph.sensitivity import boundary_gradient, gradient
from pneumorph.verify.solids import block

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)
SILICONE = neo_hookean_rubber(0.49, 4.9e3, 1.1e-9)
NORMAL = {"xz": 1, "yz": 0}


def problem(mirror=("xz",), centres=((0, 0),), radius=4.0, motion="extension", **others) -> Problem:
    chambers = [
        {"name": name, "radius": f"{radius} mm", "center": [f"{x} mm", f"{y} mm"], "span": ["3 mm", "21 mm"]}
        for name, (x, y) in zip("ABCD", centres, strict=False)
    ]
    task = {
        "name": "one",
        "pressure": others.pop("pressure", {chamber["name"]: "60 kPa" for chamber in chambers}),
        "objective": {"kind": "maximize", "motion": motion},
    }
    body = {"length": "24 mm", "radius": "8 mm", "control_density": "0.4 /mm", "chamber": chambers}
    body["symmetry"] = mirror if isinstance(mirror, dict) else {"mirror": list(mirror)}
    return Problem.model_validate({"material": {"name": "Hei-Cast 8400"}, "body": body, "task": [task], **others})


def half_mesh(asked: Problem) -> TetMesh:
    """Half of a symmetric body that is no tube of revolution."""
    space = build_design_space(asked, starting_body(asked.body))
    phi = space.start + 0.05 * np.random.default_rng(0).normal(size=space.n)
    return mesh_body(space.body(phi), 6.0, mirror_of(asked)).mesh


def judge(mirror):
    """A symmetric objective of every symmetric feature."""
    along = 1 - NORMAL[mirror]

    def value(f):
        sections = jnp.sum(f.section_rotation[:, along, 2]) + f.section_position[1, along]
        plate = 0.1 * f.translation[2] + f.rotation[1 - along] ** 2 + f.translation[along]
        return plate + sections + 1e-4 * sum(f.volume.values()) / 3

    return Objective(value, equidistant(3, 24.0))


CASES = [
    pytest.param(("xz", ((0, 0),), 4.0, True, False), id="plate"),
    pytest.param(("xz", ((0, 0),), 4.0, True, True), id="mixed", marks=pytest.mark.slow),
    pytest.param(("yz", ((-3.5, 0), (3.5, 0)), 2.0, False, False), id="free tip, a pair of chambers"),
]


@pytest.fixture(scope="module", params=CASES)
def case(request):
    mirror, centres, radius, plate, mixed = request.param
    mesh = half_mesh(problem((mirror,), centres, radius))
    half = build_model(mesh, SILICONE if mixed else RUBBER, plate, mixed=mixed)
    along, axis = 1 - NORMAL[mirror], NORMAL[mirror]
    weight, wrench = np.zeros(3), np.zeros(6)
    weight[along], wrench[along], wrench[3 + axis] = 9810.0, 0.1, 3.0
    carried = {"spring": np.array([0.3, 0.2, 0.5, 10, 20, 5]), "wrench": wrench} if plate else {}
    acting = build_loads(half, dict.fromkeys(half.chambers, 0.05), weight, **carried)
    at, tangent = configure(half, mesh.points, acting), Tangent(half)
    found = solve(at, tangent, tolerance=1e-11)
    assert not isinstance(found, NoEquilibrium), found
    whole = whole_of(half, mesh)
    there = whole.configuration(at)
    both = solve(there, whole.tangent, tolerance=1e-11)
    assert not isinstance(both, NoEquilibrium), both
    return mirror, mesh, (at, tangent, found), whole, (there, both)


def test_states_are_those_of_the_whole(case):
    mirror, _, (at, _, half), whole, (there, both) = case
    np.testing.assert_allclose(half.plate, both.plate, atol=1e-8)
    assert np.abs(half.plate).max() > 0.02
    np.testing.assert_allclose(whole.image.vectors(half.u), both.u, atol=1e-8)
    assert half.volumes == pytest.approx(both.volumes, rel=1e-9)
    J = judge(mirror)
    ours, theirs = J.features(at.model, at.X, half.state), J.features(there.model, there.X, both.state)
    for mine, other in zip((*ours[:2], *ours[3:]), (*theirs[:2], *theirs[3:]), strict=True):
        np.testing.assert_allclose(mine, other, atol=1e-8)
    assert abs(float(ours.rotation[NORMAL[mirror]])) > 5e-4
    assert half.max_stretch == pytest.approx(both.max_stretch, rel=1e-8)
    assert whole.negative_pivots(at, half.state) == 0


def folded(whole, gradient):
    """From a gradient by the whole body's nodes to that by the half's, the image following."""
    answer = np.zeros((whole.half.nodes, 3))
    np.add.at(answer, whole.image.source, whole.image.sign * gradient)
    return answer


def test_gradients_are_those_of_the_whole(case):
    mirror, mesh, (at, tangent, half), whole, (there, both) = case
    J = judge(mirror)
    tangent.move_to(at, half.state)
    whole.tangent.move_to(there, both.state)
    ours, theirs = gradient(at, tangent, half, J), gradient(there, whole.tangent, both, J)
    assert ours.value == pytest.approx(theirs.value, abs=1e-8)
    moving = np.ones((len(mesh.points), 3), bool)
    moving[mesh.mirror_nodes, NORMAL[mirror]] = False
    expected = folded(whole, theirs.X)
    np.testing.assert_allclose(ours.X[moving], expected[moving], atol=1e-8 * np.abs(expected).max() + 1e-9)
    assert sum(ours.pressure.values()) == pytest.approx(sum(theirs.pressure.values()), rel=1e-7)
    boundary = boundary_gradient(at, mesh, half, ours.adjoint)
    expected = folded(whole, boundary_gradient(there, whole.image.mesh, both, theirs.adjoint))
    np.testing.assert_allclose(boundary[moving], expected[moving], atol=1e-7 * np.abs(expected).max())


def test_blocked_it_pushes_like_the_whole():
    mesh = half_mesh(problem())
    half = build_model(mesh, RUBBER)
    blocked = np.array([1, 1, 1, 1, 1, 1], bool)
    at = configure(half, mesh.points, build_loads(half, {"A": 0.05}), blocked)
    whole = whole_of(half, mesh)
    mine, other = solve(at, Tangent(half)), solve(whole.configuration(at), whole.tangent)
    assert not isinstance(mine, NoEquilibrium) and not isinstance(other, NoEquilibrium)
    assert mine.reaction[2] > 0.1
    np.testing.assert_allclose(mine.reaction, other.reaction, atol=1e-7)


def test_what_half_a_body_cannot_see():
    """A strip pressed along its length buckles out of the mirror plane, and only the whole one knows."""
    on = {"base": lambda r: r[:, 2] == 0, "tip": lambda r: r[:, 2] == 1, "mirror xz": lambda r: r[:, 1] == 0}
    mesh = block((2, 1, 10), lambda r: (r - [0.5, 0, 0]) * [6, 1.5, 40], on)
    half = build_model(mesh, RUBBER)
    whole = whole_of(half, mesh)
    assert np.ptp(whole.image.mesh.points, axis=0) == pytest.approx([6, 3, 40])
    # Euler's load of a strip clamped at its base: π² E I / (4 L²) with E I of about 1.4 MPa · 13.5 mm⁴.
    euler = np.pi**2 * 1.4 * 13.5 / (4 * 40**2)
    pivots = []
    for force in (0.5 * euler, 2 * euler):
        at = configure(half, mesh.points, build_loads(half, {}, wrench=np.array([0, 0, -force, 0, 0, 0])))
        found = solve(at, Tangent(half))
        assert not isinstance(found, NoEquilibrium) and found.stable
        pivots.append(whole.negative_pivots(at, found.state))
    assert pivots == [0, 1]


PAIR = ((0, -4), (0, 4))
UNLIKE = {"A": "60 kPa", "B": "50 kPa"}
FREE = {name: {"start": "50 kPa", "min": "40 kPa", "max": "60 kPa"} for name in "AB"}


@pytest.mark.parametrize(
    ("asked", "plane"),
    [
        (problem(()), None),
        (problem(), "xz"),
        (problem(("yz",)), "yz"),
        (problem(("xy",)), None),
        (problem(motion="bending_y"), "xz"),
        (problem(("yz",), motion="-bending_x"), "yz"),
        (problem(("xz", "yz"), motion="bending_x"), "yz"),
        (problem({"mirror": ["yz"], "rotation": 2}, motion="bending_y"), "xz"),
        (problem(gravity={"direction": [1, 0, -1]}), "xz"),
        (problem(gravity={"direction": [0, 1, 0]}), None),
        (problem(("xz", "yz"), gravity={"direction": [0, 1, 0]}), "yz"),
        (problem(end_effector={"force": ["1 N", "0 N", "1 N"], "moment": ["0 N*mm", "1 N*mm", "0 N*mm"]}), "xz"),
        (problem(end_effector={"force": ["0 N", "1 N", "0 N"]}), None),
        (problem(end_effector={"moment": ["0 N*mm", "0 N*mm", "1 N*mm"]}), None),
        (problem(centres=PAIR, radius=1.5), "xz"),
        (problem(centres=PAIR, radius=1.5, pressure=UNLIKE), None),
        (problem(centres=PAIR, radius=1.5, pressure={"A": "60 kPa"}), None),
        (problem(centres=PAIR, radius=1.5, pressure=FREE), None),
        (problem(("xz", "yz"), centres=PAIR, radius=1.5, pressure=UNLIKE), "yz"),
        (problem(pressure={"A": FREE["A"]}), "xz"),
    ],
)
def test_where_half_a_body_tells_all(asked, plane):
    assert mirror_of(asked) == plane


def test_pressures_that_are_given_count_in_place_of_the_tasks():
    asked = problem(centres=PAIR, radius=1.5, pressure=UNLIKE)
    assert mirror_of(asked, [{"A": 0.06, "B": 0.06}]) == "xz"
    assert mirror_of(asked, [{"A": 0.06, "B": 0.06}, {"A": 0.06, "B": 0.05}]) is None
