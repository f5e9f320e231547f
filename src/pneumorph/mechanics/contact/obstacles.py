"""Rigid obstacles as terms of the potential: a smooth barrier on the distance of the body's surface from each of them.

    E = Σ_faces Σ_q w_q b(d(x_q)),   b(d) = −κ d̂ (d/d̂ − 1)² ln(d/d̂) for d < d̂, else 0

is that of incremental potential contact (Li et al. 2020, ACM Trans. Graph. 39(4) 49): it has two continuous
derivatives, is zero from the activation distance d̂ on, and infinite where surfaces meet. −b′ is a contact pressure in
MPa. Distances are exact, so obstacles have no facets. The weights w_q are areas of the mesh as it was made, constants
like its connectivity: so E depends on places x = X + u alone.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Protocol

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass
from scipy.spatial import ConvexHull

from pneumorph.mechanics.contact.pose import seen
from pneumorph.mechanics.elements.terms import Connectivity, Loads, Local, Values, connect
from pneumorph.mesh.tets import TetMesh, is_cut, triangle_gradient, triangle_shape

_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5], [1 / 3, 1 / 3]])
SAMPLE_N, SAMPLE_DN = triangle_shape(_CORNERS), triangle_gradient(_CORNERS)
SAMPLE_WEIGHTS = np.repeat([1 / 40, 1 / 15, 9 / 40], [3, 3, 1])
"""The rule of degree 3 whose points are the six nodes and the centre: under a plane every node keeps its distance, and
a uniform gap gives the nodal forces of a uniform pressure."""


def surface_of(mesh: TetMesh) -> Connectivity:
    """All faces of a mesh but a cut one; the data of a face (7,) are its areas at the sample points, mm²."""
    faces = np.concatenate([nodes for name, nodes in mesh.faces.items() if not is_cut(name)])
    along, across = np.einsum("fai,qak->kfqi", mesh.points[faces], SAMPLE_DN)
    return connect(faces, data=SAMPLE_WEIGHTS * np.linalg.norm(np.cross(along, across), axis=-1), objects=True)


@dataclass(frozen=True)
class RigidMesh:
    """The surface of a rigid body as flat triangles (T, 3) with corners (V, 3) in mm."""

    points: np.ndarray
    triangles: np.ndarray


class Shape(Protocol):
    """A rigid body by its distance; registered with JAX. It turns about its centre (3,)."""

    @property
    def center(self) -> Values: ...

    def distance(self, x: Values) -> Array:
        """Distances (...) of places x (..., 3) from its surface in mm, negative inside."""
        ...

    def mesh(self, sag: float) -> RigidMesh | None:
        """Triangles around it, nowhere farther away than about `sag` in mm; None if it has no end."""
        ...


@partial(register_dataclass, data_fields=["point", "normal"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Plane:
    """The half-space behind a plane through `point`, whose unit normal points out of it."""

    point: Values
    normal: Values

    @property
    def center(self) -> Values:
        return self.point

    def distance(self, x: Values) -> Array:
        return (x - self.point) @ self.normal

    def mesh(self, sag: float) -> None:
        return None


@partial(register_dataclass, data_fields=["center", "radius"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Sphere:
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


@partial(register_dataclass, data_fields=["center", "axis", "radius", "half"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Cylinder:
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


@partial(register_dataclass, data_fields=["center", "half"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Box:
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
    found = ConvexHull(points)
    a, b, c = np.moveaxis(points[found.simplices], 1, 0)
    outward = np.einsum("ti,ti->t", np.cross(b - a, c - a), found.equations[:, :3]) > 0.0
    return RigidMesh(points, np.where(outward[:, None], found.simplices, found.simplices[:, ::-1]))


def length_of(vector: Values) -> Array:
    """|v| of vectors (..., 3), with a derivative where it is zero too."""
    square = jnp.sum(vector * vector, axis=-1)
    return jnp.where(square > 0.0, jnp.sqrt(jnp.where(square > 0.0, square, 1.0)), 0.0)


def _outside(beyond: Array) -> Array:
    """The distance from a product of intervals, of how far places are beyond each of them (..., k)."""
    return length_of(jnp.maximum(beyond, 0.0)) + jnp.minimum(jnp.max(beyond, axis=-1), 0.0)


@partial(register_dataclass, data_fields=["shape", "activation", "stiffness", "number", "object"], meta_fields=["free"])
@dataclass(frozen=True, eq=False)
class Obstacle:
    """The barrier of a rigid body: the activation distance d̂ in mm, and the stiffness κ in MPa.

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

    def energies(self, local: Local, loads: Loads) -> Array:
        places = jnp.einsum("qa,eai->eqi", jnp.asarray(SAMPLE_N), local.X + local.u)
        places = seen(places, jnp.asarray(self.center), posed(self, local, loads))
        return jnp.sum(local.data * barrier(self.shape.distance(places), self.activation, self.stiffness), axis=1)


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


def barrier(distance: Values, activation: Values, stiffness: Values) -> Array:
    """b(d) in N/mm; not a number where surfaces have met."""
    share = distance / activation
    near = share < 1.0
    inside = jnp.where(near & (share > 0.0), share, 1.0)
    value = -stiffness * activation * (inside - 1.0) ** 2 * jnp.log(inside)
    return jnp.where(share > 0.0, value, jnp.nan)


def pressure(distance: np.ndarray, obstacle: Obstacle) -> np.ndarray:
    """−b′(d) in MPa."""
    slope = jax.grad(lambda each: jnp.sum(barrier(each, obstacle.activation, obstacle.stiffness)))
    return -np.asarray(slope(jnp.asarray(distance)))


def sample_places(surface: Connectivity, x: np.ndarray) -> np.ndarray:
    """The sample points (F, 7, 3) of the faces of a surface, with nodes at x (N, 3)."""
    return np.einsum("qa,fai->fqi", SAMPLE_N, x[surface.nodes])


def distances(shape: Shape, surface: Connectivity, places: np.ndarray) -> np.ndarray:
    """Distances (F, 7) of the sample points (F, 7, 3) of a surface from a shape."""
    return np.concatenate([np.asarray(_distances(shape, places[chunk])) for chunk in surface.chunks()])


@jax.jit
def _distances(shape: Shape, places: Values) -> Array:
    return shape.distance(places)


def away_from(shape: Shape, surface: Connectivity, places: np.ndarray) -> np.ndarray:
    """Unit vectors (F, 7, 3) away from a shape at the sample points (F, 7, 3) of a surface."""
    return np.concatenate([np.asarray(_away_from(shape, places[chunk])) for chunk in surface.chunks()])


@jax.jit
def _away_from(shape: Shape, places: Values) -> Array:
    return jax.grad(lambda x: jnp.sum(shape.distance(x)))(places)


KEPT, CLOSE, MOST_ADVANCES = 0.1, 1e-3, 200
"""Every place keeps this share of its distance in a step; the share of the step to which that is found."""


def free_share(shape: Shape, surface: Connectivity, start: np.ndarray, end: np.ndarray) -> float:
    """A share of the straight motion from places `start` to `end` (F, 7, 3) on which none of them meets the shape.

    By conservative advancement: a distance changes by no more than its place moves.
    """
    motion = end - start
    moved = np.maximum(np.linalg.norm(motion, axis=-1), 1e-300)
    gaps = distances(shape, surface, start)
    kept, shares = KEPT * gaps, np.zeros(moved.shape)
    for _ in range(MOST_ADVANCES):
        advance = (gaps - kept) / moved
        shares = np.minimum(shares + advance, 1.0)
        if np.all((shares == 1.0) | (advance < CLOSE)):
            break
        gaps = distances(shape, surface, start + shares[..., None] * motion)
    return float(shares.min())
