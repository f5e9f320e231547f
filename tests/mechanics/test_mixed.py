"""Mixed elements: no locking, the tangent and its inertia, and the way down from unstable states."""

import numpy as np
import pytest
from loaded import loaded_tube
from scipy import sparse
from scipy.special import ellipe, ellipk

from pneumorph.mechanics import (
    Equilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
    rest,
    restored,
    solve,
)
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.hessian import tangent
from pneumorph.mechanics.assembly.linear import SuperLU
from pneumorph.mechanics.assembly.tangent import Origin
from pneumorph.mechanics.setup import MIXED_FROM, asks_for_mixed
from pneumorph.verify.incompressible import radius_at, sphere_pressure, tube_pressure
from pneumorph.verify.solids import octant, tube, with_lids

SHEAR = 0.49


def of_ratio(ratio):
    """A rubber whose bulk modulus is so many times its shear modulus."""
    return neo_hookean_rubber(SHEAR, ratio * SHEAR, 1.1e-9)


def inflated(mesh, supports, pressure, ratio, mixed=True):
    built = build_model(mesh, of_ratio(ratio), plate=False, supports=supports, mixed=mixed)
    found = solve(configure(built, mesh.points, build_loads(built, {"A": pressure})), Tangent(built))
    assert isinstance(found, Equilibrium)
    assert found.residual <= 1e-9
    assert found.stable
    return found


def radial(mesh, u, radius, axes):
    distance = np.linalg.norm(mesh.points[:, axes], axis=1)
    on = np.abs(distance - radius) < 1e-6
    return (np.sum(u[on][:, axes] * mesh.points[on][:, axes], axis=1) / radius).mean()


def quarter_tube():
    mesh, lids = with_lids(tube(4, 8, 2, (2, 12, 1)), 2)
    supports = np.zeros((len(mesh.points), 3), bool)
    supports[:, 2] = supports[lids] = True
    supports[np.abs(mesh.points[:, 1]) < 1e-9, 1] = True
    supports[np.abs(mesh.points[:, 0]) < 1e-9, 0] = True
    return mesh, supports


def plane_strain_tube(ratio, mixed):
    mesh, supports = quarter_tube()
    u = inflated(mesh, supports, 0.10, ratio, mixed).u
    return radial(mesh, u, 4, [0, 1]), radial(mesh, u, 8, [0, 1])


def test_incompressible_tube_with_two_elements_through_its_wall():
    a = radius_at(0.10 / SHEAR, tube_pressure, 4, 8)
    inner, outer = plane_strain_tube(1e5, mixed=True)
    assert inner == pytest.approx(a - 4, rel=1e-3)
    assert outer == pytest.approx(np.sqrt(64 + a**2 - 16) - 8, rel=1e-3)
    # What plain elements make of it is why they are not taken.
    locked, _ = plane_strain_tube(1e5, mixed=False)
    assert locked < 0.98 * (a - 4)


def test_a_load_step_begins_from_a_prediction_that_keeps_volumes():
    """Where κ/μ is large, displacements alone are a start from which plain elements take dozens of factorisations."""
    mesh, supports = quarter_tube()
    assert inflated(mesh, supports, 0.10, 1e5, mixed=False).factorisations <= 8


def test_incompressible_sphere_with_two_elements_through_its_wall():
    mesh = octant(10, 12, (2, 4, 4))
    a = radius_at(0.02 / SHEAR, sphere_pressure, 10, 12)
    u = inflated(mesh, np.abs(mesh.points) < 1e-9, 0.02, 1e5).u
    assert radial(mesh, u, 10, [0, 1, 2]) == pytest.approx(a - 10, rel=5e-4)
    assert radial(mesh, u, 12, [0, 1, 2]) == pytest.approx(np.cbrt(12**3 + a**3 - 1000) - 12, rel=5e-4)


def test_a_compressible_sphere_is_the_same_to_both_elements():
    mesh = octant(10, 12, (2, 4, 4))
    u = inflated(mesh, np.abs(mesh.points) < 1e-9, 0.02, 4.80 / 0.49).u
    assert radial(mesh, u, 10, [0, 1, 2]) == pytest.approx(0.28719543, rel=5e-4)
    assert radial(mesh, u, 12, [0, 1, 2]) == pytest.approx(0.21189583, rel=5e-4)


def test_the_rubber_decides_from_its_moduli():
    assert not asks_for_mixed(neo_hookean_rubber(0.49, 4.80, 1.1e-9))
    assert asks_for_mixed(of_ratio(MIXED_FROM))


@pytest.fixture(scope="module")
def loaded():
    """A short tube of mixed elements under everything at once, at a state that is no equilibrium."""
    return loaded_tube(of_ratio(1e5), mixed=True)


def full_matrix(built, data):
    sparsity = built.sparsity
    upper = sparse.csr_array((data, sparsity.indices, sparsity.indptr), shape=(built.size, built.size))
    return upper + sparse.triu(upper, 1).T


def test_tangent_is_the_derivative_of_the_residual(loaded):
    built, at, vector = loaded
    direction = np.where(built.fixed, 0.0, np.random.default_rng(1).standard_normal(built.size))
    by_matrix = full_matrix(built, tangent(built, at.X, built.state(vector), at.loads, at.blocked)) @ direction
    product = products.tangent_product(built.potential, at.X, built.state(vector), at.loads, built.state(direction))
    expected = np.where(built.fixed, 0.0, built.vector(product))
    assert np.abs(by_matrix - expected).max() < 1e-10 * np.abs(expected).max()
    assert np.abs(expected[built.hydrostatic_unknowns]).max() > 0


def test_state_and_vector_are_the_same(loaded):
    built, _, vector = loaded
    assert np.array_equal(built.vector(built.state(vector)), vector)
    assert built.size == 3 * len(built.independent) + built.hydrostatics + 6


def test_pivots_beyond_the_hydrostatic_ones_count_the_unstable_motions(loaded):
    built, at, _ = loaded
    data = tangent(built, at.X, rest(built), at.loads, at.blocked)
    # Three motions are made to gain energy.
    data[built.diagonal[[100, 200, built.size - 4]]] -= 1e3
    K = full_matrix(built, data).toarray()
    hydrostatic = np.zeros(built.size, bool)
    hydrostatic[built.hydrostatic_unknowns] = True
    B, M = K[~hydrostatic][:, hydrostatic], K[hydrostatic][:, hydrostatic]
    condensed = K[~hydrostatic][:, ~hydrostatic] - B @ np.linalg.solve(M, B.T)
    best, plain = Tangent(built), SuperLU(built.sparsity.indptr, built.sparsity.indices)
    best.refactorise(data, Origin(at, rest(built), 0.0))
    plain.refactorise(data)
    assert np.count_nonzero(np.linalg.eigvalsh(condensed) < 0) == 3
    assert best.negative_pivots == 3
    assert plain.negative_pivots - built.hydrostatics == 3
    rhs = np.random.default_rng(0).standard_normal(built.size)
    for x in (best.precondition(rhs), plain.solve(rhs)):
        assert np.linalg.norm(K @ x - rhs) < 1e-10 * np.linalg.norm(rhs)


def test_newton_needs_few_factorisations_whatever_the_bulk_modulus():
    mesh = tube(4, 8, 20, (1, 8, 4))
    counts = []
    for ratio in (10, 1e5):
        built = build_model(mesh, of_ratio(ratio), mixed=True)
        solver = Tangent(built)
        found = solve(configure(built, mesh.points, build_loads(built, {"A": 0.08})), solver)
        counts.append(found.factorisations)
        again = solve(configure(built, mesh.points, build_loads(built, {"A": 0.081})), solver, found.state)
        assert again.factorisations <= 2
    assert max(counts) <= 8


def test_a_column_buckles_as_the_elastica_does():
    length, ratio = 90.0, 1e4
    mesh = tube(2, 3, length, (1, 8, 12))
    built = build_model(mesh, of_ratio(ratio), mixed=True)
    young, second = 9 * ratio * SHEAR / (3 * ratio + 1), np.pi / 4 * (3**4 - 2**4)
    # A clamped column whose tip turns by α: k = sin α/2, P = EI (K(k)/L)², height L (2E/K − 1).
    turn = np.radians(110)
    m = np.sin(turn / 2) ** 2
    force = young * second * (ellipk(m) / length) ** 2
    wrench = np.array([0, 0, -force, 0, 0, 0])
    found = solve(configure(built, mesh.points, build_loads(built, {}, wrench=wrench)), Tangent(built))
    assert isinstance(found, Equilibrium)
    assert found.stable
    assert np.linalg.norm(found.plate[3:5]) == pytest.approx(turn, rel=0.02)
    assert length + found.plate[2] == pytest.approx(length * (2 * ellipe(m) / ellipk(m) - 1), abs=0.04 * length)
    deflection = 2 * np.sqrt(m) / ellipk(m) * length
    assert np.linalg.norm(found.plate[:2]) == pytest.approx(deflection, rel=0.02)


def test_a_state_is_restored_from_its_displacements():
    mesh, supports = quarter_tube()
    found = inflated(mesh, supports, 0.10, 1000.0)
    built = build_model(mesh, of_ratio(1000.0), plate=False, supports=supports, mixed=True)
    state = restored(built, mesh.points, found.u, found.state.plate, np.zeros((0, 6)))
    expected = found.state.hydrostatic
    assert np.abs(expected).max() > 0.01
    np.testing.assert_allclose(state.hydrostatic, expected, atol=1e-6 * np.abs(expected).max())
