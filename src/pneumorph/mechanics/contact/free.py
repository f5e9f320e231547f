"""Obstacles that are free: rigid bodies with weight, on springs and on planes, each with six unknowns.

The unknowns d = [c′, θ′] are what its pose [c, θ] has beyond the given one (`Loads.shift`). Its energy is

    ½ Σ k_i d_i² − m g·(c + (R(θ) − I) l) + ½ s |P θ′|² + Σ_points A b(gap)

with springs k to the given pose, the mass m, and the lever l from the centre about which it turns to that of gravity.
What turns a body of revolution into itself has no energy: of all such turns the term with P, the projector on them,
chooses that with the least angle, in which it is zero.

Of the fixed obstacles a free one touches planes alone: by the barrier of all contact on the gaps under the corners of
its triangles. The lowest point of such a body is a corner, so this is exact for it; a ball has its own lowest point.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from functools import partial

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.contact.implicit import KEPT
from pneumorph.mechanics.contact.obstacle import Floor, Obstacle
from pneumorph.mechanics.contact.pose import View, in_frame
from pneumorph.mechanics.elements.energy import ElementEnergy
from pneumorph.mechanics.elements.plate import rotation
from pneumorph.mechanics.elements.terms import Loads, Local, Values


@dataclass(frozen=True, eq=False)
class Free:
    """What a free obstacle is beside its surface.

    Attributes
    ----------
    mass : t.
    spring : (6,) N/mm and N·mm/rad, to its given pose.
    held : (6,) bool, the components of its unknowns that are zero.
    lever : (3,) mm, from the centre about which it turns to that of gravity.
    spin : (3, 3) N·mm/rad, s P.
    points, area : (P, 3) mm and (P,) mm², the points that may touch planes, in its own place.
    radius : mm, by which it reaches beyond the points.
    """

    mass: float
    spring: np.ndarray
    held: np.ndarray
    lever: np.ndarray
    spin: np.ndarray
    points: np.ndarray
    area: np.ndarray
    radius: float


@partial(register_dataclass, data_fields=["mass", "spring", "lever", "spin", "number", "object"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Carried(ElementEnergy):
    """Weight and springs of a free obstacle; `number` and `object` are its rows of `Loads.shift` and the unknowns."""

    mass: Values
    spring: Values
    lever: Values
    spin: Values
    number: Values
    object: Values

    def energies(self, local: Local, loads: Loads) -> Array:
        own = jnp.asarray(local.objects)[self.object]
        pose = jnp.asarray(loads.shift)[self.number] + own
        moved = pose[:3] + (rotation(pose[3:]) - jnp.eye(3)) @ jnp.asarray(self.lever)
        held = 0.5 * jnp.sum(self.spring * own**2) + 0.5 * own[3:] @ jnp.asarray(self.spin) @ own[3:]
        return (held - self.mass * jnp.dot(loads.acceleration, moved))[None]


@partial(
    register_dataclass,
    data_fields=["points", "area", "radius", "center", "number", "object", "plane", "under"],
    meta_fields=[],
)
@dataclass(frozen=True, eq=False)
class Resting(ElementEnergy):
    """The barrier between a free obstacle and a plane, of whose pose `under` is the row."""

    points: Values
    area: Values
    radius: Values
    center: Values
    number: Values
    object: Values
    plane: Floor
    under: Values

    def energies(self, local: Local, loads: Loads) -> Array:
        shift = jnp.asarray(loads.shift)
        pose = shift[self.number] + jnp.asarray(local.objects)[self.object]
        points = jnp.asarray(self.points)
        places = points + pose[:3] + (points - jnp.asarray(self.center)) @ (rotation(pose[3:]) - jnp.eye(3)).T
        gaps = self.plane.distance(in_frame(places, self.plane.center, shift[self.under])) - self.radius
        return jnp.sum(self.area * self.plane.barrier(gaps))[None]


def resting(obstacles: Mapping[str, Obstacle], free: Mapping[str, Free]) -> Iterator[tuple[str, int, int, int, Floor]]:
    """Every free obstacle over every plane: its name, its number, that of its unknowns, and the plane's number."""
    numbers = {name: number for number, name in enumerate(obstacles)}
    for index, name in enumerate(free):
        for plane, obstacle in obstacles.items():
            if obstacle.floor is not None:
                yield name, numbers[name], index, numbers[plane], obstacle.floor


def gaps(obstacles: Mapping[str, Obstacle], free: Mapping[str, Free], views: list[View]) -> np.ndarray:
    """The gaps under all points of free obstacles over planes, mm."""
    heights = [
        np.asarray(plane.distance(views[under].in_frame(views[number].placed(free[name].points)))) - free[name].radius
        for name, number, _, under, plane in resting(obstacles, free)
    ]
    return np.concatenate([np.zeros(0), *heights])


def share_above(start: np.ndarray, end: np.ndarray) -> float:
    """A share of the way between two vectors of gaps on which all of them stay open."""
    closing = start - end
    least = np.min((1.0 - KEPT) * start / np.maximum(closing, 1e-300), initial=1.0, where=closing > 0.0)
    return float(min(1.0, least))
