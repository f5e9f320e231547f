"""Obstacles that are free: what carries them, what moves them, and what says that nothing holds them."""

from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest

from pneumorph.mechanics import Equilibrium, Tangent, build_loads, build_model, configure, neo_hookean_rubber, solve
from pneumorph.mechanics.contact.barrier import barrier_derivatives
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.free import Free
from pneumorph.mechanics.contact.implicit import Implicit
from pneumorph.mechanics.contact.pairs import Pairs
from pneumorph.mechanics.contact.samples import surface_of
from pneumorph.mechanics.contact.shapes import Box, Plane, Sphere
from pneumorph.mechanics.solve.forces import contact_forces
from pneumorph.objective import Objective
from pneumorph.objective.kinds import pose, press
from pneumorph.objective.kinds.kind import Scope
from pneumorph.problem import Press, TargetPose
from pneumorph.sensitivity import gradient
from pneumorph.verify.solids import tube

MESH = tube(2, 6, 4, (2, 8, 1))
SURFACE = surface_of(MESH)
ACTIVATION, STIFFNESS, GRAVITY = 0.3, 0.1, 9810.0
BALL = Sphere(np.array([0.3, 0.0, 7.6]), 3.5)
BLOCK = Box(np.array([20.0, 1.0, -3.5]), np.array([2.0, 1.5, 1.0]))
FLOOR = Plane(np.array([0.0, 0.0, -5.0]), np.array([0.0, 0.0, 1.0]))
NONE = np.zeros(6, bool)


def stood(shape, mass, held=NONE, spring=0.0, floor=None, acceleration=GRAVITY, inflated=0.0, X=MESH.points):
    """A short tube on its end, with a free obstacle over it or beside it."""
    mesh = shape.mesh(ACTIVATION / 4)
    points, area, radius = shape.support(ACTIVATION / 4, ACTIVATION)
    springs = np.broadcast_to(np.asarray(spring, dtype=float), 6)
    free = Free(mass, springs, held, np.zeros(3), shape.spin(STIFFNESS), points, area, radius)
    fixed = {} if floor is None else {"floor": Implicit(SURFACE, floor, ACTIVATION, STIFFNESS)}
    obstacles = {**fixed, "it": Implicit(SURFACE, shape, ACTIVATION, STIFFNESS)}
    guards = {"it": Pairs(SURFACE, MESH.points, False, [mesh], ACTIVATION / 4, STIFFNESS)}
    supports = np.broadcast_to(MESH.points[:, 2:] == 0.0, MESH.points.shape)
    model = build_model(
        MESH,
        neo_hookean_rubber(STIFFNESS, 1.0, 1e-12),
        plate=False,
        supports=supports,
        contact=Contact(SURFACE, obstacles, guards, None, {"it": free}),
    )
    acting = build_loads(model, {"A": inflated}, acceleration=np.array([0.0, 0.0, -acceleration]))
    return configure(model, X, acting)


@pytest.fixture(scope="module")
def resting():
    """A ball on the end of the tube, beside whose axis it begins."""
    at = stood(BALL, 5e-6)
    tangent = Tangent(at.model)
    found = solve(at, tangent)
    assert isinstance(found, Equilibrium), found.reason
    return at, tangent, found


def test_a_ball_rests_with_its_weight_on_the_body(resting):
    at, _, found = resting
    weight = 5e-6 * GRAVITY
    touched = contact_forces(at, found.state)
    assert touched.on["it"] == pytest.approx([0.0, 0.0, weight], abs=1e-7 * weight) and found.stable
    # It has rolled to the middle, and lies on the edge of the hole, 2 mm from the axis, less than its gap below.
    x, y, z, *turn = found.state.objects[0]
    assert [x, y, *turn] == pytest.approx([-0.3, 0.0, 0.0, 0.0, 0.0], abs=1e-6)
    assert 4.0 + np.sqrt(3.5**2 - 2.0**2) - 0.2 < 7.6 + z < 4.0 + np.sqrt((3.5 + ACTIVATION) ** 2 - 2.0**2)
    # A ball has no moment about its centre, wherever it is pressed; and the edge presses it from all sides.
    assert touched.normal["it"] > 1.05 * weight


@pytest.mark.parametrize("pressed", [False, True])
def test_gradients_through_touch_are_exact(resting, pressed):
    """Of the pose and of the force, by the places of the nodes and by the pressure."""
    at, tangent, found = resting
    asked = TargetPose.model_validate({"kind": "pose", "obstacle": "it", "z": "1 mm", "turn_y": "2 deg"})
    scope = Scope("task[0].objective", 1.0, np.zeros(3), obstacles=("it",))
    objective = pose.build(asked, scope)
    if pressed:
        objective = press.build(Press(kind="press", obstacle="it", direction=(0.3, 0.0, 1.0)), scope)
        objective = replace(objective, value=lambda f: f.contact["it"].normal + f.pose["it"][0] * f.pose["it"][2])
    exact = gradient(at, tangent, found, objective)
    rng = np.random.default_rng(2)
    dX = rng.uniform(-1.0, 1.0, MESH.points.shape) * (MESH.points[:, 2:] > 0.0)
    for along, dp in ((dX, 0.0), (np.zeros(dX.shape), 0.002)):
        slope = float(np.sum(exact.X * along) + dp * exact.pressure["A"])
        steps, remainders = 0.02 * 0.5 ** np.arange(4), []
        if dp:
            steps = 0.5 ** np.arange(4)
        for step in steps:
            there = replace(at, X=MESH.points + step * along)
            there = replace(there, loads=at.loads._replace(pressure=at.loads.pressure + step * dp))
            moved = solve(there, Tangent(at.model), found.state, tolerance=1e-11)
            assert isinstance(moved, Equilibrium)
            value = objective.at(at.model, there.X, moved.state)
            remainders.append(abs(value - exact.value - step * slope))
        rates = np.log2(np.array(remainders[:-1]) / np.array(remainders[1:]))
        assert slope != 0.0 and abs(np.median(rates) - 2.0) < 0.1, (rates, remainders)


def test_a_block_stands_on_a_floor():
    """It is carried at its corners; nothing keeps it from sliding, so that is held."""
    at = stood(BLOCK, 2e-6, held=np.array([1, 1, 0, 0, 0, 1], bool), floor=FLOOR)
    found = solve(at, Tangent(at.model))
    assert isinstance(found, Equilibrium), found.reason
    gap = 0.5 + found.state.objects[0, 2]
    area = 2.0 * (4 * 3 + 4 * 2 + 3 * 2)
    corners = BLOCK.support(0.1, ACTIVATION).area
    assert corners.sum() == pytest.approx(area)
    low = BLOCK.mesh(0.1).points[:, 2] < -3.5
    expected = -corners[low].sum() * barrier_derivatives(np.array([gap]), ACTIVATION, STIFFNESS)[1][0]
    # Corners whose areas differ tilt it a little.
    assert expected == pytest.approx(2e-6 * GRAVITY, rel=0.02)
    assert found.state.objects[0, [0, 1, 5]].tolist() == [0, 0, 0]
    assert np.abs(found.state.objects[0, 3:5]).max() < 0.05


def test_a_spring_carries_a_ball_that_touches_nothing():
    at = stood(replace(BALL, center=np.array([0.0, 0.0, 20.0])), 5e-6, spring=[1.0, 1.0, 0.1, 0.0, 0.0, 0.0])
    found = solve(at, Tangent(at.model))
    assert isinstance(found, Equilibrium), found.reason
    assert found.state.objects[0] == pytest.approx([0, 0, -5e-6 * GRAVITY / 0.1, 0, 0, 0], abs=1e-9)


@pytest.mark.parametrize(
    "shape, acceleration, floor", [(BALL, 0.0, None), (BALL, -GRAVITY, None), (BLOCK, GRAVITY, FLOOR)]
)
def test_what_nothing_holds_is_named(shape, acceleration, floor):
    """A ball without weight in the air, one that falls away, a block that may slide on a floor."""
    at = stood(shape, 5e-6, acceleration=acceleration, floor=floor)
    found = solve(at, Tangent(at.model))
    assert not isinstance(found, Equilibrium)
    assert 'obstacle "it" is free, but nothing holds it' in found.reason and "\n" not in found.reason


def test_the_middle_of_a_body_is_that_of_its_volume():
    assert BLOCK.mesh(0.1).middle() == pytest.approx(BLOCK.center)
    assert BALL.mesh(0.3).middle() == pytest.approx(BALL.center, abs=0.02)


def test_features_have_the_pose(resting):
    at, _, found = resting
    height = Objective(lambda f: jnp.sum(f.pose["it"][2]))
    assert height.at(at.model, at.X, found.state) == pytest.approx(found.state.objects[0, 2])
