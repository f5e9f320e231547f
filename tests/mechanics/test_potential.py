"""The potential's derivatives, invariances and conservation."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from loaded import loaded_tube
from scipy import sparse

from pneumorph.mechanics import Tangent, build_loads, build_model, configure, neo_hookean_rubber, rest, solve
from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.hessian import tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.plate import rotation, rotation_vector
from pneumorph.mechanics.elements.sums import summed, volumes
from pneumorph.verify.solids import tube, with_lids

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)


@pytest.fixture(scope="module")
def loaded():
    """A short tube under everything at once, at a state that is no equilibrium."""
    return loaded_tube(RUBBER)


def test_tangent_is_the_derivative_of_the_residual(loaded):
    built, at, vector = loaded
    data = tangent(built, at.X, built.state(vector), at.loads, at.blocked)
    sparsity = built.sparsity
    upper = sparse.csr_array((data, sparsity.indices, sparsity.indptr), shape=(built.size, built.size))
    direction = np.where(built.fixed, 0.0, np.random.default_rng(1).standard_normal(built.size))
    by_matrix = upper @ direction + sparse.triu(upper, 1).T @ direction
    arguments = (built.potential, at.X)
    product = products.tangent_product(*arguments, built.state(vector), at.loads, built.state(direction))
    expected = np.where(built.fixed, 0.0, built.vector(product))
    assert np.abs(by_matrix - expected).max() < 1e-10 * np.abs(expected).max()

    def residual(v):
        return built.vector(kernels.value_and_residual(*arguments, built.state(v), at.loads)[1])

    h = 1e-6
    difference = (residual(vector + h * direction) - residual(vector - h * direction)) / (2 * h)
    assert np.abs(difference - built.vector(product)).max() < 1e-6 * np.abs(expected).max()


def test_a_rigid_motion_costs_nothing():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER, plate=False)
    turn = np.asarray(rotation(jnp.array([0.4, -1.1, 2.0])))
    u = mesh.points @ turn.T + np.array([3.0, -2.0, 5.0]) - mesh.points
    at = configure(built, mesh.points, build_loads(built, {}))
    state = State(u, np.zeros(6))
    value, residual = kernels.value_and_residual(built.potential, at.X, state, at.loads)
    assert abs(value) < 1e-9
    assert np.abs(np.asarray(residual.u)).max() < 1e-10
    assert built.elements == len(mesh.tets)


def test_chamber_volume_of_a_deformed_bore():
    mesh, _ = with_lids(tube(4, 8, 20, (1, 16, 4)), 20)
    built = build_model(mesh, RUBBER, plate=False)
    stretched = mesh.points * np.array([1.1, 1.1, 1.3]) + np.array([5.0, -3.0, 7.0])
    volume = summed(volumes, built.cavities, mesh.points, stretched - mesh.points)[0]
    assert float(volume) == pytest.approx(np.pi * 4.4**2 * 26, rel=1e-3)


def test_work_of_the_pressure_becomes_stored_energy():
    mesh = tube(4, 6, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    solver, state = Tangent(built), rest(built)
    pressures = np.linspace(0, 0.05, 21)
    volumes, energies = [], []
    for pressure in pressures:
        at = configure(built, mesh.points, build_loads(built, {"A": pressure}))
        found = solve(at, solver, state)
        state = found.state
        volumes.append(found.volumes["A"])
        free = configure(built, mesh.points, build_loads(built, {}))
        energies.append(float(kernels.total(built.potential, free.X, state, free.loads)))
    work = np.trapezoid(pressures, volumes)
    assert energies[-1] - energies[0] == pytest.approx(work, rel=1e-3)


def test_spring_and_force_balance_on_the_plate():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    axial = np.array([False, False, True, False, False, False])
    acting = build_loads(built, {"A": 0.05})
    blocked = solve(configure(built, mesh.points, acting, axial), Tangent(built))
    assert blocked.plate[2] == 0.0
    # Pushing back with what the block carried leaves the plate where the block held it.
    wrench = np.array([0, 0, -blocked.reaction[2], 0, 0, 0])
    pushed = solve(configure(built, mesh.points, build_loads(built, {"A": 0.05}, wrench=wrench)), Tangent(built))
    assert abs(pushed.plate[2]) < 1e-7


@settings(max_examples=30)
@given(st.lists(st.floats(-3.5, 3.5), min_size=3, max_size=3))
def test_rotations_are_rotations(theta):
    R = np.asarray(rotation(jnp.array(theta)))
    assert np.abs(R @ R.T - np.eye(3)).max() < 1e-13
    assert np.linalg.det(R) == pytest.approx(1.0)
    assert np.abs(np.asarray(rotation(jnp.array(rotation_vector(R)))) - R).max() < 1e-7


def test_rotation_is_smooth_at_rest():
    slope = jax.jacfwd(rotation)(jnp.zeros(3))
    curvature = jax.jacfwd(jax.jacfwd(rotation))(jnp.zeros(3))
    assert np.isfinite(np.asarray(curvature)).all()
    assert np.asarray(slope)[2, 1, 0] == 1.0


def test_a_guided_plate_moves_along_the_axis_alone():
    mesh = tube(4, 8, 20, (1, 8, 4))
    built = build_model(mesh, RUBBER)
    guided = np.array([True, True, False, True, True, False])
    pulled = build_loads(built, {"A": 0.05}, wrench=np.array([0.3, 0, 0, 0, 2.0, 1.0]))
    found = solve(configure(built, mesh.points, pulled, guided), Tangent(built))
    assert np.all(found.plate[guided] == 0)
    assert found.plate[5] > 0
    assert found.reaction[0] == pytest.approx(0.3, abs=0.02)
    assert np.all(found.reaction[~guided] == 0)
