"""Equilibria in contact: nothing interpenetrates, forces balance, and derivatives are right before and after touch."""

from dataclasses import replace

import ipctk
import jax
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from pneumorph.mechanics import (
    Equilibrium,
    Skin,
    Tangent,
    build_loads,
    build_model,
    configure,
    contact_forces,
    follow,
    neo_hookean_rubber,
    settled,
    solve,
    sweep,
)
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.enclosed import Enclosed
from pneumorph.mechanics.contact.barrier import barrier, barrier_derivatives
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.implicit import Implicit
from pneumorph.mechanics.contact.pairs import Pairs
from pneumorph.mechanics.contact.samples import surface_of
from pneumorph.mechanics.contact.shapes import Box, Cylinder, Plane, RigidMesh, Sphere
from pneumorph.mechanics.contact.skin import _distinct
from pneumorph.mechanics.contact.triangulated import Triangulated
from pneumorph.mechanics.solve.balance import INTERPENETRATION, free_share
from pneumorph.mesh.tets import TetMesh
from pneumorph.sensitivity import taylor_test
from pneumorph.verify.solids import tube

RUBBER = neo_hookean_rubber(0.3, 3.0, 1.1e-9)
ACTIVATION, LENGTH = 0.3, 3.0
MESH = tube(8, 9.5, LENGTH, (1, 16, 1))
SURFACE = surface_of(MESH)


def ring(*shapes, own=True, mixed=False):
    """A ring in plane strain that is held where it crosses the negative x axis."""
    X = MESH.points
    held = np.zeros(X.shape, bool)
    held[:, 2] = (X[:, 2] == 0) | (X[:, 2] > LENGTH - 1e-9)
    held[(np.abs(X[:, 1]) < 1e-6) & (X[:, 0] < 0.0)] = True
    named = {f"o{number}": shape for number, shape in enumerate(shapes)}
    obstacles = {name: pressed_on(shape) for name, shape in named.items()}
    itself = Pairs(SURFACE, X, True, [], ACTIVATION, 0.3) if own else None
    around = {
        name: shape if isinstance(shape, RigidMesh) else shape.mesh(ACTIVATION / 4) for name, shape in named.items()
    }
    guards = {
        name: Pairs(SURFACE, X, False, [mesh], ACTIVATION / 4, 0.3) for name, mesh in around.items() if mesh is not None
    }
    contact = Contact(SURFACE, obstacles, guards, itself)
    return build_model(MESH, RUBBER, plate=False, supports=held, mixed=mixed, contact=contact)


def pressed_on(shape):
    made = Triangulated if isinstance(shape, RigidMesh) else None
    return made(SURFACE, shape, ACTIVATION, 0.3) if made else Implicit(SURFACE, shape, ACTIVATION, 0.3)


def loaded(model, pressure, X=None, pull=0.0, **moves):
    acting = build_loads(model, {"A": pressure}, acceleration=np.array([0.0, pull, 0.0]), moves=moves)
    return configure(model, MESH.points if X is None else X, acting)


def found(at, tangent=None, start=None, tolerance=1e-9) -> Equilibrium:
    there = solve(at, tangent or Tangent(at.model), start, tolerance)
    assert isinstance(there, Equilibrium), there.reason
    return there


def flat_triangles(x, mesh=MESH):
    """The boundary as four flat triangles for each face (T, 3, 3), made here without the package's own."""
    faces = np.concatenate([*mesh.faces.values()])
    return np.concatenate([x[faces[:, list(part)]] for part in ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5))])


def crossings(triangles):
    """How many pairs of an edge and a triangle without common corners intersect (Möller and Trumbore 1997)."""
    count = 0
    low, high = triangles.min(axis=1), triangles.max(axis=1)
    edges = np.concatenate([triangles[:, [i, j]] for i, j in ((0, 1), (1, 2), (2, 0))])
    for start, end in edges:
        beside = np.all((low <= np.maximum(start, end)) & (high >= np.minimum(start, end)), axis=1)
        near, along = triangles[beside], end - start
        a, b, c = np.moveaxis(near, 1, 0)
        h = np.cross(along, c - a)
        det = np.einsum("ti,ti->t", b - a, h)
        with np.errstate(all="ignore"):
            away = start - a
            u = np.einsum("ti,ti->t", away, h) / det
            q = np.cross(away, b - a)
            v = q @ along / det
            t = np.einsum("ti,ti->t", c - a, q) / det
            inside = (u > 0) & (v > 0) & (u + v < 1) & (t > 0) & (t < 1)
        apart = np.abs(near[:, :, None] - np.stack([start, end])).max(axis=-1).min(axis=(1, 2)) > 1e-9
        count += np.count_nonzero(inside & apart)
    return count


def test_the_check_of_these_tests_finds_what_interpenetrates():
    x = MESH.points.copy()
    assert crossings(flat_triangles(x)) == 0
    x[:, 1] *= -0.05  # turned inside out about the x axis, and nearly flat
    x[x[:, 0] > 8, 0] -= 5.0
    assert crossings(flat_triangles(x)) > 0


@pytest.mark.parametrize("pushed", [15.0, 17.0])
def test_what_goes_through_itself_is_found(pushed):
    """A ring of inner radius 8 mm whose upper half is pushed down, at most by this many mm, on the lower one."""
    mesh = tube(8, 9.5, LENGTH, (1, 96, 1))
    x = mesh.points.copy()
    above = (x[:, 1] > 0.0) & (np.abs(x[:, 0]) < 7.5)
    x[above, 1] -= pushed * np.cos(np.pi * x[above, 0] / 15.0) ** 2
    assert Skin(mesh).intersects_itself(x) == (crossings(flat_triangles(x, mesh)) > 0) == (pushed > 16.0)


def test_flat_triangles_of_a_thin_wall_are_divided():
    """The outer face of a ring is turned so that its corners are between those of the inner one."""
    ring = tube(10, 10.1, LENGTH, (1, 8, 1))
    mesh = TetMesh(ring.points, ring.tets, {name: ring.faces[name] for name in ("chamber A", "exterior")})
    X, skin = mesh.points, Skin(mesh)
    radius = np.hypot(X[:, 0], X[:, 1])
    angle = np.arctan2(X[:, 1], X[:, 0]) + np.pi / 8 * (radius - 10.0) / 0.1 / 2
    x = np.column_stack([radius * np.cos(angle), radius * np.sin(angle), X[:, 2]])
    assert crossings(flat_triangles(x, mesh)) > 0 and not skin.intersects_itself(x)


def collapsing(model):
    """Configurations of more and more vacuum, and the states there."""
    steps = [loaded(model, -p, pull=2e4) for p in (0.002, 0.005, 0.01)]
    return list(zip(steps, sweep(steps, Tangent(model)), strict=True))


@pytest.fixture(scope="module")
def collapsed():
    model = ring()
    return model, collapsing(model)


def test_a_ring_that_collapses_touches_itself_and_does_not_go_through(collapsed):
    for at, there in collapsed[1]:
        assert isinstance(there, Equilibrium), there.reason
        assert crossings(flat_triangles(at.X + there.u)) == 0
        assert there.stable
    assert contact_forces(at, there.state).own > 0.01
    assert there.volumes["A"] < 0.45 * np.pi * 64 * LENGTH


@pytest.mark.parametrize("mixed", [False, True])
def test_a_ring_that_is_emptied_touches_itself_as_under_the_pressure_found(mixed, collapsed):
    """Where a volume is taken out, its pressure is that which leaves this volume."""
    model, states = collapsed
    if mixed:
        model = ring(mixed=True)
        states = collapsing(model)
    _, there = states[-1]
    at_rest = found(loaded(model, 0.0)).volumes["A"]
    law = np.array([there.volumes["A"] - at_rest]), np.array([False]), np.zeros(1), np.ones(1), np.full(1, 0.101325)
    emptied = replace(loaded(model, 0.0, pull=2e4), enclosed=Enclosed(("A",), *law))
    again = found(emptied, start=there.state)
    assert again.enclosed["A"] == pytest.approx(-0.01, rel=1e-4) and again.stable
    if mixed:
        return
    # Also from rest, on a way on which the ring buckles.
    *_, swept = sweep([replace(emptied, enclosed=emptied.enclosed.part(f)) for f in (0.3, 0.7, 1.0)], Tangent(model))
    assert isinstance(swept, Equilibrium), swept.reason
    assert swept.volumes["A"] == pytest.approx(there.volumes["A"], rel=1e-7)
    assert crossings(flat_triangles(emptied.X + swept.u)) == 0
    assert contact_forces(settled(emptied, swept), swept.state).own > 0.005


SHAPES = {
    "plane": Plane(np.array([0, 10.5, 0]), np.array([0, -1.0, 0])),
    "sphere": Sphere(np.array([6.0, -12.6, 1.5]), 4.0),
    "cylinder": Cylinder(np.array([14.0, 0.0, 1.5]), np.array([0.0, 0.6, 0.8]), 2.0, 6.0),
    "box": Box(np.array([13.0, 3.0, 1.5]), np.array([2.0, 1.0, 5.0])),
}


@pytest.mark.parametrize("name, mixed", [*((name, False) for name in SHAPES), ("plane", True)])
def test_a_ring_that_grows_presses_on_an_obstacle(name, mixed):
    model = ring(SHAPES[name], mixed=mixed)
    at = loaded(model, 0.04)
    there = found(at)
    x = at.X + there.u
    places = np.concatenate([x, flat_triangles(x).mean(axis=1)])
    assert np.asarray(SHAPES[name].distance(places)).min() > 0.0
    forces = contact_forces(at, there.state)
    assert np.linalg.norm(forces.on["o0"]) > 1e-3 and forces.area["o0"] > 0.0
    # The pressure in a closed ring has no resultant: what presses on the obstacle is what holds the ring.
    _, residual = kernels.value_and_residual(model.potential, at.X, there.state, at.loads)
    held = np.where(model.supports, residual.u, 0.0).sum(axis=0)
    assert held[:2] == pytest.approx(forces.on["o0"][:2], abs=1e-7)


def notched():
    """A block of triangles with a notch along z, into which the ring is pressed from above."""
    outline = np.array([[-6, -8.2], [0, -11.5], [6, -8.2], [6, -16], [-6, -16]])
    points = np.concatenate([np.column_stack([outline, np.full(5, z)]) for z in (-3.0, 6.0)])
    sides = [[i, j, j + 5] for i, j in zip(range(5), np.roll(range(5), -1), strict=True)]
    sides += [[i, j + 5, i + 5] for i, j in zip(range(5), np.roll(range(5), -1), strict=True)]
    ends = np.array([[0, 1, 4], [1, 3, 4], [1, 2, 3]])
    return RigidMesh(points, np.array([*np.array(sides)[:, ::-1], *ends, *(ends[:, ::-1] + 5)]))


def pressed_at(at):
    return contact_forces(at, found(at).state)


NOTCH, BALL = notched(), Sphere(np.array([0.0, -12.6, 1.5]), 3.0)


def test_a_ball_of_triangles_presses_as_the_ball():
    """Triangles that are up to 8 µm outside it and tilted by up to 2° change the force by less than 4 %."""
    exact, near = (pressed_at(loaded(ring(ball, own=False), 0.04)) for ball in (BALL, BALL.mesh(0.008)))
    assert near.on["o0"] == pytest.approx(exact.on["o0"], abs=0.04 * exact.normal["o0"])
    assert near.normal["o0"] == pytest.approx(exact.normal["o0"], rel=0.04)
    assert near.area["o0"] == pytest.approx(exact.area["o0"], rel=0.04)


def test_the_barrier_is_that_of_pairs():
    """b = κ/d̂ times the barrier of ipctk, in JAX and with derivatives."""
    distance, reach, stiff = np.array([0.01, 0.1, 0.29, 0.3, 0.5]), 0.3, 0.7
    found = np.array(barrier_derivatives(distance, reach, stiff))
    theirs = (ipctk.barrier, ipctk.barrier_first_derivative, ipctk.barrier_second_derivative)
    assert found == pytest.approx(stiff / reach * np.array([[each(d, reach) for d in distance] for each in theirs]))
    assert np.asarray(barrier(distance, reach, stiff)) == pytest.approx(found[0], rel=1e-13)


def test_a_box_of_triangles_is_the_box_however_it_is_divided():
    """Beside its faces, edges and corners, and not beyond the activation distance."""
    box, mesh = SHAPES["box"], SHAPES["box"].mesh(0.0)
    for _ in range(2):
        mesh = divided(mesh)
    random = np.random.default_rng(0)
    places = box.center + (box.half + 0.8) * random.uniform(-1.0, 1.0, (4000, 3)) * random.choice([0.9, 1.0], (4000, 3))
    distance = np.asarray(box.distance(places))
    places, distance = places[distance > 0.01], distance[distance > 0.01]
    exact = -barrier_derivatives(distance, 0.7, 0.3)[1][:, None] * np.asarray(jax.vmap(jax.grad(box.distance))(places))
    near = np.count_nonzero(np.any(exact, axis=1))
    assert 500 < near < len(places)
    assert Triangulated(SURFACE, mesh, 0.7, 0.3).pressures(places) == pytest.approx(exact, abs=1e-11)


def divided(mesh):
    """Every triangle in three, about a point that is not its centre."""
    a, b, c = np.moveaxis(mesh.points[mesh.triangles], 1, 0)
    middle = len(mesh.points) + np.arange(len(mesh.triangles))
    parts = [np.column_stack([mesh.triangles[:, [i, (i + 1) % 3]], middle]) for i in range(3)]
    return RigidMesh(np.concatenate([mesh.points, 0.2 * a + 0.3 * b + 0.5 * c]), np.concatenate(parts))


def test_a_ring_is_pressed_into_a_notch():
    """Both sides of it press, where the distance from it has a kink between them."""
    model = ring(NOTCH, own=False)
    at = loaded(model, 0.04)
    there = found(at)
    x = at.X + there.u
    assert crossings(flat_triangles(x)) == 0 and x[:, 1].min() > -11.0
    forces = contact_forces(at, there.state)
    sides = x[x[:, 1] < -8.0, 0]
    assert sides.min() < -1.0 and sides.max() > 1.0 and forces.normal["o0"] > 1.1 * np.linalg.norm(forces.on["o0"])
    _, residual = kernels.value_and_residual(model.potential, at.X, there.state, at.loads)
    held = np.where(model.supports, residual.u, 0.0).sum(axis=0)
    assert held[:2] == pytest.approx(forces.on["o0"][:2], abs=1e-7)
    follows_the_derivative(model, 0.04, "shake", 2e-3)


def test_what_is_inside_an_obstacle_of_triangles_or_around_it_is_not_apart():
    around = RigidMesh(30.0 * (NOTCH.points - NOTCH.points.mean(axis=0)), NOTCH.triangles)
    within = RigidMesh(0.01 * (NOTCH.points - NOTCH.points.mean(axis=0)) + np.array([8.75, 0.1, 1.5]), NOTCH.triangles)
    beside = replace(within, points=within.points + np.array([-8.75, 0.0, 0.0]))
    apart = [ring(each, own=False).contact.apart(MESH.points, np.zeros((1, 6))) for each in (around, within, beside)]
    assert apart == [False, False, True]


def slope(at, there, seed):
    """Derivative of seed·u by the nodes (N, 3), and by the pressure."""
    model = at.model
    rhs = np.where(at.constrained, 0.0, model.vector(there.state._replace(u=seed, plate=np.zeros(6))))
    w = model.state(Tangent(model).solve_at(at, there.state, rhs))
    ((by_nodes, acting),) = products.pullback(model.potential, at.X, there.state, at.loads, [w])
    return -by_nodes, -float(acting.pressure[0])


TURN = np.column_stack([-MESH.points[:, 1], MESH.points[:, 0], 0 * MESH.points[:, 2]]) / 10.0
SHAKE = -np.random.default_rng(1).uniform(-0.2, 0.2, MESH.points.shape)


def first_touch(model) -> float:
    """The pressure at which the ring is at the activation distance from its obstacle."""
    low, high = 0.0, 0.04
    shape = model.contact.obstacles["o0"].shape
    tangent, state = Tangent(model), None
    for _ in range(40):
        middle = 0.5 * (low + high)
        at = loaded(model, middle)
        there = found(at, tangent, state)
        state = there.state
        near = float(np.asarray(shape.distance(at.X + there.u)).min()) < ACTIVATION
        low, high = (low, middle) if near else (middle, high)
    return low


@pytest.fixture(scope="module")
def touch():
    return first_touch(ring(SHAPES["plane"], own=False))


PLACES = {
    "before": lambda touch: 0.5 * touch,
    "across first touch": lambda touch: touch - 2e-9,
    "at first touch": lambda touch: touch,
    "after": lambda touch: 1.5 * touch,
}


@pytest.mark.parametrize("along", ["pressure", "turn", "shake"])
@pytest.mark.parametrize("place", PLACES)
def test_derivatives_before_at_and_after_touch(place, along, touch):
    """Along a turn of the ring its nodes graze the plane: they come no nearer to first order."""
    model = ring(SHAPES["plane"], own=False)
    # The barrier has two continuous derivatives: at first touch the second order shows in small steps only.
    step = {"before": 2e-2, "after": 2e-3}.get(place, 1e-4)
    follows_the_derivative(model, PLACES[place](touch), along, 5e-3 * step if along == "pressure" else step)


@pytest.mark.parametrize("along", ["pressure", "shake"])
def test_derivatives_in_self_contact(along):
    follows_the_derivative(ring(), -0.01, along, 2.5e-4 if along != "pressure" else 1e-5, pull=2e4)


def follows_the_derivative(model, pressure, along, step, pull=0.0):
    at = loaded(model, pressure, pull=pull)
    tangent = Tangent(model)
    # The remainders are as small as the errors of states of the usual accuracy.
    there = found(at, tangent, tolerance=1e-11)
    seed = np.random.default_rng(2).standard_normal(at.X.shape)
    by_nodes, by_pressure = slope(at, there, seed)
    dX = {"pressure": 0.0 * TURN, "turn": TURN, "shake": SHAKE}[along]
    derivative = by_pressure if along == "pressure" else float(np.sum(by_nodes * dX))

    def value(h):
        moved = at.X + h[0] * dX
        other = loaded(model, pressure + (h[0] if along == "pressure" else 0.0), moved, pull)
        return float(np.sum(seed * found(other, tangent, there.state, 1e-11).u))

    test = taylor_test(
        value, np.zeros(1), np.array([derivative]), np.ones(1), step, start=float(np.sum(seed * there.u))
    )
    assert test.passed, test


def test_a_path_goes_on_through_contact():
    """Pressures on a path past touch; the energy that it took is what is stored."""
    model = ring(SHAPES["plane"])
    path = follow(loaded(model, 0.04), Tangent(model), load=1.0)
    assert "reached" in path.reason
    pressing = [contact_forces(loaded(model, point.pressures["A"]), point.equilibrium.state) for point in path.points]
    assert pressing[0].on["o0"][1] == 0.0 < pressing[-1].on["o0"][1]
    direct = found(loaded(model, path.points[-1].pressures["A"]))
    assert path.points[-1].equilibrium.u == pytest.approx(direct.u, abs=1e-5)


def test_the_pattern_of_the_tangent_grows_with_contact():
    model = ring()
    tangent = Tangent(model)
    apart = found(loaded(model, -0.002, pull=2e4), tangent)
    touching = solve(loaded(model, -0.01, pull=2e4), tangent, since=(loaded(model, -0.002, pull=2e4), apart.state))
    assert isinstance(touching, Equilibrium)
    fresh = Tangent(model)
    rhs = np.where(loaded(model, -0.01).constrained, 0.0, np.random.default_rng(0).standard_normal(model.size))
    at = loaded(model, -0.01, pull=2e4)
    assert tangent.solve_at(at, touching.state, rhs) == pytest.approx(fresh.solve_at(at, touching.state, rhs), rel=1e-6)


def test_a_body_that_starts_in_an_obstacle_has_no_equilibrium():
    model = ring(replace(SHAPES["plane"], point=np.array([0, 9.0, 0])))
    found = solve(loaded(model, 0.01), Tangent(model))
    assert INTERPENETRATION in found.reason


def test_steps_end_before_they_meet_an_obstacle():
    contact = Contact(SURFACE, {"0": Implicit(SURFACE, SHAPES["sphere"], 0.3, 0.3)}, {}, None)
    start, end = MESH.points, MESH.points - np.array([0.0, 12.0, 0.0])
    still = np.zeros((1, 6))
    share = contact.free_share(start, end, still, still)
    assert 0.0 < share < 1.0
    assert contact.apart(start + share * (end - start), still) and not contact.apart(start + 0.5 * (end - start), still)


@pytest.mark.parametrize("name", ["sphere", "cylinder", "box"])
def test_triangles_around_a_shape(name):
    mesh = SHAPES[name].mesh(0.05)
    corners = mesh.points[mesh.triangles]
    shares = np.random.default_rng(0).dirichlet(np.ones(3), 50)
    places = np.einsum("pk,tki->tpi", shares, corners)
    away = np.asarray(SHAPES[name].distance(places))
    assert away.min() > -1e-9 and away.max() < 0.2
    a, b, c = np.moveaxis(corners, 1, 0)
    volume = np.einsum("ti,ti->", a, np.cross(b, c)) / 6
    exact = {"sphere": 4 / 3 * np.pi * 64, "cylinder": np.pi * 4 * 12, "box": 4 * 2 * 10}[name]
    assert volume == pytest.approx(exact, rel=0.05) and volume > exact - 1e-9


def test_nothing_presses_on_itself_at_rest():
    """An activation distance beyond that of neighbours in the mesh is made shorter."""
    pairs = Pairs(SURFACE, MESH.points, True, [], 2.0, 0.3)
    assert pairs.touch(MESH.points).nothing
    nearer = MESH.points * [1.0, 0.02, 1.0]
    assert not pairs.touch(nearer).nothing and pairs.touch(nearer).energy > 0.0


def test_an_obstacle_that_moves_presses_as_one_that_is_there():
    """A plane is moved into where the ring was, in steps of a sweep and at once, and back again."""
    model = ring(SHAPES["plane"], own=False)
    moved = (0.0, 1.5, 2.5, 1.5)
    steps = [loaded(model, 0.002, o0=(0.0, -by, 0.0)) for by in moved]
    there = list(sweep(steps, Tangent(model)))
    assert all(isinstance(each, Equilibrium) for each in there), [getattr(each, "reason", "") for each in there]
    forces = [contact_forces(at, each.state).on["o0"][1] for at, each in zip(steps, there, strict=True)]
    assert forces[0] == 0.0 < forces[1] < forces[2] and forces[3] == pytest.approx(forces[1], rel=1e-6)
    assert all((at.X + each.u)[:, 1].max() < 10.5 - by for at, each, by in zip(steps, there, moved, strict=True))
    # Where it is does not depend on how it came there, and of two obstacles the second may be the one that moves.
    placed = replace(SHAPES["plane"], point=np.array([0, 8.0, 0]))
    assert found(loaded(ring(placed, own=False), 0.002), start=there[2].state).u == pytest.approx(there[2].u, abs=1e-6)
    far = replace(SHAPES["sphere"], center=np.array([0.0, 0.0, 60.0]))
    both = loaded(ring(far, SHAPES["plane"], own=False), 0.002, o1=(0.0, -2.5, 0.0))
    assert found(both).u == pytest.approx(there[2].u, abs=1e-6)


def test_an_obstacle_that_turns_presses_as_one_that_is_there():
    """A plane turns about a point beside the ring, until it has pressed the ring down."""
    flap = replace(SHAPES["plane"], point=np.array([40.0, 10.5, 0.0]))
    model, angle = ring(flap, own=False), 0.06
    at = loaded(model, 0.002, o0=(0.0, 0.0, 0.0, 0.0, 0.0, angle))
    there = found(at)
    forces = contact_forces(at, there.state).on["o0"]
    normal = np.array([np.sin(angle), -np.cos(angle), 0.0])
    assert -forces == pytest.approx(np.linalg.norm(forces) * normal, abs=1e-6) and forces[1] > 1e-3
    made = found(loaded(ring(replace(flap, normal=normal), own=False), 0.002), start=there.state)
    assert made.u == pytest.approx(there.u, abs=1e-6)


def test_an_obstacle_with_triangles_moves_with_them():
    """A ball is pressed into the ring: its guard is where it is."""
    model = ring(SHAPES["sphere"], own=False)
    at = loaded(model, 0.0, o0=(0.0, 2.5, 0.0))
    there = found(at)
    x = at.X + there.u
    moved = replace(SHAPES["sphere"], center=SHAPES["sphere"].center + np.array([0.0, 2.5, 0.0]))
    places = np.concatenate([x, flat_triangles(x).mean(axis=1)])
    assert 0.0 < np.asarray(moved.distance(places)).min() < ACTIVATION
    force = contact_forces(at, there.state).on["o0"]
    _, residual = kernels.value_and_residual(model.potential, at.X, there.state, at.loads)
    held = np.where(model.supports, residual.u, 0.0).sum(axis=0)
    assert held[:2] == pytest.approx(force[:2], abs=1e-7) and force[1] < -1e-3


def test_a_body_that_is_moved_while_it_touches():
    """From one shape to another nothing meets on the way, and the end is that of a search from rest."""
    model = ring(SHAPES["plane"], own=False)
    before = loaded(model, 0.04)
    first = found(before)
    gap = 10.5 - (before.X + first.u)[:, 1].max()
    # Where the old displacements would lead through the plane.
    after = loaded(model, 0.04, before.X + np.array([0.0, 2.0 * gap, 0.0]))
    moved = solve(after, Tangent(model), first.state, since=(before, first.state))
    assert isinstance(moved, Equilibrium), moved.reason
    assert moved.u == pytest.approx(found(after).u, abs=1e-6)


def test_a_shortened_step_is_never_nothing():
    # The shorter way is checked again; rounding must not make it seem too long each time.
    highest = MESH.points[:, 1].max()
    model = ring(replace(SHAPES["plane"], point=np.array([0, highest + 2e-4, 0])), own=False)
    at, rng = loaded(model, 0.0), np.random.default_rng(3)
    start = np.zeros(model.size)
    for _ in range(300):
        u = rng.standard_normal((len(MESH.points), 3)) * 0.1
        u[:, 1] += rng.uniform(0.01, 1.0)
        step = model.vector(model.state(start)._replace(u=u))
        assert 0.0 < free_share(at, start, step) < 1.0


@given(arrays(np.int64, st.tuples(st.integers(0, 30), st.integers(2, 3)), elements=st.integers(-1, 3)))
def test_distinct_rows_are_those_of_numpy(rows):
    _, first, number = np.unique(rows, axis=0, return_index=True, return_inverse=True)
    found = _distinct(rows)
    assert np.array_equal(found[0], first) and np.array_equal(found[1], number.ravel())
