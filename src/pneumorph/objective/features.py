"""Features of an equilibrium: motion of the end-effector, of sections and of chambers, differentiable by JAX."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.assembly import sums
from pneumorph.mechanics.assembly.element import (
    TET_N,
    TET_WEIGHT,
    TRIANGLE_N,
    TRIANGLE_WEIGHTS,
    reference_gradients,
    triangle_points,
)
from pneumorph.mechanics.assembly.kinematics import State
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.potential import displacement, pulled_to_unknowns
from pneumorph.mechanics.assembly.terms import Connectivity, Values
from pneumorph.mechanics.assembly.tip import tip_centre
from pneumorph.mechanics.material.energies import determinant
from pneumorph.objective.rotations import continued_logarithm, polar_rotation


class Features(NamedTuple):
    """What objectives are functions of; all of the whole body, where the model is half of one too.

    Attributes
    ----------
    translation : (3,) mm, of the end-effector.
    rotation : (3,) rad, its rotation vector.
    volume : {chamber: mm³} of the inflated chambers.
    section_position : (S, 3) mm, the centres of sections at equal distances, where they have gone.
    section_rotation : (S, 3, 3), how each has turned since the undeformed state.
    """

    translation: Array
    rotation: Array
    volume: dict[str, Array]
    section_position: Array
    section_rotation: Array


class Slabs(NamedTuple):
    """Sections of finite thickness: (S,) heights of their middles in the undeformed body and half the thickness, mm."""

    middle: np.ndarray
    half: float


SECTIONS_TO_TIP = 12
"""Sections that count the turns of a free tip: each turns by less than half a turn against the next."""

NO_SLABS = Slabs(np.zeros(0), 1.0)


def equidistant(count: int, length: float) -> Slabs:
    """The middles of so many equal parts of a body of this length (mm), each as thick as its part."""
    half = length / (2 * max(count, 1))
    return Slabs(half * (2 * np.arange(count) + 1), half)


class ElementSums(NamedTuple):
    """The numbers of a state that features are functions of: the plate's, and sums over elements.

    Moments (…, 16) are Σw, Σw (X − o), Σw x and Σw x ⊗ (X − o) of weights w and an origin o.

    Attributes
    ----------
    plate : (6,) mm and rad.
    volume : (C,) mm³, of what of the chambers is in the model.
    sections : (S, 16) moments of the slabs, each about its middle on the axis.
    face : (16,) moments of a free tip about its centroid, which is taken from x too.
    below : (SECTIONS_TO_TIP, 16) moments of slabs below a free tip.
    """

    plate: Values
    volume: Values
    sections: Values
    face: Values
    below: Values


class ModelTraits(NamedTuple):
    """What decides how features are made of measures; hashable.

    Attributes
    ----------
    chambers : names.
    copies : how often the model is in the whole body.
    plate : whether the tip has one.
    even : (3,) 1, but 0 for the component across a mirror plane.
    """

    chambers: tuple[str, ...]
    copies: int
    plate: bool
    even: tuple[float, ...]


def traits_of(model: Model) -> ModelTraits:
    """The kind of a model."""
    return ModelTraits(model.chambers, model.copies, model.plate, tuple(map(float, model.tip.even)))


def measure_features(model: Model, X: np.ndarray, state: State, slabs: Slabs = NO_SLABS) -> Features:
    """Features of a state on nodes X (N, 3).

    With a plate the motion is its own. A free tip has the area mean of the displacement as its translation, and as its
    rotation the polar factor of its mean deformation; the sections below it tell how often it has turned round.
    """
    return features_of(traits_of(model), element_sums(model, X, state, slabs))


def element_sums(model: Model, X: np.ndarray, state: State, slabs: Slabs = NO_SLABS) -> ElementSums:
    """The measures of a state on nodes X (N, 3)."""
    u = displacement(model.tip, X, state)
    face, below = np.zeros(16), np.zeros((0, 16))
    if not model.plate:
        centre = tip_centre(model.tip, X, X)
        face = sums.summed(_face_moments, model.face, X, u, centre)
        below = _moments(model, X, u, equidistant(SECTIONS_TO_TIP, float(centre[2])))
    volume = sums.summed(sums.volumes, model.cavities, X, u)
    return ElementSums(np.asarray(state.plate), volume, _moments(model, X, u, slabs), face, below)


def sums_pulled_back(
    model: Model, X: np.ndarray, state: State, slabs: Slabs, cotangents: ElementSums
) -> tuple[np.ndarray, list[State]]:
    """Derivatives by X (k, N, 3) and by the unknowns of cotangents·measures, for k cotangents at once."""
    u = displacement(model.tip, X, state)
    by_X, by_u = np.zeros((2, len(cotangents.plate), *X.shape))
    parts: list[tuple[sums.Measure, Connectivity, np.ndarray, tuple]]
    parts = [(sums.volumes, model.cavities, cotangents.volume, ())]
    if len(slabs.middle):
        parts.append((_slab_moments, model.tets, cotangents.sections, (slabs.middle, slabs.half)))
    if not model.plate:
        parts.append((_face_moments, model.face, cotangents.face, (tip_centre(model.tip, X, X),)))
    for function, seen, bars, given in parts:
        if np.any(bars):
            one, other = sums.pulled_back(function, seen, X, u, bars, *given)
            by_X, by_u = by_X + one, by_u + other
    states = []
    for number, plate in enumerate(cotangents.plate):
        by_state, by_tip = pulled_to_unknowns(model.tip, X, state, by_u[number])
        states.append(by_state._replace(plate=by_state.plate + plate))
        by_X[number] += by_tip
    return by_X, states


@partial(jax.jit, static_argnums=0)
def features_of(traits: ModelTraits, at: ElementSums) -> Features:
    """The features as functions of the measures."""
    volume = dict(zip(traits.chambers, traits.copies * jnp.asarray(at.volume), strict=True))
    even = jnp.asarray(traits.even)
    position, _, rotation = _fitted(even, at.sections)
    if traits.plate:
        plate = jnp.asarray(at.plate)
        return Features(plate[:3], plate[3:], volume, position, rotation)
    moved, place, turned = _fitted(even, jnp.asarray(at.face)[None])
    _, _, below = _fitted(even, jax.lax.stop_gradient(at.below))
    return Features((moved - place)[0], continued_logarithm(turned[0], below), volume, position, rotation)


def _fitted(even: Array, moments: Array) -> tuple[Array, Array, Array]:
    """Means of x and of X (…, 3), and the rotations (…, 3, 3): the polar factors of Σ w (x − x̄) ⊗ (X − X̄)."""
    parity = 2 * even - 1
    # 1 for products of components that a mirror leaves, 0 for those that cancel over the whole body.
    pairs = (1 + parity[:, None] * parity) / 2

    def one(moments: Array) -> tuple[Array, Array, Array]:
        X, x, products = moments[1:4] / moments[0], moments[4:7] / moments[0], moments[7:].reshape(3, 3) / moments[0]
        return even * x, even * X, polar_rotation((products - jnp.outer(even * x, even * X)) * pairs)

    if not len(moments):
        return jnp.zeros((0, 3)), jnp.zeros((0, 3)), jnp.zeros((0, 3, 3))
    return jax.vmap(one)(jnp.asarray(moments))


def _moments(model: Model, X: np.ndarray, u: np.ndarray, slabs: Slabs) -> np.ndarray:
    """Moments (S, 16) of slabs."""
    if not len(slabs.middle):
        return np.zeros((0, 16))
    return sums.summed(_slab_moments, model.tets, X, u, slabs.middle, slabs.half)


def _slab_moments(X: Values, u: Values, data: Values, weight: Values, middles: Values, half: Values) -> Array:
    """Moments (S, 16) of slabs over the undeformed volume of tetrahedra.

    Every slab is weighted by cos² of the distance from its middle: where the geometry moves nodes in and out of a slab
    means change smoothly.
    """
    measure = (TET_WEIGHT * determinant(reference_gradients(X)) * weight).T
    place = jnp.einsum("ga,eai->egi", TET_N, X)
    moved = place + jnp.einsum("ga,eai->egi", TET_N, u)

    def slab(middle: Array) -> Array:
        away = jnp.clip((place[..., 2] - middle) / half, -1.0, 1.0)
        share = measure * jnp.cos(jnp.pi / 2 * away) ** 2
        return _weighed(share, place - middle * jnp.array([0.0, 0.0, 1.0]), moved)

    return jax.vmap(slab)(jnp.asarray(middles))


def _face_moments(X: Values, u: Values, data: Values, weight: Values, origin: Values) -> Array:
    """Moments (16,) of triangles about an origin, which is taken from x too."""
    _, normal = triangle_points(X)
    share = weight[:, None] * (jnp.asarray(TRIANGLE_WEIGHTS)[:, None] * jnp.sqrt(jnp.sum(normal**2, axis=0))).T
    place = jnp.einsum("ga,eai->egi", TRIANGLE_N, X) - origin
    return _weighed(share, place, place + jnp.einsum("ga,eai->egi", TRIANGLE_N, u))


def _weighed(share: Array, X: Array, x: Array) -> Array:
    """The moments of points X and x (E, q, 3) with their weights (E, q)."""
    products = jnp.einsum("eg,egi,egj->ij", share, x, X)
    first = (jnp.einsum("eg,egi->i", share, points) for points in (X, x))
    return jnp.concatenate([jnp.sum(share)[None], *first, products.ravel()])
