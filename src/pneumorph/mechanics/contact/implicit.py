"""Rigid obstacles with formulas for their distances, as terms of the potential.

    E = Σ_faces Σ_q w_q b(d(x_q))

Distances are exact, so obstacles have no facets. The weights w_q are areas of the mesh as it was made, constants like
its connectivity: so E depends on places x = X + u alone.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.contact.barrier import barrier, barrier_derivatives
from pneumorph.mechanics.contact.obstacle import FULL, Obstacle
from pneumorph.mechanics.contact.pose import in_frame
from pneumorph.mechanics.contact.samples import SAMPLE_DN, SAMPLE_N, SAMPLE_WEIGHTS, sample_places
from pneumorph.mechanics.contact.shapes import RigidMesh, Shape, Support
from pneumorph.mechanics.elements import sums
from pneumorph.mechanics.elements.energy import ElementEnergy
from pneumorph.mechanics.elements.terms import Connectivity, Loads, Local, Values

KEPT, CLOSE, MOST_ADVANCES = 0.1, 1e-3, 200
"""Every place keeps this share of its distance in a step; the share of the step to which that is found."""


class Implicit(Obstacle):
    """An obstacle with a formula for its distance, beside a body.

    Parameters
    ----------
    surface : Connectivity
        The faces of the body; see `samples.surface_of`.
    shape : Shape
    activation, stiffness : float
        The activation distance d̂ in mm, and the stiffness κ of the barrier in MPa.
    """

    def __init__(self, surface: Connectivity, shape: Shape, activation: float, stiffness: float):
        self.surface, self.shape = surface, shape
        self.activation, self.stiffness = activation, stiffness
        self.center, self.barrier = shape.center, Barrier(shape, activation, stiffness)
        self.floor = self.barrier if shape.endless else None

    def energies(self, number: int, row: int | None) -> Iterator[Barrier]:
        yield replace(self.barrier, number=number, object=row or 0, free=row is not None)

    def pressures(self, places: np.ndarray) -> np.ndarray:
        slope = barrier_derivatives(self._chunked(_distances, places), self.activation, self.stiffness)[1]
        return -slope[..., None] * self._chunked(_away_from, places)

    def apart(self, x: np.ndarray) -> bool:
        return bool(np.all(self._chunked(_distances, sample_places(self.surface, x)) > 0.0))

    def free_share(self, start: np.ndarray, end: np.ndarray) -> float:
        """By conservative advancement: a distance changes by no more than its place moves."""
        first = sample_places(self.surface, start)
        motion = sample_places(self.surface, end) - first
        moved = np.maximum(np.linalg.norm(motion, axis=-1), 1e-300)
        gaps = self._chunked(_distances, first)
        kept, shares = KEPT * gaps, np.zeros(moved.shape)
        for _ in range(MOST_ADVANCES):
            advance = (gaps - kept) / moved
            shares = np.minimum(shares + advance, 1.0)
            if np.all((shares == 1.0) | (advance < CLOSE)):
                break
            gaps = self._chunked(_distances, first + shares[..., None] * motion)
        return float(shares.min())

    def pressed(self, x: np.ndarray) -> np.ndarray:
        return sums.summed(_pressed, self.surface, x, np.zeros(x.shape), self.barrier)

    def pressed_back(self, x: np.ndarray, bars: np.ndarray) -> np.ndarray:
        by_x, some = np.zeros((len(bars), *x.shape)), bars.any(axis=1)
        by_x[some] = sums.pulled_back(_pressed, self.surface, x, np.zeros(x.shape), bars[some], self.barrier)[0]
        return by_x

    def around(self, sag: float) -> RigidMesh | None:
        return self.shape.mesh(sag)

    def support(self, sag: float) -> Support:
        return self.shape.support(sag, self.activation)

    def spin(self) -> np.ndarray:
        return self.shape.spin(self.stiffness)

    def _chunked(self, function, places: np.ndarray) -> np.ndarray:
        """A function of the shape and of places (F, 7, 3), by chunks of the surface."""
        return np.concatenate([np.asarray(function(self.shape, places[chunk])) for chunk in self.surface.chunks()])


@jax.jit
def _distances(shape: Shape, places: Values) -> Array:
    return shape.distance(places)


@jax.jit
def _away_from(shape: Shape, places: Values) -> Array:
    return jax.grad(lambda x: jnp.sum(shape.distance(x)))(places)


@partial(register_dataclass, data_fields=["shape", "activation", "stiffness", "number", "object"], meta_fields=["free"])
@dataclass(frozen=True, eq=False)
class Barrier(ElementEnergy):
    """The term of an obstacle with a formula.

    The row `number` of `Loads.shift` is its pose, to which that of a free one adds the row `object` of the unknowns.
    """

    shape: Shape
    activation: Values
    stiffness: Values
    number: Values = 0
    object: Values = 0
    free: bool = False

    @property
    def center(self) -> Values:
        return self.shape.center

    def distance(self, x: Values) -> Array:
        """See `Floor`."""
        return self.shape.distance(x)

    def barrier(self, distance: Values) -> Array:
        """See `Floor`."""
        return barrier(distance, self.activation, self.stiffness)

    def energies(self, local: Local, loads: Loads) -> Array:
        places = jnp.einsum("qa,eai->eqi", jnp.asarray(SAMPLE_N), local.X + local.u)
        places = in_frame(places, jnp.asarray(self.center), posed(self, local, loads))
        return jnp.sum(local.data * self.barrier(self.distance(places)), axis=1)


class Posed(Protocol):
    """What has a row of `Loads.shift` and, where it is free, one of the unknowns of free obstacles."""

    @property
    def number(self) -> Values: ...

    @property
    def object(self) -> Values: ...

    @property
    def free(self) -> bool: ...


def posed(of: Posed, local: Local, loads: Loads) -> Array:
    """The pose (6,) of an obstacle."""
    given = jnp.asarray(loads.shift)[of.number]
    return given + jnp.asarray(local.objects)[of.object] if of.free else given


def _pressed(x: Values, u: Values, data: Values, weight: Values, obstacle: Barrier) -> Array:
    places = jnp.einsum("qa,eai->eqi", jnp.asarray(SAMPLE_N), x)
    distance = obstacle.distance(places)
    away = jax.grad(lambda places: jnp.sum(obstacle.distance(places)))(places)
    slope = jax.grad(lambda each: jnp.sum(obstacle.barrier(each)))(distance)
    normal = -weight[:, None] * data * slope
    along, across = jnp.einsum("eai,qak->keqi", x, jnp.asarray(SAMPLE_DN))
    area = jnp.asarray(SAMPLE_WEIGHTS)[:, None] * jnp.cross(along, across)
    # Faces beside what touches, which stand on the obstacle, are near it too: only what faces it counts.
    facing = jnp.maximum(-jnp.sum(area * away, axis=-1), 0.0)
    share = _faded((1.0 - distance / obstacle.activation) / (1.0 - FULL))
    touching = weight[:, None] * share * facing**2 / jnp.sqrt(jnp.sum(area**2, axis=-1))
    force = -jnp.einsum("eq,eqi->i", normal, away)
    return jnp.concatenate([force, jnp.sum(normal)[None], jnp.sum(touching)[None]])


def _faded(share: Array) -> Array:
    """From 0 to 1 as a share does, with two continuous derivatives."""
    share = jnp.clip(share, 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
