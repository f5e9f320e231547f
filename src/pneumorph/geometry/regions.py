"""Convex regions of space in which surfaces are kept.

How far a point is beyond a region is a convex function of its place. A patch lies in the convex hull of its control
points, so no point of it is farther beyond than the farthest of these.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import reduce
from typing import Any, Protocol

import numpy as np

Vector = tuple[float, float, float]

_ON_AXIS = 1e-12  # mm²; the distance from an axis has a derivative even there


class Region(Protocol):
    """A convex region; arrays may be NumPy's or JAX's."""

    def beyond(self, x: Any) -> Any:
        """Distance (...,) in mm by which points x (..., 3) are beyond the region; negative within it."""
        ...

    def outward(self, x: Any) -> Any:
        """Derivatives (..., 3) of these distances with respect to the points."""
        ...


@dataclass(frozen=True)
class HalfSpace:
    """All points x with normal·x ≤ offset; the normal is a unit vector and the offset in mm."""

    normal: Vector
    offset: float

    def beyond(self, x: Any) -> Any:
        return x @ np.array(self.normal) - self.offset

    def outward(self, x: Any) -> Any:
        return np.broadcast_to(np.array(self.normal), x.shape)


@dataclass(frozen=True)
class Ball:
    """All points within a radius in mm of a centre."""

    radius: float
    centre: Vector

    def beyond(self, x: Any) -> Any:
        return _length(x - np.array(self.centre)) - self.radius

    def outward(self, x: Any) -> Any:
        away = x - np.array(self.centre)
        return away / _length(away)[..., None]


@dataclass(frozen=True)
class Cylinder:
    """All points within a radius in mm of the line through `centre` along the unit vector `axis`."""

    radius: float
    centre: Vector = (0.0, 0.0, 0.0)
    axis: Vector = (0.0, 0.0, 1.0)

    def beyond(self, x: Any) -> Any:
        return _length(self._across(x)) - self.radius

    def outward(self, x: Any) -> Any:
        across = self._across(x)
        return across / _length(across)[..., None]

    def _across(self, x: Any) -> Any:
        axis, away = np.array(self.axis), x - np.array(self.centre)
        return away - (away @ axis)[..., None] * axis


@dataclass(frozen=True)
class Intersection:
    """All points that are in every one of some regions."""

    regions: tuple[Region, ...]

    def beyond(self, x: Any) -> Any:
        return reduce(x.__array_namespace__().maximum, (region.beyond(x) for region in self.regions))

    def outward(self, x: Any) -> Any:
        farthest = np.argmax([region.beyond(x) for region in self.regions], axis=0)
        return np.choose(farthest[..., None], [region.outward(x) for region in self.regions])


@dataclass(frozen=True)
class Outside:
    """What is outside of a convex region, so not convex itself."""

    region: Region

    def beyond(self, x: Any) -> Any:
        return -self.region.beyond(x)

    def outward(self, x: Any) -> Any:
        return -self.region.outward(x)


@dataclass(frozen=True, eq=False)
class Image:
    """The points that an orthogonal matrix (3, 3) about a point `middle` (3,) maps into a region."""

    region: Region
    matrix: Any
    middle: Any

    def beyond(self, x: Any) -> Any:
        return self.region.beyond(self._mapped(x))

    def outward(self, x: Any) -> Any:
        return self.region.outward(self._mapped(x)) @ self.matrix

    def _mapped(self, x: Any) -> Any:
        return self.middle + (x - self.middle) @ self.matrix.T


def _length(vectors: Any) -> Any:
    return ((vectors * vectors).sum(axis=-1) + _ON_AXIS) ** 0.5


def box(low: Vector, high: Vector) -> Intersection:
    """All points between two corners, in mm; an infinite coordinate leaves that side open."""
    sides = []
    for k, (least, most) in enumerate(zip(low, high, strict=True)):
        for sign, offset in ((-1.0, -least), (1.0, most)):
            if np.isfinite(offset):
                sides.append(HalfSpace((sign * (k == 0), sign * (k == 1), sign * (k == 2)), offset))
    return Intersection(tuple(sides))
