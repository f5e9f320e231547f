"""Outlines of cross-sections as fine closed polygons, counter-clockwise, mm."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneumorph.problem.table import InvalidKey

Array = NDArray[np.float64]

SAME = 1e-6
"""Points nearer than this (mm) are one."""

_STEP = math.pi / 256  # angle of a side of an arc's polygon, which is nearer to the arc than 2e-5 of its radius
_ALIKE = 1e-3  # mm; outlines that are nearer to each other are one, whatever polygons they are


@dataclass(frozen=True, eq=False)
class Outline:
    """A closed curve around the axis of a tube.

    Attributes
    ----------
    points : (n, 2) float
        A fine polygon, counter-clockwise, mm.
    start : float
        The share of the length at its first point, see `at`.
    """

    points: Array
    start: float = 0.0

    @classmethod
    def of(cls, polygon: Array, anchor: float, turn: float) -> Outline:
        """Turn a polygon; the point where the ray in direction `anchor` leaves it has the share (anchor + turn)/2π.

        Raises
        ------
        InvalidKey
            If the polygon does not surround the axis.
        """
        own = polygon @ _rotation(-anchor).T
        after = np.roll(own, -1, axis=0)
        leaving = (own[:, 1] <= 0.0) & (after[:, 1] > 0.0)
        share = np.where(leaving, own[:, 1] / np.where(leaving, own[:, 1] - after[:, 1], 1.0), 0.0)
        place = np.where(leaving, own[:, 0] + share * (after[:, 0] - own[:, 0]), -np.inf)
        first = int(place.argmax())
        if not cls(polygon).contains(np.zeros((1, 2)))[0]:
            raise InvalidKey("points", "do not surround the axis of the tube; move them, or the tube by its center")
        points = np.vstack([[place[first], 0.0], np.roll(own, -first - 1, axis=0)])
        apart = np.linalg.norm(np.roll(points, -1, axis=0) - points, axis=1) > 1e-9
        return cls(points[apart] @ _rotation(anchor + turn).T, (anchor + turn) / (2.0 * math.pi))

    @cached_property
    def _lengths(self) -> Array:
        """Lengths (n + 1,) from the first point to every point, and all around."""
        return np.concatenate(
            [[0.0], np.cumsum(np.linalg.norm(np.roll(self.points, -1, axis=0) - self.points, axis=1))]
        )

    @property
    def length(self) -> float:
        """Its length, mm."""
        return float(self._lengths[-1])

    @property
    def area(self) -> float:
        """The area inside, mm²."""
        return area(self.points)

    @property
    def reach(self) -> float:
        """Largest distance from the axis, mm."""
        return float(np.linalg.norm(self.points, axis=1).max())

    @property
    def curvature(self) -> float:
        """The largest curvature, 1/mm."""
        side = np.roll(self.points, -1, axis=0) - self.points
        before = np.roll(side, 1, axis=0)
        angle = np.arctan2(_cross(before, side), (before * side).sum(axis=1))
        lengths = np.linalg.norm(side, axis=1)
        # Where a straight side meets an arc the shorter of the two is the arc's.
        return float((np.abs(angle) / np.minimum(lengths, np.roll(lengths, 1))).max())

    def at(self, share: ArrayLike) -> Array:
        """Points (n, 2) at shares (n,) of the length."""
        length = (np.asarray(share, dtype=float) - self.start) % 1.0 * self.length
        closed = np.vstack([self.points, self.points[:1]])
        return np.column_stack([np.interp(length, self._lengths, closed[:, axis]) for axis in (0, 1)])

    def share_at(self, angle: float) -> float:
        """The share of the length at which the outline is in a direction from the axis, the farthest point of it."""
        own = self.points @ _rotation(-angle).T
        after = np.roll(own, -1, axis=0)
        crossing = (own[:, 1] <= 0.0) != (after[:, 1] <= 0.0)
        part = np.where(crossing, own[:, 1] / np.where(crossing, own[:, 1] - after[:, 1], 1.0), 0.0)
        place = np.where(crossing, own[:, 0] + part * (after[:, 0] - own[:, 0]), -np.inf)
        side = int(place.argmax())
        length = self._lengths[side] + part[side] * (self._lengths[side + 1] - self._lengths[side])
        return (self.start + float(length) / self.length) % 1.0

    def moved(self, x: float, y: float) -> Outline:
        """The outline of a tube whose axis is elsewhere."""
        return Outline(self.points + np.array([x, y]), self.start)

    def scaled(self, factor: float) -> Outline:
        """The outline with all lengths multiplied."""
        return Outline(self.points * factor, self.start)

    def contains(self, points: Array) -> NDArray[np.bool_]:
        """Whether points (m, 2) are inside."""
        one = self.points[None] - points[:, None]
        other = np.roll(self.points, -1, axis=0)[None] - points[:, None]
        turns = np.arctan2(_cross(one, other), (one * other).sum(axis=2)).sum(axis=1)
        return np.abs(turns) > math.pi

    def distances(self, points: Array) -> Array:
        """Distances (m,) of points (m, 2) from the curve, mm."""
        start, side = self.points[None], (np.roll(self.points, -1, axis=0) - self.points)[None]
        away = points[:, None] - start
        part = np.clip((away * side).sum(axis=2) / (side**2).sum(axis=2), 0.0, 1.0)
        return np.linalg.norm(away - part[..., None] * side, axis=2).min(axis=1)

    def gap(self, other: Outline) -> float:
        """Distance (mm) from another outline; negative where one reaches into the other."""
        gap = min(float(self.distances(other.points).min()), float(other.distances(self.points).min()))
        return -gap if self.contains(other.points).any() or other.contains(self.points).any() else gap

    def clearance(self, inner: Outline) -> float:
        """Least distance (mm) of an outline inside from this one; negative where it reaches out."""
        gap = float(min(self.distances(inner.points).min(), inner.distances(self.points).min()))
        return gap if self.contains(inner.points).all() else -gap

    def is_image_of(self, other: Outline, matrix: Array) -> bool:
        """Whether it is the image of another outline under an orthogonal matrix (3, 3)."""
        return bool(self.distances(other.points @ matrix[:2, :2].T).max() < _ALIKE)


def directions(angle: Array) -> Array:
    """Unit vectors (n, 2) at angles (n,) from x, rad."""
    return np.column_stack([np.cos(angle), np.sin(angle)])


def arc(center: Sequence[float], radius: float, first: float, last: float) -> Array:
    """A fine polygon (n, 2) of an arc from one angle to another, both ends included.

    Parameters
    ----------
    center : (2,)
    radius : float
        In the unit of the centre.
    first, last : float
        Angles of both ends, rad.
    """
    steps = max(1, math.ceil(abs(last - first) / _STEP - 1e-9))
    return np.asarray(center) + radius * directions(np.linspace(first, last, steps + 1))


def rounded(corners: Array, radius: float) -> Array:
    """A counter-clockwise polygon (n, 2) with its corners rounded off, as a fine polygon.

    Raises
    ------
    InvalidKey
        If the radius is too large for a side.
    """
    before, after = corners - np.roll(corners, 1, axis=0), np.roll(corners, -1, axis=0) - corners
    length = np.linalg.norm(after, axis=1)
    turns = np.arctan2(_cross(before, after), (before * after).sum(axis=1))
    cut = np.abs(np.tan(turns / 2.0))  # of each side next to the corner, for a radius of 1
    largest = float((length / np.maximum(cut + np.roll(cut, -1), 1e-12)).min())
    if radius > largest * (1.0 + 1e-9):
        raise InvalidKey("corner", f"{radius:g} mm does not fit; use at most {largest:.4g} mm, or longer sides")
    points = []
    for corner, side, own, turn in zip(corners, after / length[:, None], cut, turns, strict=True):
        normal = math.copysign(1.0, turn) * np.array([-side[1], side[0]])
        center = corner + radius * (own * side + normal)
        end = math.atan2(-normal[1], -normal[0])
        points.append(arc(center.tolist(), radius, end - turn, end))
    return np.concatenate(points)


def area(points: Array) -> float:
    """Area (mm²) inside a polygon (n, 2), negative if it is clockwise."""
    return float(0.5 * _cross(points, np.roll(points, -1, axis=0)).sum())


def centroid(points: Array) -> Array:
    """Centroid (2,) of the area inside a polygon (n, 2)."""
    after = np.roll(points, -1, axis=0)
    return ((points + after) * _cross(points, after)[:, None]).sum(axis=0) / (6.0 * area(points))


def crosses_itself(points: Array) -> bool:
    """Whether two sides of a polygon (n, 2) that are not neighbours meet."""
    start, end = points, np.roll(points, -1, axis=0)
    count = len(points)
    for one in range(count):
        for other in range(one + 2, count - (one == 0)):
            along, across = end[one] - start[one], end[other] - start[other]
            sides = [_cross(along, place - start[one]) for place in (start[other], end[other])]
            others = [_cross(across, place - start[other]) for place in (start[one], end[one])]
            # Sides in one line are apart unless the ends of one are beside those of the other.
            ends = [[start[one], end[one]], [start[other], end[other]]]
            places = np.sort(np.array(ends) @ along, axis=1)
            apart = places[0, 1] < places[1, 0] or places[1, 1] < places[0, 0]
            if sides[0] * sides[1] <= 0.0 and others[0] * others[1] <= 0.0 and not (apart and not any(sides)):
                return True
    return False


def _rotation(angle: float) -> Array:
    cosine, sine = math.cos(angle), math.sin(angle)
    return np.array([[cosine, -sine], [sine, cosine]])


def _cross(a: Array, b: Array) -> Array:
    return a[..., 0] * b[..., 1] - a[..., 1] * b[..., 0]
