"""The distances of places from the parts of a closed surface of triangles: its faces, edges and corners.

A sum over parts with the signs of their count of parts,

    Σ_faces b(d) − Σ_edges b(d) + Σ_corners b(d),

is b of the distance wherever what is near of the surface is a single piece, such as beside a convex or finely divided
surface: the sum of signs is the Euler characteristic of what is within a radius. So it does not depend on how a surface
is divided. In a concave edge b of both sides add up, and the sum has as many derivatives as elsewhere, while the
distance itself has a kink there. It has one continuous derivative, and a second one but where the nearest part becomes
another, as the distance of a box has.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from pneumorph.mechanics.contact.shapes import RigidMesh


class Parts(NamedTuple):
    """Parts of a surface that are near places, each with a place.

    Attributes
    ----------
    place : (R,) number of the place.
    sign : (R,) how often the part counts, after what cancels has been left out.
    distance : (R,) mm.
    away : (R, 3) unit vectors from the part to the place.
    across : (R, 3, 3) projectors on the directions in which the nearest point of the part does not follow the place.
    inside : (R,) whether the place is inside, if no other part is nearer to it.
    """

    place: np.ndarray
    sign: np.ndarray
    distance: np.ndarray
    away: np.ndarray
    across: np.ndarray
    inside: np.ndarray

    @property
    def clear(self) -> bool:
        """Whether no place that is near is inside."""
        order = np.lexsort([self.distance, self.place])
        _, first = np.unique(self.place[order], return_index=True)
        return not self.inside[order[first]].any()


class Facets:
    """A closed surface of triangles, with its `edges` (E, 2)."""

    def __init__(self, mesh: RigidMesh):
        points, triangles = mesh.points, mesh.triangles
        self._points, self._triangles = points, triangles
        sides = triangles[:, [[0, 1], [1, 2], [2, 0]]]
        self.edges, side = np.unique(np.sort(sides.reshape(-1, 2), axis=1), axis=0, return_inverse=True)
        self._sides = side.reshape(-1, 3)
        along = points[self.edges[:, 1]] - points[self.edges[:, 0]]
        self._length = np.linalg.norm(along, axis=1)
        self._along = along / self._length[:, None]
        a, b, c = np.moveaxis(points[triangles], 1, 0)
        normal = np.cross(b - a, c - a)
        self._normal = normal / np.linalg.norm(normal, axis=1, keepdims=True)
        # Out of every side, in the plane of the triangle.
        self._out = np.cross(points[sides[..., 1]] - points[sides[..., 0]], self._normal[:, None])
        # What is on which side of edges and corners is decided by these normals (Bærentzen and Aanæs 2005).
        self._edge_normal, self._corner_normal = np.zeros((len(self.edges), 3)), np.zeros(points.shape)
        np.add.at(self._edge_normal, self._sides, self._normal[:, None])
        one, other = b - a, c - a
        for corner, (start, end) in enumerate(((one, other), (c - b, a - b), (a - c, b - c))):
            angle = np.arctan2(np.linalg.norm(np.cross(start, end), axis=1), np.einsum("ti,ti->t", start, end))
            np.add.at(self._corner_normal, triangles[:, corner], angle[:, None] * self._normal)

    def near(self, places: np.ndarray, reach: float) -> Parts:
        """The parts nearer than `reach` to places (n, 3)."""
        place, face = self._candidates(places, reach)
        triangles, sides = self._triangles[face], self._sides[face]
        # Each pair of a place with an edge or a corner once.
        corner_keys = np.unique(place[:, None] * len(self._points) + triangles)
        edge_keys, of_face = np.unique(place[:, None] * len(self.edges) + sides, return_inverse=True)
        of_face = of_face.reshape(-1, 3)
        at_corner, corner = np.divmod(corner_keys, len(self._points))
        at_edge, edge = np.divmod(edge_keys, len(self.edges))

        from_corner = places[at_corner] - self._points[corner]
        from_start = places[at_edge] - self._points[self.edges[edge, 0]]
        along = np.einsum("ri,ri->r", from_start, self._along[edge])
        within = (along > 0.0) & (along < self._length[edge])
        end = self.edges[edge, np.where(along > 0.0, 1, 0)]
        of_edge = np.searchsorted(corner_keys, at_edge * len(self._points) + end)
        foot = from_start - along[:, None] * self._along[edge]
        from_edge = np.where(within[:, None], foot, from_corner[of_edge])
        from_a = places[place] - self._points[triangles[:, 0]]
        height = np.einsum("ri,ri->r", from_a, self._normal[face])
        beyond = np.einsum("rki,rki->rk", places[place][:, None] - self._points[triangles], self._out[face])
        above = np.all(beyond < 0.0, axis=1)

        # A part whose nearest point is on its rim counts there.
        nearest = np.argmin(np.einsum("ri,ri->r", from_edge, from_edge)[of_face], axis=1)
        passed = np.take_along_axis(of_face, nearest[:, None], axis=1)[:, 0][~above]
        edge_sign = np.bincount(passed, minlength=len(edge)) - 1
        corner_sign = 1 + np.bincount(of_edge[~within], edge_sign[~within], len(corner))
        identity, whole = np.eye(3), np.broadcast_to(np.eye(3), (len(corner), 3, 3))
        parts = [
            (place, above, height[:, None] * self._normal[face], self._normal[face], _outer(self._normal[face])),
            (at_edge, within * edge_sign, foot, self._edge_normal[edge], identity - _outer(self._along[edge])),
            (at_corner, corner_sign, from_corner, self._corner_normal[corner], whole),
        ]
        at, sign, offset, normal, across = map(np.concatenate, zip(*parts, strict=True))
        distance = np.linalg.norm(offset, axis=1)
        counts = (sign != 0) & (distance < reach)
        at, sign, offset, normal, across, distance = (
            each[counts] for each in (at, sign, offset, normal, across, distance)
        )
        away = offset / np.maximum(distance, 1e-300)[:, None]
        return Parts(at, sign.astype(float), distance, away, across, np.einsum("ri,ri->r", away, normal) <= 0.0)

    def _candidates(self, places: np.ndarray, reach: float) -> tuple[np.ndarray, np.ndarray]:
        """Places and triangles with boxes within reach: all pairs nearer than that, and some more."""
        # Imported here because most bodies touch nothing.
        import ipctk

        low, high = self._points.min(axis=0) - reach, self._points.max(axis=0) + reach
        beside = np.flatnonzero(np.all((places > low) & (places < high), axis=1))
        if not len(beside):
            return np.zeros(0, int), np.zeros(0, int)
        together = np.asfortranarray(np.concatenate([places[beside], self._points]))
        search = ipctk.LBVH()
        search.can_vertices_collide = ipctk.make_vertex_patches_filter(np.arange(len(together)) >= len(beside))
        corners = self._points[self._triangles]
        near = np.all(corners.max(axis=1) > places[beside].min(axis=0) - reach, axis=1)
        near = np.flatnonzero(near & np.all(corners.min(axis=1) < places[beside].max(axis=0) + reach, axis=1))
        if not len(near):
            return near, near
        faces = np.asfortranarray((self._triangles[near] + len(beside)).astype(np.int32))
        # Boxes on both sides are made larger by it.
        search.build(together, np.zeros((0, 2), np.int32, order="F"), faces, 0.51 * reach)
        candidates = search.detect_face_vertex_candidates()
        pairs = np.array([(each.vertex_id, each.face_id) for each in candidates], int).reshape(-1, 2)
        return beside[pairs[:, 0]], near[pairs[:, 1]]


def firsts(triangles: np.ndarray) -> np.ndarray:
    """A corner of every connected piece of triangles (T, a)."""
    corners, corner = np.unique(triangles, return_inverse=True)
    corner = corner.reshape(triangles.shape)
    joined = np.broadcast_to(corner[:, :1], corner.shape).ravel(), corner.ravel()
    graph = sparse.coo_array((np.ones(corner.size), joined), shape=(len(corners), len(corners)))
    _, piece = connected_components(graph, directed=False)
    return corners[np.unique(piece, return_index=True)[1]]


def _outer(units: np.ndarray) -> np.ndarray:
    return units[:, :, None] * units[:, None, :]
