"""Rigid bodies by the formulas of their distances, and by triangles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import ClassVar, NamedTuple

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass
from scipy.spatial import ConvexHull

from pneumorph.mechanics.elements.terms import Values

SPIN = 1e-3
"""s over κ r³, of a stiffness κ and a radius r: small beside what friction does, large beside rounding."""


@dataclass(frozen=True)
class RigidMesh:
    """The surface of a rigid body as flat triangles (T, 3) with corners (V, 3) in mm."""

    points: np.ndarray
    triangles: np.ndarray

    def support(self) -> Support:
        """Its corners, each with a third of the triangles around it."""
        a, b, c = np.moveaxis(self.points[self.triangles], 1, 0)
        share = np.linalg.norm(np.cross(b - a, c - a), axis=1) / 6.0
        return Support(self.points, np.bincount(self.triangles.ravel(), np.repeat(share, 3), len(self.points)), 0.0)

    def middle(self) -> np.ndarray:
        """The centre (3,) of gravity of a body of even density with this surface."""
        corners = self.points[self.triangles]
        volume = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2]))
        return np.einsum("t,tki->i", volume, corners) / (4.0 * volume.sum())


class Support(NamedTuple):
    """The points (P, 3) of a free obstacle that may touch planes, in mm, in its own place.

    With their areas (P,) in mm², and the radius by which it reaches beyond them.
    """

    points: np.ndarray
    area: np.ndarray
    radius: float


class RigidBody:
    """A rigid body, which turns about its centre (3,)."""

    center: Values

    def mesh(self, sag: float) -> RigidMesh | None:
        """Triangles around it, nowhere farther away than about `sag` in mm; None if it has no end."""
        raise NotImplementedError

    def beside(self, points: np.ndarray, margin: float, sag: float) -> RigidMesh:
        """Its triangles; of one without end those up to a margin in mm beyond points (N, 3)."""
        mesh = self.mesh(sag)
        assert mesh is not None
        return mesh


@dataclass(frozen=True, eq=False)
class Triangles(RigidBody):
    """A body by the triangles of its surface."""

    surface: RigidMesh
    center: np.ndarray

    def mesh(self, sag: float) -> RigidMesh:
        return self.surface


class Shape(RigidBody):
    """A rigid body by its distance; registered with JAX."""

    endless: ClassVar[bool] = False
    """Whether it has no end: free obstacles may rest on it."""

    def distance(self, x: Values) -> Array:
        """Distances (...) of places x (..., 3) from its surface in mm, negative inside."""
        raise NotImplementedError

    def spin(self, stiffness: float) -> np.ndarray:
        """s P (3, 3) in N·mm/rad, on the turns that turn it into itself, for a stiffness κ in MPa; see `free.py`."""
        return np.zeros((3, 3))

    def support(self, sag: float, activation: float) -> Support:
        """What of it may touch planes within an activation distance in mm; triangles are those of `mesh`."""
        mesh = self.mesh(sag)
        assert mesh is not None
        return mesh.support()


@partial(register_dataclass, data_fields=["point", "normal"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Plane(Shape):
    """The half-space behind a plane through `point`, whose unit normal points out of it."""

    endless: ClassVar[bool] = True

    point: Values
    normal: Values

    @property
    def center(self) -> Values:
        return self.point

    def distance(self, x: Values) -> Array:
        return (x - self.point) @ self.normal

    def mesh(self, sag: float) -> None:
        return None

    def beside(self, points: np.ndarray, margin: float, sag: float) -> RigidMesh:
        """A rectangle of it."""
        across = np.linalg.svd(np.asarray(self.normal)[None])[2][1:]
        along = (points - self.point) @ across.T
        low, high = along.min(axis=0) - margin, along.max(axis=0) + margin
        corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
        return RigidMesh(np.asarray(self.point) + corners @ across, np.array([[0, 1, 2], [0, 2, 3]]))


@partial(register_dataclass, data_fields=["center", "radius"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Sphere(Shape):
    """A ball."""

    center: Values
    radius: Values

    def distance(self, x: Values) -> Array:
        return length_of(x - self.center) - self.radius

    def mesh(self, sag: float) -> RigidMesh:
        # Points on a spiral; a hull of n of them has triangles of area 2πR²/n.
        count = max(32, int(np.ceil(8.0 * self.radius / sag)))
        height = 1.0 - (2.0 * np.arange(count) + 1.0) / count
        angle, away = np.pi * (3.0 - np.sqrt(5.0)) * np.arange(count), np.sqrt(1.0 - height**2)
        return _around(self.center, self.radius, np.column_stack([away * np.cos(angle), away * np.sin(angle), height]))

    def spin(self, stiffness: float) -> np.ndarray:
        return SPIN * stiffness * float(self.radius) ** 3 * np.eye(3)

    def support(self, sag: float, activation: float) -> Support:
        """Its centre, with the area of the cap that is within the activation distance of a plane."""
        radius = float(self.radius)
        return Support(np.asarray(self.center)[None], np.array([2.0 * np.pi * radius * activation]), radius)


@partial(register_dataclass, data_fields=["center", "axis", "radius", "half"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Cylinder(Shape):
    """A solid cylinder with flat ends, `half` its length to both sides of its centre along the unit vector `axis`."""

    center: Values
    axis: Values
    radius: Values
    half: Values

    def distance(self, x: Values) -> Array:
        along = (x - self.center) @ self.axis
        away = length_of(x - self.center - along[..., None] * self.axis)
        return _outside(jnp.stack([away - self.radius, jnp.abs(along) - self.half], axis=-1))

    def mesh(self, sag: float) -> RigidMesh:
        count = max(12, int(np.ceil(np.pi / np.arccos(1.0 / (1.0 + sag / self.radius)))))
        angle = 2.0 * np.pi * np.arange(count) / count
        across = np.linalg.svd(np.asarray(self.axis, dtype=float)[None])[2][1:]
        ring = self.radius / np.cos(np.pi / count) * np.column_stack([np.cos(angle), np.sin(angle)]) @ across
        ends = self.half * np.asarray(self.axis)
        return _hull(self.center + np.concatenate([ring - ends, ring + ends]))

    def spin(self, stiffness: float) -> np.ndarray:
        return SPIN * stiffness * float(self.radius) ** 3 * np.outer(self.axis, self.axis)


@partial(register_dataclass, data_fields=["center", "half"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Box(Shape):
    """A box with edges along x, y, z, `half` (3,) of each to both sides of its centre."""

    center: Values
    half: Values

    def distance(self, x: Values) -> Array:
        return _outside(jnp.abs(x - self.center) - self.half)

    def mesh(self, sag: float) -> RigidMesh:
        corners = np.stack(np.meshgrid(*[[-1.0, 1.0]] * 3), axis=-1).reshape(-1, 3)
        return _hull(self.center + self.half * corners)


def _around(center: np.ndarray, radius: float, directions: np.ndarray) -> RigidMesh:
    """The hull of points in these directions (n, 3) from a centre that touches the sphere from outside."""
    nearest = -ConvexHull(directions).equations[:, 3].max()
    return _hull(center + radius / nearest * directions)


def _hull(points: np.ndarray) -> RigidMesh:
    """The triangles of the hull of points that are all corners of it, seen counter-clockwise from outside."""
    hull = ConvexHull(points)
    a, b, c = np.moveaxis(points[hull.simplices], 1, 0)
    outward = np.einsum("ti,ti->t", np.cross(b - a, c - a), hull.equations[:, :3]) > 0.0
    return RigidMesh(points, np.where(outward[:, None], hull.simplices, hull.simplices[:, ::-1]))


def length_of(vector: Values) -> Array:
    """|v| of vectors (..., 3), with a derivative where it is zero too."""
    square = jnp.sum(vector * vector, axis=-1)
    return jnp.where(square > 0.0, jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 0.0)


def _outside(beyond: Array) -> Array:
    """The distance from a product of intervals, of how far places are beyond each of them (..., k)."""
    return length_of(jnp.maximum(beyond, 0.0)) + jnp.minimum(jnp.max(beyond, axis=-1), 0.0)
