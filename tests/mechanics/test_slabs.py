"""Moments of slabs are those that JAX finds, and so are their derivatives."""

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from pneumorph.mechanics import build_model, neo_hookean_rubber
from pneumorph.mechanics.elements.element import TET_N, TET_WEIGHT, reference_gradients
from pneumorph.mechanics.elements.slabs import slab_moments, slab_moments_pulled_back
from pneumorph.mechanics.material.energies import determinant
from pneumorph.verify.solids import tube

MIDDLES, HALF = np.array([3.0, 9.0, 15.0]), 2.5


def by_jax(X, u, nodes):
    """Σ over the points of the tetrahedra; there is a gap of 1 mm between slabs."""
    measure = (TET_WEIGHT * determinant(reference_gradients(X[nodes]))).T
    place = jnp.einsum("ga,eai->egi", TET_N, X[nodes])
    moved = place + jnp.einsum("ga,eai->egi", TET_N, u[nodes])

    def slab(middle):
        away = jnp.clip((place[..., 2] - middle) / HALF, -1.0, 1.0)
        share = measure * jnp.cos(jnp.pi / 2 * away) ** 2
        relative = place - middle * jnp.array([0.0, 0.0, 1.0])
        first = [jnp.einsum("eg,egi->i", share, points) for points in (relative, moved)]
        products = jnp.einsum("eg,egi,egj->ij", share, moved, relative)
        return jnp.concatenate([jnp.sum(share)[None], *first, products.ravel()])

    return jnp.stack([slab(middle) for middle in MIDDLES])


@pytest.fixture(scope="module")
def body():
    mesh = tube(2, 4, 18, (1, 4, 6))
    model, random = build_model(mesh, neo_hookean_rubber(0.49, 4.80, 1.1e-9)), np.random.default_rng(0)
    X = mesh.points + 0.05 * random.standard_normal(mesh.points.shape)
    return model.tets, X, random.standard_normal(X.shape)


def test_moments_are_those_of_their_definition(body):
    elements, X, u = body
    expected = by_jax(X, u, elements.nodes[: elements.count])
    assert slab_moments(elements, X, u, MIDDLES, HALF) == pytest.approx(np.asarray(expected), rel=1e-11)


def test_derivatives_of_moments_are_those_of_their_definition(body):
    """One of the cotangents is of a single slab, and another is zero."""
    elements, X, u = body
    cotangents = np.random.default_rng(1).standard_normal((3, len(MIDDLES), 16))
    cotangents[1, 1:], cotangents[2] = 0.0, 0.0
    _, back = jax.vjp(lambda X, u: by_jax(X, u, elements.nodes[: elements.count]), X, u)
    expected = jax.vmap(back)(cotangents)
    found = slab_moments_pulled_back(elements, X, u, MIDDLES, HALF, cotangents)
    for one, other in zip(found, expected, strict=True):
        assert np.abs(one).max() > 0.0
        assert one == pytest.approx(np.asarray(other), rel=1e-9, abs=1e-11 * float(np.abs(other).max()))
