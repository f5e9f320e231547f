"""Features of an equilibrium, differentiable by JAX: motion of the tip and of sections, chamber volumes, contact."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from functools import partial
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.assembly.displacement import Displacement, displacement
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.tip import tip_centre
from pneumorph.mechanics.assembly.volumes import volume_parts, volumes_of
from pneumorph.mechanics.contact import pressing
from pneumorph.mechanics.contact.obstacle import AREA, FORCE, NORMAL
from pneumorph.mechanics.elements import sums
from pneumorph.mechanics.elements.element import (
    TET_WEIGHT,
    TRIANGLE_N,
    TRIANGLE_WEIGHTS,
    reference_gradients,
    triangle_points,
)
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.slabs import slab_moments, slab_moments_pulled_back
from pneumorph.mechanics.elements.terms import Connectivity, Values
from pneumorph.mechanics.material.energies import determinant
from pneumorph.objective.rotations import continued_logarithm, polar_rotation
from pneumorph.symmetry.part import Part, images_of


class Pressing(NamedTuple):
    """What the body presses on an obstacle with.

    Attributes
    ----------
    force : (3,) array
        On the obstacle, N.
    normal : scalar
        Sum of the normal forces, N: forces that oppose each other count too.
    area : scalar
        Of the deformed surface that touches, mm².
    """

    force: Array
    normal: Array
    area: Array


class Features(NamedTuple):
    """The arguments of objectives; they describe the whole body even if the model is a part of it.

    Attributes
    ----------
    translation : (3,) array
        Of the end-effector, mm.
    rotation : (3,) array
        Rotation vector of the end-effector, rad.
    volume : {chamber: scalar}
        Of the inflated chambers, mm³.
    section_position : (S, 3) array
        Centres of equidistant sections in the deformed state, mm.
    section_rotation : (S, 3, 3) array
        Rotation of each section from the undeformed state.
    contact : {obstacle: Pressing}
        What the body presses on every obstacle with.
    pose : {obstacle: (6,) array}
        Displacement (mm) and rotation vector (rad) of every obstacle from its place; what is free moves.
    mass : scalar
        Of the rubber, g.
    """

    translation: Array
    rotation: Array
    volume: dict[str, Array]
    section_position: Array
    section_rotation: Array
    contact: Mapping[str, Pressing] = {}
    pose: Mapping[str, Array] = {}
    mass: Array = np.zeros(())  # pyright: ignore[reportAssignmentType]


class Slabs(NamedTuple):
    """Sections of finite thickness: heights (S,) of their middles in the undeformed body, half the thickness, mm."""

    middle: np.ndarray
    half: float


SECTIONS_TO_TIP = 12
"""Sections used to count the full turns of a free tip: neighbours are rotated by less than half a turn."""

_GRAMS = 1e6
"""Per tonne."""

NO_SLABS = Slabs(np.zeros(0), 1.0)


def equidistant(count: int, length: float) -> Slabs:
    """Slabs that divide a body of the given length (mm) into `count` equal parts."""
    half = length / (2 * max(count, 1))
    return Slabs(half * (2 * np.arange(count) + 1), half)


class ElementSums(NamedTuple):
    """The quantities from which features are computed: the plate's motion, and sums over elements.

    Moments (…, 16) are Σw, Σw (X − o), Σw x and Σw x ⊗ (X − o) with weights w and an origin o.

    Attributes
    ----------
    plate : (6,) array
        Translation in mm and rotation vector in rad.
    volume : (C,) array
        Volumes of the chambers, or of the parts of them that the model contains, mm³.
    sections : (S, 16) array
        Moments of the slabs, each with its middle on the axis as origin.
    face : (16,) array
        Moments of a free tip's face; the origin, its undeformed centroid, is subtracted from x too.
    below : (SECTIONS_TO_TIP, 16) array
        Moments of the slabs below a free tip.
    contact : (K, 5) array
        Of every obstacle, see `pressing.pressed`.
    poses : (K, 6) array
        Of every obstacle.
    mass : scalar
        Of the rubber in the model, g.
    """

    plate: Values
    volume: Values
    sections: Values
    face: Values
    below: Values
    contact: Values
    poses: Values
    mass: Values


class ModelTraits(NamedTuple):
    """Properties of a model that determine how features are computed from element sums; hashable.

    Attributes
    ----------
    chambers : tuple of str
        Names.
    part : Part
        The part of the whole body that is modelled.
    plate : bool
        Whether the tip carries a plate.
    obstacles : tuple of str
        Names.
    """

    chambers: tuple[str, ...]
    part: Part
    plate: bool
    obstacles: tuple[str, ...]


def traits_of(model: Model) -> ModelTraits:
    """The traits of a model."""
    obstacles = () if model.contact is None else tuple(model.contact.obstacles)
    return ModelTraits(model.chambers, model.part, model.plate, obstacles)


def measure_features(
    model: Model, X: np.ndarray, state: State, slabs: Slabs = NO_SLABS, shift: np.ndarray | None = None
) -> Features:
    """Features of a state on nodes X (N, 3) in mm, where obstacles are given the poses shift (K, 6).

    The motion of the end-effector is that of the plate. For a free tip, the translation is the area mean of the
    displacement, and the rotation is the polar factor of the mean deformation; sections below it count full turns.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    slabs : Slabs
        The sections that are wanted.
    shift : (K, 6) array, optional
        Given poses of obstacles, mm and rad; by default all are in their places.
    """
    return features_of(traits_of(model), element_sums(model, X, state, slabs, shift))


def element_sums(
    model: Model, X: np.ndarray, state: State, slabs: Slabs = NO_SLABS, shift: np.ndarray | None = None
) -> ElementSums:
    """The plate's motion and the sums over elements for a state on nodes X (N, 3) in mm.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    slabs : Slabs
        The sections that are wanted.
    shift : (K, 6) array, optional
        Given poses of obstacles, mm and rad.
    """
    u = displacement(model.tip, X, state)
    face, below = np.zeros(16), np.zeros((0, 16))
    if not model.plate:
        centre = tip_centre(model.tip, X, X)
        face = sums.summed(_face_moments, model.face, X, u, centre)
        below = slab_moments(model.tets, X, u, *equidistant(SECTIONS_TO_TIP, float(centre[2])))
    poses = _poses(model, state, shift)
    volume = volumes_of(model, X, u, poses)
    touching = pressing.pressed(model.contact, X + u, poses)
    mass = sum(density * sums.summed(_rubber_volume, part, X, u) for density, part in _rubbers(model))
    sections = slab_moments(model.tets, X, u, *slabs)
    return ElementSums(np.asarray(state.plate), volume, sections, face, below, touching, poses, np.asarray(mass))


def sums_pulled_back(
    model: Model,
    X: np.ndarray,
    state: State,
    slabs: Slabs,
    cotangents: ElementSums,
    shift: np.ndarray | None = None,
) -> tuple[np.ndarray, list[State]]:
    """Derivatives of cotangents·sums with respect to X (k, N, 3) and the unknowns, for k cotangents at once.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    slabs : Slabs
        The sections that are wanted.
    cotangents : ElementSums
        Each with k in front of its shape.
    shift : (K, 6) array, optional
        Given poses of obstacles, mm and rad.
    """
    nodes = Displacement(model.tip, X, state)
    u = nodes.u
    by_X, by_u = np.zeros((2, len(cotangents.plate), *X.shape))
    poses = _poses(model, state, shift)
    parts: list[tuple[sums.Measure, Connectivity, np.ndarray, tuple]]
    parts = [(measure, part, cotangents.volume, given) for measure, part, given in volume_parts(model, poses)]
    parts += [(_rubber_volume, part, density * cotangents.mass, ()) for density, part in _rubbers(model)]
    if not model.plate:
        parts.append((_face_moments, model.face, cotangents.face, (tip_centre(model.tip, X, X),)))
    if len(slabs.middle):
        by_X, by_u = slab_moments_pulled_back(model.tets, X, u, *slabs, np.array(cotangents.sections))
    for function, elements, bars, given in parts:
        some = bars.reshape(len(bars), -1).any(axis=1)
        if some.any():
            one, other = sums.pulled_back(function, elements, X, u, bars[some], *given)
            by_X[some] += one
            by_u[some] += other
    by_poses = np.array(cotangents.poses)
    if model.contact is not None:
        by_x, by_touched = pressing.pulled_back(model.contact, X + u, poses, cotangents.contact)
        by_X += by_x
        by_u += by_x
        by_poses += by_touched
    free = [] if model.contact is None else model.contact.rows
    states = []
    for number, plate in enumerate(cotangents.plate):
        by_state = nodes.pulled(by_u[number])
        states.append(by_state._replace(plate=by_state.plate + plate, objects=by_poses[number, free]))
        by_X[number] += nodes.pulled_to_nodes(by_u[number])
    return by_X, states


def _poses(model: Model, state: State, shift: np.ndarray | None) -> np.ndarray:
    """The poses (K, 6) of obstacles; by default all are in their places but for those that are free."""
    given = np.zeros((len(traits_of(model).obstacles), 6)) if shift is None else shift
    return given if model.contact is None else model.contact.poses(given, state.objects)


@partial(jax.jit, static_argnums=0)
def features_of(traits: ModelTraits, at: ElementSums) -> Features:
    """Features as functions of the element sums."""
    images = images_of(traits.part)
    volume = dict(zip(traits.chambers, len(images) * jnp.asarray(at.volume), strict=True))
    position, _, rotation = _fitted(images, at.sections)
    contact = {
        name: Pressing(row[FORCE], row[NORMAL], row[AREA])
        for name, row in zip(traits.obstacles, jnp.asarray(at.contact), strict=True)
    }
    pose = dict(zip(traits.obstacles, jnp.asarray(at.poses), strict=True))
    mass = len(images) * jnp.asarray(at.mass)
    if traits.plate:
        plate = jnp.asarray(at.plate)
        return Features(plate[:3], plate[3:], volume, position, rotation, contact, pose, mass)
    moved, place, turned = _fitted(images, jnp.asarray(at.face)[None])
    _, _, below = _fitted(images, jax.lax.stop_gradient(at.below))
    turn = continued_logarithm(turned[0], below)
    return Features((moved - place)[0], turn, volume, position, rotation, contact, pose, mass)


def _fitted(images: np.ndarray, moments: Array) -> tuple[Array, Array, Array]:
    """Means of x and X (…, 3), and rotations (…, 3, 3), the polar factors of Σ w (x − x̄) ⊗ (X − X̄).

    Over the whole body, which consists of the images (k, 3, 3) of what the moments are of.
    """
    mean = images.mean(axis=0)

    def one(moments: Array) -> tuple[Array, Array, Array]:
        X, x, products = moments[1:4] / moments[0], moments[4:7] / moments[0], moments[7:].reshape(3, 3) / moments[0]
        x, X, products = mean @ x, mean @ X, jnp.einsum("kia,ab,kjb->ij", images, products, images) / len(images)
        return x, X, polar_rotation(products - jnp.outer(x, X))

    if not len(moments):
        return jnp.zeros((0, 3)), jnp.zeros((0, 3)), jnp.zeros((0, 3, 3))
    return jax.vmap(one)(jnp.asarray(moments))


def _rubbers(model: Model) -> Iterator[tuple[float, Connectivity]]:
    """The density of every rubber, in g/mm³, and its elements."""
    solids = (term for term in model.terms if term.energy.of_rubber)
    for rubber, term in zip(model.rubbers.values(), solids, strict=True):
        yield _GRAMS * rubber.density, term.connectivity


def _rubber_volume(X: Values, u: Values, data: Values, weight: Values) -> Array:
    """The undeformed volume of tetrahedra, mm³."""
    return jnp.sum(TET_WEIGHT * determinant(reference_gradients(X)) * weight)


def _face_moments(X: Values, u: Values, data: Values, weight: Values, origin: Values) -> Array:
    """Moments (16,) of triangles about an origin, which is subtracted from x too."""
    _, normal = triangle_points(X)
    share = weight[:, None] * (jnp.asarray(TRIANGLE_WEIGHTS)[:, None] * jnp.sqrt(jnp.sum(normal**2, axis=0))).T
    place = jnp.einsum("ga,eai->egi", TRIANGLE_N, X) - origin
    return _weighted(share, place, place + jnp.einsum("ga,eai->egi", TRIANGLE_N, u))


def _weighted(share: Array, X: Array, x: Array) -> Array:
    """Moments of points X and x (E, q, 3) with weights (E, q)."""
    products = jnp.einsum("eg,egi,egj->ij", share, x, X)
    first = (jnp.einsum("eg,egi->i", share, points) for points in (X, x))
    return jnp.concatenate([jnp.sum(share)[None], *first, products.ravel()])
