"""States carried over to another mesh: the tangent with other volume ratios, and what a search from there takes."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from scipy import sparse
from tiny import tiny

from pneumorph.analysis import analyse, build_discretisation, carry_over, discretise, predict_states
from pneumorph.analysis.analyse import mesh_of
from pneumorph.geometry import build_design_space, starting_body
from pneumorph.mechanics import Guess, State, build_loads, build_model, mirrors_of, volume_ratios
from pneumorph.mechanics.assembly.element import tet_energies
from pneumorph.mechanics.assembly.hessian import tangent
from pneumorph.mechanics.material.energies import determinant, neo_hookean, ogden
from pneumorph.mechanics.material.rubber import Rubber
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
    flat = jax.hessian(lambda u: volume(u.reshape(-1, 3)))((MESH.points @ STRAIN.T).ravel())
    assert np.abs(matrix(rubber, ratios) - plain - np.asarray(flat)).max() < 1e-9
    assert np.abs(np.asarray(flat)).max() > 1e-3


def test_volume_ratios_of_a_homogeneous_strain():
    assert volume_ratios(MESH.tets, MESH.points, MESH.points @ STRAIN.T) == pytest.approx(
        np.full((4, len(MESH.tets)), RATIO)
    )


@pytest.mark.parametrize("element", ["quadratic", "mixed"])
def test_a_carried_state_is_found_with_few_factorisations(element):
    """One with the volume ratios of the other mesh or with π, one on the way, and one at the answer."""
    asked = loads(tiny(size=f'"4 mm"\nelement = "{element}"', pressure='{ A = "200 kPa" }'))
    body = starting_body(asked.body)
    space, disc = build_design_space(asked, body), discretise(asked, body)
    found = analyse(asked, space, disc, space.start)
    finer = build_discretisation(asked, mesh_of(asked, body, mirrors_of(asked), 2.5), disc.built_at)
    states = {name: each.state for name, each in found.equilibria.items()}
    starts = carry_over(disc, found.X, states, finer)
    (start,) = starts.values()
    assert (start.ratios is not None) == (element == "quadratic")
    moved = analyse(asked, space, finer, space.start, starts)
    assert moved.value == pytest.approx(found.value, rel=0.1)
    assert moved.equilibria["extend"].factorisations <= 3


def test_a_predicted_state_of_a_nearly_incompressible_rubber_is_found_with_few_factorisations():
    """Without the volume ratios, the volumetric stress of the predicted displacements makes the tangent indefinite."""
    text = tiny(size='"5 mm"\nelement = "quadratic"', pressure='{ A = "20 kPa" }')
    asked = loads(text.replace("Hei-Cast 8400", "Dragon Skin 10"))
    body = starting_body(asked.body)
    space, disc = build_design_space(asked, body), discretise(asked, body)
    moved, took = space.start + 0.3 * np.random.default_rng(0).normal(size=space.n), {}
    for known in (True, False):
        found = analyse(asked, space, disc, space.start)
        guesses = predict_states(space, disc, found, moved)
        starts = guesses if known else {name: Guess(guess.state) for name, guess in guesses.items()}
        took[known] = analyse(asked, space, disc, moved, starts).equilibria["extend"]
    assert took[True].state.u == pytest.approx(took[False].state.u, abs=1e-4)
    assert took[True].factorisations <= 5 < took[False].factorisations
