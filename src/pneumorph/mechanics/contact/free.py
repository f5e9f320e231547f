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

from pneumorph.mechanics.contact.obstacles import KEPT, Cylinder, Obstacle, Plane, RigidMesh, Shape, Sphere, barrier
from pneumorph.mechanics.contact.pose import View, seen
from pneumorph.mechanics.elements.plate import rotation
from pneumorph.mechanics.elements.terms import Loads, Local, Values

SPIN = 1e-3
"""s over κ r³, of a stiffness κ and a radius r: small beside what friction does, large beside rounding."""


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


def spin_of(shape: Shape | None, stiffness: float) -> np.ndarray:
    """s P (3, 3) of a shape, None for one of triangles; κ in MPa."""
    match shape:
        case Sphere():
            return SPIN * stiffness * float(shape.radius) ** 3 * np.eye(3)
        case Cylinder():
            return SPIN * stiffness * float(shape.radius) ** 3 * np.outer(shape.axis, shape.axis)
        case _:
            return np.zeros((3, 3))


def points_of(shape: Shape | None, mesh: RigidMesh, activation: float) -> tuple[np.ndarray, np.ndarray, float]:
    """The points (P, 3) that may touch planes, their areas (P,) and the radius by which it reaches beyond them."""
    if isinstance(shape, Sphere):
        # The area of the cap that is within the activation distance of a plane.
        radius = float(shape.radius)
        return np.asarray(shape.center)[None], np.array([2.0 * np.pi * radius * activation]), radius
    a, b, c = np.moveaxis(mesh.points[mesh.triangles], 1, 0)
    share = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
    area = np.bincount(mesh.triangles.ravel(), np.repeat(share, 3), len(mesh.points))
    return mesh.points, area, 0.0


def middle_of(mesh: RigidMesh) -> np.ndarray:
    """The centre (3,) of gravity of a body of even density."""
    corners = mesh.points[mesh.triangles]
    volume = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
    return np.einsum("t,tki->i", volume, corners) / (4.0 * volume.sum())


@partial(register_dataclass, data_fields=["mass", "spring", "lever", "spin", "number", "object"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Carried:
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
class Resting:
    """The barrier between a free obstacle and a plane, of whose pose `under` is the row."""

    points: Values
    area: Values
    radius: Values
    center: Values
    number: Values
    object: Values
    plane: Obstacle
    under: Values

    def energies(self, local: Local, loads: Loads) -> Array:
        shift = jnp.asarray(loads.shift)
        pose = shift[self.number] + jnp.asarray(local.objects)[self.object]
        points = jnp.asarray(self.points)
        places = points + pose[:3] + (points - jnp.asarray(self.center)) @ (rotation(pose[3:]) - jnp.eye(3)).T
        gaps = self.plane.shape.distance(seen(places, self.plane.center, shift[self.under])) - self.radius
        return jnp.sum(self.area * barrier(gaps, self.plane.activation, self.plane.stiffness))[None]


def resting(obstacles: Mapping[str, object], free: Mapping[str, Free]) -> Iterator[tuple[str, int, int, int, Obstacle]]:
    """Every free obstacle over every plane: its name, its number, that of its unknowns, and the plane's number."""
    numbers = {name: number for number, name in enumerate(obstacles)}
    for index, name in enumerate(free):
        for plane, obstacle in obstacles.items():
            if isinstance(obstacle, Obstacle) and isinstance(obstacle.shape, Plane):
                yield name, numbers[name], index, numbers[plane], obstacle


def gaps(obstacles: Mapping[str, object], free: Mapping[str, Free], views: list[View]) -> np.ndarray:
    """The gaps under all points of free obstacles over planes, mm."""
    found = [
        np.asarray(plane.shape.distance(views[under].seen(views[number].placed(free[name].points)))) - free[name].radius
        for name, number, _, under, plane in resting(obstacles, free)
    ]
    return np.concatenate([np.zeros(0), *found])


def share_above(start: np.ndarray, end: np.ndarray) -> float:
    """A share of the way between two vectors of gaps on which all of them stay open."""
    closing = start - end
    least = np.min((1.0 - KEPT) * start / np.maximum(closing, 1e-300), initial=1.0, where=closing > 0.0)
    return float(min(1.0, least))
