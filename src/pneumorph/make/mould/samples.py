"""Samples of a surface with their normals, and which side of it a point is on."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pneumorph.geometry.tube.surface import TubeSurface, cap_points

Array = NDArray[np.float64]

_APART = 0.5
"""Largest distance in mm between neighbouring samples on the starting surface."""


@dataclass(frozen=True, eq=False)
class Samples:
    """Points of a tube, and of its flat ends.

    Attributes
    ----------
    x, normal : (rows, columns, 3) arrays
        Positions in mm on the tube, and unit normals out of the rubber.
    discs : (m, 3) array
        Points of the flat ends; none for poles.
    """

    x: Array
    normal: Array
    discs: Array

    @cached_property
    def points(self) -> Array:
        """Positions (n, 3) on the tube."""
        return self.x.reshape(-1, 3)

    @property
    def closed(self) -> Array:
        """Positions (n + m, 3) on the tube and its ends."""
        return np.concatenate([self.points, self.discs])

    @cached_property
    def tree(self) -> KDTree:
        """Search tree of the points."""
        return KDTree(self.points)

    def outside(self, points: Array) -> Array:
        """Distances (n,) in mm of points from the surface on the side of its normals; negative on the other side."""
        _, near = self.tree.query(points)
        gap = points - self.points[near]
        side = np.einsum("nc,nc->n", gap, self.normal.reshape(-1, 3)[near])
        return np.copysign(np.linalg.norm(gap, axis=1), side)


def sampled(surface: TubeSurface) -> Samples:
    """Sample a surface evenly."""
    columns, rows = (int(np.ceil(length / _APART)) for length in surface.size)
    q, r = np.arange(columns) / columns, np.linspace(0.0, 1.0, rows + 1)
    if any(surface.poles):
        # At a pole the normal is not a product of tangents.
        base, tip = surface.poles
        r = np.concatenate([r[: 0 if base else 1], (r[1:] + r[:-1]) / 2.0, r[len(r) if tip else -1 :]])
    normal = np.cross(surface.sample(q, r, dq=1), surface.sample(q, r, dr=1))
    normal /= np.maximum(np.linalg.norm(normal, axis=2, keepdims=True), 1e-12)
    count = max(2, int(np.ceil(surface.size[0] / (2.0 * np.pi) / _APART)))
    around, s = (each.ravel() for each in np.meshgrid(q, np.arange(count) / count))
    discs = [cap_points(surface, bool(tip), around, s) for tip, pole in enumerate(surface.poles) if not pole]
    return Samples(surface.sample(q, r), normal, np.concatenate([np.zeros((0, 3)), *discs]))
