"""Triangulation of a plane region with given curved edges: constrained Delaunay, improved by edge swaps.

Missing edges are recovered by swapping the edges that cross them (Sloan 1993, A fast algorithm for generating
constrained Delaunay triangulations). Netgen's planar mesher is not used because it may split the given edges.
"""

from __future__ import annotations

from collections import deque

import numpy as np
from scipy.spatial import Delaunay

from pneumorph.errors import MeshError
from pneumorph.interrupts import stop_if_asked
from pneumorph.mesh.tets import triangle_gradient

_CLEAR = 0.6  # smallest distance of inner vertices from the given edges, in edge lengths
_PASSES = 8  # most passes of swaps and moves; they end before where none makes triangles better
_FLAT = 0.2  # quality below which a triangle between two curved edges gets a vertex beside it
_BESIDE = (0.1, 0.25, 0.5)  # places tried for it, from the triangle's third edge on
_NODES = np.array([[0.0, 0], [1, 0], [0, 1], [0.5, 0], [0.5, 0.5], [0, 0.5]])
_GRADIENTS = triangle_gradient(_NODES)
_FRAME = np.array([[-1.0, -0.9], [1.1, -1], [1, 1.2], [-1.2, 1]])

Edge = tuple[int, int]


def triangulate(
    points: np.ndarray, edges: np.ndarray, middles: np.ndarray, size: float
) -> tuple[np.ndarray, np.ndarray]:
    """Triangulate the region between closed polygons, whose edges are all kept.

    Parameters
    ----------
    points : (n, 2) float
        The polygons' vertices.
    edges : (m, 2) int
        Edges of the polygons; the region lies to the left of each.
    middles : (m, 2) float
        Mid-side nodes of the curved edges; triangles must not degenerate when their edges are curved.
    size : float
        Distance between inner vertices, mm.

    Returns
    -------
    inside : (k, 2) float
        Inner vertices.
    triangles : (nt, 3) int
        Counter-clockwise; the given points are numbered first.

    Raises
    ------
    MeshError
        If edges cross.
    """
    inside = _lattice(points, edges, size)
    everything = np.concatenate([points, inside])
    # Corners of a large frame keep collinear points off the hull, where Delaunay might leave them out.
    middle, reach = everything.mean(axis=0), 10 * np.ptp(everything, axis=0).max()
    framed = np.concatenate([everything, middle + reach * _FRAME])
    plane = _Plane(framed, Delaunay(framed).simplices, edges, middles)
    for a, b in edges.tolist():
        stop_if_asked()
        plane.recover(a, b)
    plane.keep_left_of(edges)
    plane.points = everything
    plane.improve(len(points))
    if plane.fill_ears():
        plane.improve(len(points))
    return plane.points[len(points) :], plane.triangles()


def quality_of(nodes: np.ndarray) -> np.ndarray:
    """Smallest det(dx/dξ) at the nodes (…, 6, 2) of curved triangles, relative to a regular one of the same size."""
    ends = nodes[..., :3, :]
    jacobian = np.einsum("...ai,gak->...gik", nodes, _GRADIENTS)
    sides = ((ends - np.roll(ends, -1, axis=-2)) ** 2).sum((-2, -1)) / 3
    determinant = jacobian[..., 0, 0] * jacobian[..., 1, 1] - jacobian[..., 0, 1] * jacobian[..., 1, 0]
    return determinant.min(axis=-1) / (np.sqrt(0.75) * sides)


def _lattice(points: np.ndarray, edges: np.ndarray, size: float) -> np.ndarray:
    """Points (k, 2) of a triangular lattice in the region, at some distance from its edges."""
    low, high = points.min(axis=0), points.max(axis=0)
    rows = np.arange(low[1], high[1], size * np.sqrt(0.75))
    columns = np.arange(low[0], high[0] + size, size)
    lattice = np.array([(x - size / 2 * (j % 2), y) for j, y in enumerate(rows) for x in columns])
    a, b = points[edges[:, 0]], points[edges[:, 1]]
    along = b - a
    # A point is inside if a ray from it to the right crosses an odd number of edges.
    below = (a[:, 1] <= lattice[:, 1:]) != (b[:, 1] <= lattice[:, 1:])
    rise = np.where(along[:, 1] == 0, 1.0, along[:, 1])
    ahead = lattice[:, :1] < a[:, 0] + (lattice[:, 1:] - a[:, 1]) / rise * along[:, 0]
    within = (below & ahead).sum(axis=1) % 2 == 1
    offset = lattice[:, None] - a
    part = np.clip((offset * along).sum(-1) / (along**2).sum(-1), 0, 1)
    distance = np.linalg.norm(offset - part[..., None] * along, axis=-1).min(axis=1)
    return lattice[within & (distance > _CLEAR * size)]


class _Plane:
    """A triangulation; `apex` gives for every directed edge the third corner of the triangle on its left."""

    def __init__(self, points: np.ndarray, triangles: np.ndarray, edges: np.ndarray, middles: np.ndarray):
        self.points = points
        self._curved = {tuple(sorted(edge)): middle for edge, middle in zip(edges.tolist(), middles, strict=True)}
        self._quality: dict[tuple[int, ...], float] = {}
        self.apex: dict[Edge, int] = {}
        for triangle in triangles.tolist():
            self._add(*triangle)

    def _add(self, a: int, b: int, c: int) -> None:
        self.apex |= {(a, b): c, (b, c): a, (c, a): b}

    def _twice_area(self, a: int, b: int, c: int) -> float:
        (ax, ay), (bx, by), (cx, cy) = self.points[[a, b, c]].tolist()
        return (bx - ax) * (cy - ay) - (by - ay) * (cx - ax)

    def _swap(self, a: int, b: int) -> Edge:
        """Replace the edge between two triangles by the one between their apexes."""
        c, d = self.apex.pop((a, b)), self.apex.pop((b, a))
        self._add(a, d, c)
        self._add(d, b, c)
        return c, d

    def recover(self, p: int, q: int) -> None:
        """Make p–q an edge."""
        if (p, q) in self.apex or (q, p) in self.apex:
            return
        crossing = deque(edge for edge in self.apex if edge[0] < edge[1] and self._cross(p, q, *edge))
        for _ in range(50 * len(crossing) + 1):
            if not crossing:
                break
            a, b = crossing.popleft()
            c, d = self.apex[a, b], self.apex[b, a]
            if self._twice_area(a, d, c) <= 0 or self._twice_area(d, b, c) <= 0:
                crossing.append((a, b))
            elif self._cross(p, q, *self._swap(a, b)):
                crossing.append((c, d))
        if (p, q) not in self.apex and (q, p) not in self.apex:
            raise MeshError("the profiles of two surfaces cross in a plane")

    def _cross(self, p: int, q: int, a: int, b: int) -> bool:
        if len({p, q, a, b}) < 4:
            return False
        sides = self._twice_area(p, q, a) * self._twice_area(p, q, b)
        return sides < 0 and self._twice_area(a, b, p) * self._twice_area(a, b, q) < 0

    def keep_left_of(self, edges: np.ndarray) -> None:
        """Remove all triangles that cannot be reached from the left of the edges without crossing them."""
        fixed = set(map(tuple, edges.tolist()))
        fixed |= {(b, a) for a, b in fixed}
        reached, waiting = {}, list(map(tuple, edges.tolist()))
        while waiting:
            a, b = waiting.pop()
            if (a, b) in reached:
                continue
            if (a, b) not in self.apex:
                raise MeshError("the profiles of two surfaces cross in a plane")
            c = self.apex[a, b]
            for one, other, third in ((a, b, c), (b, c, a), (c, a, b)):
                reached[one, other] = third
                if (one, other) not in fixed:
                    waiting.append((other, one))
        self.apex = reached

    def improve(self, first: int) -> None:
        """Swap edges, and move vertices from index `first` on, until neither makes triangles better."""
        for _ in range(_PASSES):
            stop_if_asked()
            moved = self.swap()
            moved |= self.smooth(first)
            if not moved:
                break

    def fill_ears(self) -> bool:
        """Put a vertex beside each flat triangle between two curved edges; returns whether there was any.

        A curve is smooth where they meet, so that no shape of the third edge makes such a triangle better.
        """
        ears = [
            (a, b, c)
            for (a, b), c in self.apex.items()
            if (b, a) not in self.apex and (c, b) not in self.apex and self.quality(a, b, c) < _FLAT
        ]
        for a, b, c in ears:
            d = self.apex.get((a, c))
            if self.apex.get((a, b)) != c or d is None:
                continue
            new, ring = len(self.points), [(a, b), (b, c), (c, d), (d, a)]
            middle = self.points[[a, c]].mean(axis=0)
            worst, place = min(self.quality(a, b, c), self.quality(a, c, d)), None
            self.points = np.concatenate([self.points, [middle]])
            for part in _BESIDE:
                tried = middle + part * (self.points[d] - middle)
                self._move(new, tried)
                quality = min(self.quality(one, other, new) for one, other in ring)
                if quality > worst:
                    worst, place = quality, tried
            self._move(new, middle if place is None else place)
            if place is None:
                self.points = self.points[:new]
                continue
            del self.apex[c, a], self.apex[a, c]
            for one, other in ring:
                self._add(one, other, new)
        return bool(ears)

    def swap(self) -> bool:
        """Swap edges while that improves the worse of the two adjacent triangles; returns whether any was swapped."""
        swapped = False
        waiting = [edge for edge in self.apex if edge[0] < edge[1]]
        while waiting:
            a, b = waiting.pop()
            if (a, b) not in self.apex or (b, a) not in self.apex:
                continue
            c, d = self.apex[a, b], self.apex[b, a]
            now = min(self.quality(a, b, c), self.quality(b, a, d))
            if min(self.quality(a, d, c), self.quality(d, b, c)) > max(now, 0.0) + 1e-9:
                self._swap(a, b)
                waiting += [(a, d), (d, b), (b, c), (c, a)]
                swapped = True
        return swapped

    def smooth(self, first: int) -> bool:
        """Move vertices from index `first` on to the mean of their neighbours if better; returns whether any moved."""
        around: dict[int, list[Edge]] = {}
        for (a, b), c in self.apex.items():
            if c >= first:
                around.setdefault(c, []).append((a, b))
        moved = False
        for vertex, ring in around.items():
            before, place = min(self.quality(a, b, vertex) for a, b in ring), self.points[vertex].copy()
            kept = self._quality
            self._move(vertex, self.points[[a for a, _ in ring]].mean(axis=0))
            if min(self.quality(a, b, vertex) for a, b in ring) > before + 1e-3:
                moved = True
            else:
                self.points[vertex], self._quality = place, kept
        return moved

    def _move(self, vertex: int, place: np.ndarray) -> None:
        """Move a vertex and forget the qualities of its triangles."""
        self.points[vertex] = place
        self._quality = {key: value for key, value in self._quality.items() if vertex not in key}

    def quality(self, a: int, b: int, c: int) -> float:
        """See `quality_of`."""
        low = min(a, b, c)
        key = (a, b, c) if a == low else (b, c, a) if b == low else (c, a, b)
        if key not in self._quality:
            middles = [self._middle(key[i], key[(i + 1) % 3]) for i in range(3)]
            self._quality[key] = float(quality_of(np.concatenate([self.points[list(key)], middles])))
        return self._quality[key]

    def _middle(self, a: int, b: int) -> np.ndarray:
        given = self._curved.get((min(a, b), max(a, b)))
        return (self.points[a] + self.points[b]) / 2 if given is None else given

    def triangles(self) -> np.ndarray:
        return np.array([(a, b, c) for (a, b), c in self.apex.items() if a < b and a < c])
