"""Every model against closed forms derived here, and what all of them owe: objectivity, exact finite derivatives."""

from functools import cache

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from pneumorph.mechanics import Rubber
from pneumorph.mechanics.elements.element import mixed
from pneumorph.mechanics.elements.stiffness import moduli_by_invariants
from pneumorph.mechanics.material import energies
from pneumorph.mechanics.material.energies import along_parameters
from pneumorph.mechanics.material.homogeneous import nominal_stress
from pneumorph.mechanics.material.rubber import complete

pytestmark = pytest.mark.usefixtures("unoptimised")

BULK = 5.0
# Parameters, the initial shear modulus, and τ_a − τ_b of isochoric stretches (l₁, l₂, l₃) between axes a and b.
MODELS = {
    "neo_hookean": ((0.5,), 0.5),
    "mooney_rivlin": ((0.2, 0.05), 0.5),
    "yeoh": ((0.2, 0.01, 0.001), 0.4),
    "gent": ((0.5, 30.0), 0.5),
    "arruda_boyce": ((0.5, 4.0), None),
    "ogden": ((0.3, 1.7, 0.2, -2.3), 0.5),
}
STATES = {
    "rest": np.eye(3),
    "uniaxial": np.diag([2.0, 2.0**-0.5, 2.0**-0.5]),
    "equibiaxial": np.diag([1.5, 1.5, 1.5**-2]),
    "any": np.array([[1.2, 0.3, -0.1], [0.05, 0.9, 0.2], [0.1, -0.2, 1.1]]),
}
names = pytest.mark.parametrize("name", MODELS)


@cache
def energy_density(name):
    """ψ(F) with its bulk part, compiled once for each shape of F, as its derivatives are."""
    parameters = jnp.array([*MODELS[name][0], BULK])
    return jax.jit(lambda F: complete(getattr(energies, name))(F, parameters))


@cache
def stress_of(name):
    """∂ψ/∂F."""
    return jax.jit(jax.grad(energy_density(name)))


@cache
def stress_with(name):
    """∂ψ/∂F for any parameters."""
    return jax.jit(jax.grad(complete(getattr(energies, name)).function))


@cache
def stress_along(name):
    """What ∂ψ/∂F changes by along parameters (2, m)."""
    return jax.jit(jax.grad(along_parameters(complete(getattr(energies, name))).function))


@cache
def tangent_of(name):
    """∂²ψ/∂F∂F."""
    return jax.jit(jax.jacfwd(stress_of(name)))


def difference(name, stretches, a, b):
    """τ_a − τ_b = l_a ∂ψ/∂l_a − l_b ∂ψ/∂l_b, worked out on paper."""
    p, λ = MODELS[name][0], np.asarray(stretches)
    first = np.sum(λ**2)
    slope = {
        "neo_hookean": lambda: p[0] / 2,
        "mooney_rivlin": lambda: p[0],
        "yeoh": lambda: p[0] + 2 * p[1] * (first - 3) + 3 * p[2] * (first - 3) ** 2,
        "gent": lambda: p[0] / 2 * p[1] / (p[1] - first + 3),
        "arruda_boyce": lambda: (
            p[0] * (1 / 2 + first / 10 / p[1] ** 2 + 11 * first**2 / 350 / p[1] ** 4
                    + 19 * first**3 / 1750 / p[1] ** 6 + 519 * first**4 / 134750 / p[1] ** 8)
        ),
    }  # fmt: skip
    if name == "ogden":
        return sum(2 * p[i] / p[i + 1] * (λ[a] ** p[i + 1] - λ[b] ** p[i + 1]) for i in (0, 2))
    found = 2 * slope[name]() * (λ[a] ** 2 - λ[b] ** 2)
    if name == "mooney_rivlin":
        found -= 2 * p[1] * (λ[a] ** -2 - λ[b] ** -2)
    return found


@names
@pytest.mark.parametrize("stretches", [(2.0, 2.0**-0.5, 2.0**-0.5), (1.5, 1.5, 1.5**-2), (1.8, 1.0, 1 / 1.8)])
def test_uniaxial_equibiaxial_and_planar_stress(name, stretches):
    F = jnp.diag(jnp.array(stretches))
    kirchhoff = np.asarray(stress_of(name)(F)) @ np.asarray(F).T
    assert np.abs(kirchhoff - np.diag(np.diag(kirchhoff))).max() < 1e-12
    for a, b in ((0, 2), (1, 2)):
        expected = difference(name, stretches, a, b)
        assert kirchhoff[a, a] - kirchhoff[b, b] == pytest.approx(expected, rel=1e-10, abs=1e-12)


@names
def test_a_free_bar_that_hardly_changes_its_volume(name):
    parameters = jnp.array([*MODELS[name][0], 1e5])
    stress = jax.jit(jax.grad(lambda F: complete(getattr(energies, name))(F, parameters)))
    across = brentq(lambda c: float(stress(jnp.diag(jnp.array([1.7, c, c])))[1, 1]), 0.7, 0.8, xtol=1e-14)
    pull = float(stress(jnp.diag(jnp.array([1.7, across, across])))[0, 0])
    assert pull == pytest.approx(difference(name, (1.7, 1.7**-0.5, 1.7**-0.5), 0, 2) / 1.7, rel=1e-4)


@names
@settings(max_examples=10, deadline=None)
@given(st.lists(st.floats(-0.3, 0.3), min_size=9, max_size=9), st.lists(st.floats(-3, 3), min_size=3, max_size=3))
def test_turning_before_or_after_changes_nothing(name, entries, axis):
    F = np.eye(3) + np.reshape(entries, (3, 3)) / 2
    spin = np.cross(np.eye(3), axis)
    R = np.asarray(jax.scipy.linalg.expm(jnp.array(spin)))
    psi = energy_density(name)
    here = float(psi(jnp.array(F)))
    assert float(psi(jnp.array(R @ F))) == pytest.approx(here, rel=1e-9, abs=1e-12)
    assert float(psi(jnp.array(F @ R))) == pytest.approx(here, rel=1e-9, abs=1e-12)


@names
def test_initial_shear_modulus(name):
    parameters, shear = MODELS[name]
    if shear is None:
        x = parameters[1] ** -2
        shear = parameters[0] * (1 + 3 * x / 5 + 99 * x**2 / 175 + 513 * x**3 / 875 + 42039 * x**4 / 67375)
    assert Rubber(getattr(energies, name), (*parameters, BULK), 1e-9).shear_modulus == pytest.approx(shear, rel=1e-12)


@names
@pytest.mark.parametrize("state", STATES)
def test_second_derivative_is_symmetric_and_the_first_one_s(name, state):
    F, stress = jnp.array(STATES[state]), stress_of(name)
    tangent = np.asarray(tangent_of(name)(F)).reshape(9, 9)
    assert np.isfinite(tangent).all()
    assert np.abs(tangent - tangent.T).max() < 1e-12 * np.abs(tangent).max()
    direction = np.random.default_rng(0).standard_normal((3, 3))
    expected = (tangent @ direction.ravel()).reshape(3, 3)
    psi = energy_density(name)

    def remainders(h):
        there = F + h * direction
        of_energy = psi(there) - psi(F) - h * jnp.sum(stress(F) * direction) - h**2 / 2 * np.sum(expected * direction)
        return abs(float(of_energy)), float(np.abs(stress(there) - stress(F) - h * expected).max())

    coarse, fine = remainders(2e-3), remainders(1e-3)
    assert coarse[0] / fine[0] > 2**2.7
    assert coarse[1] / fine[1] > 2**1.7


@names
@pytest.mark.parametrize("state", STATES)
def test_stress_by_parameters_is_that_of_the_energy_by_parameters(name, state):
    """Also where principal stretches are equal; the bulk modulus is the last parameter."""
    F, own = jnp.asarray(STATES[state]), np.array([*MODELS[name][0], BULK])
    for unit in np.eye(len(own)):
        stress = stress_along(name)(F, np.stack([own, unit]))
        step = 1e-6 * unit
        ahead, behind = (stress_with(name)(F, own + way * step) for way in (1.0, -1.0))
        np.testing.assert_allclose(stress, (ahead - behind) / 2e-6, atol=2e-8)


@names
def test_points_do_not_see_each_other(name):
    F = np.eye(3)[:, :, None, None] + 0.2 * np.random.default_rng(1).standard_normal((3, 3, 2, 4))
    together = np.asarray(energy_density(name)(jnp.array(F)))
    assert together.shape == (2, 4)
    assert together[1, 2] == pytest.approx(float(energy_density(name)(jnp.array(F[:, :, 1, 2]))), rel=1e-13)


@names
@pytest.mark.parametrize(
    "F", [np.diag([9.0, 5.0, 0.01]), -np.eye(3), np.diag([1.0, 1.0, -0.3]), np.diag([1.0, 1.0, 0.0])]
)
def test_no_state_gives_nan(name, F):
    value, slope = energy_density(name)(jnp.array(F)), stress_of(name)(jnp.array(F))
    assert np.isfinite(value) and np.isfinite(slope).all()


def test_gent_goes_on_smoothly_where_its_logarithm_ends():
    psi = energy_density("gent")
    first = 3 + energies.GENT_END * 30
    end = brentq(lambda s: s**2 + 2 / s - first, 2, 8)
    bar = jax.jit(lambda s: psi(jnp.diag(jnp.stack([s, s**-0.5, s**-0.5]))))
    slope = jax.grad(bar)
    curvature = jax.grad(slope)
    assert float(slope(end + 1e-7)) == pytest.approx(float(slope(end - 1e-7)), rel=1e-4)
    assert float(curvature(end + 1e-9)) == pytest.approx(float(curvature(end - 1e-9)), rel=1e-4)
    assert float(slope(20.0)) > float(slope(end))


@cache
def derivatives(kind, name):
    """First and second derivatives of an energy by the invariants, and its second ones by F, both compiled."""
    energy = kind(getattr(energies, name))
    slopes = jax.grad(energy.of_invariants)
    return jax.jit(lambda at, *rest: (slopes(at, *rest), jax.jacfwd(slopes)(at, *rest))), jax.jit(
        jax.jacfwd(jax.grad(energy))
    )


@names
@pytest.mark.parametrize("shape", STATES)
def test_moduli_by_invariants_are_the_second_derivatives(name, shape):
    """What the tangent uses against 81 derivatives by JAX, for elements with and without a pressure of their own."""
    for kind in (complete, mixed):
        if kind(getattr(energies, name)).of_invariants is None:
            assert name == "ogden"
            continue
        slopes_and_rows, second = derivatives(kind, name)
        rest = (jnp.array(0.07), jnp.array([*MODELS[name][0], BULK]))
        F = jnp.asarray(STATES[shape] + 0.01 * np.arange(9).reshape(3, 3))
        slopes, rows = slopes_and_rows(energies.invariants(F), *rest)
        w = np.concatenate([np.array(slopes), np.array(rows)[np.triu_indices(3)]])
        found = np.empty((9, 9))
        moduli_by_invariants(w, np.asarray(F), np.empty((3, 9)), found)
        expected = second(F, *rest)
        assert found == pytest.approx(np.asarray(expected).reshape(9, 9), abs=1e-12 * float(jnp.abs(expected).max()))


@names
def test_the_short_way_by_stretches_is_the_general_one(name):
    energy, parameters = getattr(energies, name), np.array(MODELS[name][0])
    modes = np.array(["uniaxial", "equibiaxial", "planar"])
    short, general = (
        nominal_stress(asked, parameters, np.array([2.0, 1.5, 1.8]), modes)
        for asked in (energy, energies.Energy(energy.function))
    )
    np.testing.assert_allclose(short, general, rtol=1e-12)
    assert short == pytest.approx(
        [
            difference(name, (2.0, 2.0**-0.5, 2.0**-0.5), 0, 1) / 2.0,
            difference(name, (1.5, 1.5, 1.5**-2), 0, 2) / 1.5,
            difference(name, (1.8, 1.0, 1 / 1.8), 0, 2) / 1.8,
        ],
        rel=1e-12,
    )
