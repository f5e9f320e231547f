"""Signed distances from a closed surface of triangles."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from pneumorph.cad.boxes import Boxes, boxes_of, nearest

Floats = NDArray[np.float64]

TOUCHING = 1e-4
"""mm; STL files have coordinates of seven digits."""

_ON_EDGE = 1e-9
"""Share of a triangle's corners in places up to which these are on its edges."""


@dataclass(frozen=True, eq=False)
class Space:
    """What is within a closed surface: points (n, 3) in mm and triangles (m, 3), normals outwards."""

    points: Floats
    triangles: NDArray[np.integer]

    @cached_property
    def corners(self) -> Floats:
        """Of the triangles, (m, 3, 3) in mm."""
        return self.points[self.triangles]

    @cached_property
    def _boxes(self) -> Boxes:
        return boxes_of(self.points, self.triangles)

    @cached_property
    def _normals(self) -> Floats:
        """Normals (m, 7, 3) of each triangle, of its corners and of its edges 01, 12, 20.

        Those of corners are means by angles, those of edges by halves: what is beyond them is outside, whichever of the
        triangles around is found as the nearest (Bærentzen and Aanæs 2005).
        """
        corners, number = self.corners, self.triangles
        ahead = np.roll(corners, -1, axis=1) - corners
        lengths = np.linalg.norm(ahead, axis=2)
        flat = np.cross(ahead[:, 0], ahead[:, 1])
        flat /= np.linalg.norm(flat, axis=1, keepdims=True)
        turn = -np.einsum("tkc,tkc->tk", ahead, np.roll(ahead, 1, axis=1)) / (lengths * np.roll(lengths, 1, axis=1))
        angle = np.arccos(np.clip(turn, -1.0, 1.0))
        at = np.zeros_like(self.points)
        np.add.at(at, number, angle[:, :, None] * flat[:, None])
        ends = np.sort(np.stack([number, np.roll(number, -1, axis=1)], axis=2), axis=2).reshape(-1, 2)
        _, edge = np.unique(ends, axis=0, return_inverse=True)
        along = np.zeros((edge.max() + 1, 3))
        np.add.at(along, edge.ravel(), np.repeat(flat, 3, axis=0))
        found = np.concatenate([flat[:, None], at[number], along[edge.reshape(-1, 3)]], axis=1)
        return found / np.maximum(np.linalg.norm(found, axis=2, keepdims=True), 1e-300)

    def _nearest(self, x: Floats) -> tuple[Floats, Floats]:
        """The nearest places (n, 3) to points (n, 3), and the normals (n, 3) there."""
        found = nearest(self._boxes, x)
        origin, one, other = np.moveaxis(self.corners[found.triangle], 1, 0)
        e, f, d = one - origin, other - origin, found.place - origin
        a, b, c = (np.einsum("ni,ni->n", *pair) for pair in ((e, e), (e, f), (f, f)))
        g, h = (np.einsum("ni,ni->n", each, d) for each in (e, f))
        v, w = (c * g - b * h) / (a * c - b * b), (a * h - b * g) / (a * c - b * b)
        share = np.column_stack([1.0 - v - w, v, w])
        # 0 for the triangle, from 1 on for corners, from 4 on for edges, of which 01 is opposite to corner 2.
        kind = np.where(share.min(axis=1) < _ON_EDGE, 4 + (share.argmin(axis=1) + 1) % 3, 0)
        kind = np.where(share.max(axis=1) > 1.0 - _ON_EDGE, 1 + share.argmax(axis=1), kind)
        return found.place, self._normals[found.triangle, kind]

    def beyond(self, x: Floats) -> Floats:
        """How far points (..., 3) are beyond it, mm; negative within, and within `TOUCHING` of the surface."""
        places = x.reshape(-1, 3)
        near, normal = self._nearest(places)
        away = places - near
        sign = np.where(np.einsum("ni,ni->n", away, normal) < 0.0, -1.0, 1.0)
        return (sign * np.linalg.norm(away, axis=1)).reshape(x.shape[:-1]) - TOUCHING

    def outward(self, x: Floats) -> Floats:
        """Unit vectors (n, 3) in which points (n, 3) leave it the fastest."""
        near, normal = self._nearest(x)
        away, beyond = x - near, self.beyond(x) + TOUCHING
        far = np.abs(beyond) > TOUCHING
        return np.where(far[:, None], away / np.where(far, beyond, 1.0)[:, None], normal)
