"""States carried over to another mesh: the tangent with other volume ratios, and what a search from there takes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import sparse
from tiny import tiny

from pneumorph.analysis import analyse, build_discretisation, carry_over, discretise, predict_states
from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.mechanics import (
    Guess,
    State,
    build_loads,
    build_model,
    configure,
    deformation_gradients,
    displacement,
    gradients_after,
    mirrors_of,
)
from pneumorph.mechanics.assembly.hessian import tangent
from pneumorph.mechanics.elements.element import tet_energies
from pneumorph.mechanics.material.energies import determinant, neo_hookean, ogden
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.mechanics.solve.fitting import fitted
from pneumorph.problem import loads
from pneumorph.verify.solids import tube

MESH = tube(4, 6, 10, (1, 6, 1))
STRAIN = np.array([[0.1, 0.05, 0.0], [0.02, -0.15, 0.03], [0.0, -0.04, 0.2]])
RATIO = np.linalg.det(np.eye(3) + STRAIN)
KAPPA = 5.0


def matrix(rubber, ratios):
    """The tangent (n, n) of a free body under a homogeneous strain."""
    model = build_model(MESH, rubber, plate=False, supports=np.zeros(MESH.points.shape, bool), weight=False)
    state, common = State(MESH.points @ STRAIN.T, np.zeros(6)), model.sparsity
    data = tangent(model, MESH.points, state, build_loads(model, {}), np.zeros(6, bool), ratios)
    upper = sparse.csr_array((data, common.indices, common.indptr), shape=(model.size, model.size)).toarray()
    return (upper + np.triu(upper, 1).T)[:-6, :-6]


@pytest.mark.parametrize("isochoric, parameters", [(neo_hookean, (0.5, KAPPA)), (ogden, (0.6, 1.3, KAPPA))])
def test_other_ratios_change_the_volumetric_stress_alone(isochoric, parameters):
    rubber, count = Rubber(isochoric, parameters, 1e-9), len(MESH.tets)
    plain = matrix(rubber, None)
    assert np.abs(matrix(rubber, np.full((4, count), RATIO)) - plain).max() < 1e-9
    ratios = np.random.default_rng(0).uniform(0.9, 1.1, (4, count))

    def volume(u):
        return jnp.sum(tet_energies(X, u[MESH.tets], nothing, dilation, jnp.zeros(0)))

    def dilation(F, hydrostatic, parameters):
        # Weighted with what U' of the ratios has beyond that of the state's own.
        return KAPPA * (ratios - RATIO) * determinant(F)

    X, nothing = jnp.asarray(MESH.points)[MESH.tets], jnp.zeros((count, 4))
    flat = jax.jit(jax.hessian(lambda u: volume(u.reshape(-1, 3))))((MESH.points @ STRAIN.T).ravel())
    assert np.abs(matrix(rubber, ratios) - plain - np.asarray(flat)).max() < 1e-9
    assert np.abs(np.asarray(flat)).max() > 1e-3


def test_what_turns_is_not_stretched():
    """Gradients after a turn to first order: by 0.3 rad they turn, but their stretches stay."""
    u, turn = MESH.points @ STRAIN.T, 0.3 * np.array([[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 0.0]])
    du = (MESH.points + u) @ turn.T
    F = gradients_after(MESH.tets, MESH.points, u, np.zeros_like(u), du)
    before = np.eye(3) + STRAIN
    rotation = np.array([[np.cos(0.3), -np.sin(0.3), 0.0], [np.sin(0.3), np.cos(0.3), 0.0], [0.0, 0.0, 1.0]])
    assert np.abs(F - (rotation @ before)[:, :, None, None]).max() < 1e-4
    assert np.abs(np.linalg.det(before + turn @ before) - RATIO) > 0.05


def test_gradients_follow_nodes_that_move():
    """Nodes that move within a body under a given deformation do not change its gradients where these are uniform."""
    u, dX = MESH.points @ STRAIN.T, 0.05 * np.random.default_rng(0).standard_normal(MESH.points.shape)
    F = gradients_after(MESH.tets, MESH.points, u, dX, dX @ STRAIN.T)
    assert np.abs(F - (np.eye(3) + STRAIN)[:, :, None, None]).max() < 1e-9


def test_displacements_are_fitted_to_gradients():
    """Noise on the nodes goes, also where it turned elements inside out, and the plate goes back to its place."""
    model = build_model(MESH, Rubber(neo_hookean, (0.5, KAPPA), 1e-9), weight=False)
    at, state = configure(model, MESH.points, build_loads(model, {})), State(np.zeros(MESH.points.shape), np.zeros(6))
    exact = np.zeros(MESH.points.shape)
    exact[:, 2] = 0.002 * MESH.points[:, 2] ** 2
    F, noise = (
        deformation_gradients(MESH.tets, MESH.points, exact),
        np.random.default_rng(0).standard_normal(exact.shape),
    )
    rough = model.state(np.where(at.constrained, 0.0, model.vector(state._replace(u=exact + 0.5 * noise))))
    rough = rough._replace(plate=np.array([0.3, 0.0, 0.0, 0.0, 0.02, 0.0]))
    u = displacement(model.tip, MESH.points, fitted(at, rough, F))
    # The plate keeps its face flat, which the exact displacements do as well.
    assert np.abs(u - exact).max() < 0.1 * np.abs(displacement(model.tip, MESH.points, rough) - exact).max()


def carried(text, size):
    """The analysis of a start, and that on a mesh of another size (mm), from the states carried over to it."""
    asked = loads(text)
    body = starting_body(asked.tubes)
    space, disc = build_design_space(asked, body), discretise(asked, body)
    found = analyse(asked, space, disc, space.start)
    finer = build_discretisation(asked, mesh_of(asked, body, mirrors_of(asked), size), disc.built_at)
    states = {name: each.state for name, each in found.equilibria.items()}
    starts = carry_over(disc, found.X, states, finer, finer.morph.mesh.points)
    for start in starts.values():
        assert start.gradients.shape == (3, 3, 4, finer.model.elements)
    return found, analyse(asked, space, finer, space.start, starts)


@pytest.mark.parametrize("element", ["quadratic", "mixed"])
def test_a_carried_state_is_found_with_few_factorisations(element):
    """Since its displacements are fitted to the deformation gradients of the other mesh."""
    found, moved = carried(tiny(size=f'"4 mm"\nelement = "{element}"', pressure='{ A = "200 kPa" }'), 2.5)
    assert moved.value == pytest.approx(found.value, rel=0.1)
    assert moved.equilibria["extend"].factorisations <= 3


def test_a_carried_state_of_a_nearly_incompressible_rubber_is_found_with_few_factorisations():
    """The tangent with the volume ratios of the other mesh is indefinite; without volumetric stress it serves."""
    text = tiny(size='"5 mm"\nelement = "quadratic"', pressure='{ A = "12 kPa" }')
    text = text.replace("Hei-Cast 8400", "Ecoflex 00-30")
    found, moved = carried(text.replace("[end_effector]", "[gravity]\ndirection = [-1, 0, 0]\n[end_effector]"), 4.0)
    assert moved.value == pytest.approx(found.value, rel=0.1)
    assert moved.equilibria["extend"].factorisations <= 8


def test_a_predicted_state_of_a_nearly_incompressible_rubber_is_found_with_few_factorisations():
    """Unless fitted, the volumetric stress of the predicted displacements makes the tangent indefinite."""
    text = tiny(size='"5 mm"\nelement = "quadratic"', pressure='{ A = "40 kPa" }')
    asked = loads(text.replace("Hei-Cast 8400", "Dragon Skin 10"))
    body = starting_body(asked.tubes)
    space, disc = build_design_space(asked, body), discretise(asked, body)
    moved, took = space.start + 0.3 * np.random.default_rng(0).normal(size=space.n), {}
    for known in (True, False):
        found = analyse(asked, space, disc, space.start)
        guesses = predict_states(space, disc, found, moved)
        starts = guesses if known else {name: Guess(guess.state) for name, guess in guesses.items()}
        took[known] = analyse(asked, space, disc, moved, starts).equilibria["extend"]
    assert took[True].state.u == pytest.approx(took[False].state.u, abs=1e-4)
    assert took[True].factorisations <= 5 < took[False].factorisations
