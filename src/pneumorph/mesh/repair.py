"""Local repair of a tetrahedral mesh in which some elements would be poor once their surface edges are curved.

The usual cause is an element with two faces on one smooth surface: on the curved surface these meet at 180°, and the
element is singular along their common edge. A vertex is inserted into the solid next to such an element, and the
elements around it are replaced by ones that join the vertex to the faces of the resulting hole. Surface triangles are
kept, and with them the symmetries of the surface mesh.
"""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from itertools import count

import numpy as np

from pneumorph.interrupts import stop_if_asked
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.mesh.tets import TET_EDGES, TET_FACES

_GOOD = 0.1  # quality above which an element is not repaired
_ENOUGH = 0.2  # quality of a repair at which the search for a better one stops
_DEPTHS = (0.3, 0.15, 0.5, 0.0, 0.8)  # trial distances into the solid, relative to the size of the poor element
_LARGEST_HOLE = 24  # most elements taken out for a repair: about as many as share a vertex


def repair(
    points: np.ndarray, tets: np.ndarray, triangles: np.ndarray, mid_points: np.ndarray, cut: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Insert vertices next to poor elements and remesh around them.

    Parameters
    ----------
    points : (n, 3) float
    tets : (M, 4) int
        Positively oriented as straight tetrahedra.
    triangles : (nt, 6) int
        Surface triangles with their mid-side nodes.
    mid_points : (…, 3) float
        Positions of all surface nodes on the curved surface.
    cut : (nt,) bool
        Triangles of a cut between sectors: the way into the solid is away from them only at vertices on no surface.

    Returns
    -------
    points : (n + added, 3) float
    tets : (M', 4) int
    """
    curved = _Curved(len(points), triangles, mid_points)
    start_quality = curved.quality(points, tets)
    poor = np.nonzero(start_quality < _GOOD)[0]
    if not len(poor):
        return points, tets
    inward = _inward(points, triangles[:, :3])
    on_surface = np.unique(triangles[~cut, :3])
    inward[on_surface] = _inward(points, triangles[~cut, :3])[on_surface]
    places = np.concatenate([points, np.empty((len(poor), 3))])
    added, numbers = len(points), count(len(tets))
    elements, quality = dict(enumerate(tets.tolist())), dict(enumerate(start_quality.tolist()))
    around = defaultdict(set)
    for number, corners in elements.items():
        for corner in corners:
            around[corner].add(number)

    for k in poor[np.argsort(start_quality[poor], kind="stable")].tolist():
        stop_if_asked()
        if k not in elements:
            continue  # removed by an earlier repair
        repair = _best_vertex(k, added, places, elements, around, inward, curved, quality)
        if repair is None:
            continue
        places[added] = repair.place
        added += 1
        for number in repair.hole:
            for corner in elements.pop(number):
                around[corner].discard(number)
        for corners, worth in zip(repair.filling, repair.quality, strict=True):
            number = next(numbers)
            elements[number], quality[number] = corners, worth
            for corner in corners:
                around[corner].add(number)
    # A hole may have removed a vertex inside the solid; surface vertices keep their numbers.
    used, renumbered = np.unique(list(elements.values()), return_inverse=True)
    return places[used], renumbered.reshape(-1, 4)


@dataclass(frozen=True)
class _Repair:
    """A new vertex, the elements that it replaces (hole), and its own elements (filling) with their quality."""

    place: np.ndarray
    hole: set[int]
    filling: list[list[int]]
    quality: list[float]


class _Curved:
    """Quality of elements whose surface edges are curved and whose other edges are straight."""

    def __init__(self, n: int, triangles: np.ndarray, nodes: np.ndarray) -> None:
        ends = np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
        self.n = 2 * n
        self.keys, first = np.unique(ends[:, 0] * self.n + ends[:, 1], return_index=True)
        self.mids = nodes[triangles[:, 3:].ravel()[first]]

    def quality(self, points: np.ndarray, tets: np.ndarray) -> np.ndarray:
        """`scaled_jacobian` of elements with these corners (M, 4)."""
        one, other = np.moveaxis(np.sort(tets[:, TET_EDGES], axis=2), 2, 0)
        key = one * self.n + other
        at = np.minimum(np.searchsorted(self.keys, key), len(self.keys) - 1)
        straight = (points[one] + points[other]) / 2.0
        middles = np.where((self.keys[at] == key)[:, :, None], self.mids[at], straight)
        nodes = np.concatenate([points[tets], middles], axis=1)
        return scaled_jacobian(nodes.reshape(-1, 3), np.arange(10 * len(tets)).reshape(-1, 10))


def _inward(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Area-weighted normals into the solid at all vertices (n, 3); zero for inner vertices."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    normals = np.zeros_like(points)
    np.add.at(normals, triangles, -np.cross(b - a, c - a)[:, None])
    return normals


def _best_vertex(
    k: int,
    vertex: int,
    places: np.ndarray,
    elements: dict[int, list[int]],
    around: dict[int, set[int]],
    inward: np.ndarray,
    curved: _Curved,
    quality: dict[int, float],
) -> _Repair | None:
    """The best new vertex for the poor element k, or None if none improves the elements around it."""
    corners = elements[k]
    centre = places[corners].mean(axis=0)
    length = np.linalg.norm(places[corners] - centre, axis=1).mean()
    direction = inward[[corner for corner in corners if corner < len(inward)]].sum(axis=0)
    direction /= max(np.linalg.norm(direction), 1e-300)
    best_quality, best = -np.inf, None
    for depth in _DEPTHS:
        places[vertex] = centre + depth * length * direction
        hole = {k}
        while len(hole) <= _LARGEST_HOLE:
            faces = _hull(hole, elements)
            if not _simple(faces):
                break
            filling = np.array([[a, c, b, vertex] for a, b, c in faces])
            filling_quality = curved.quality(places, filling)
            worst = float(filling_quality.min())
            if worst > max(best_quality, min(quality[number] for number in hole)):
                best_quality = worst
                best = _Repair(places[vertex].copy(), hole, filling.tolist(), filling_quality.tolist())
            # Enlarge the hole by the elements beyond every poor face.
            beyond = set()
            for a, b, c in (faces[i] for i in np.nonzero(filling_quality < max(_GOOD, worst + 1e-9))[0]):
                beyond |= around[a] & around[b] & around[c]
            if best_quality >= _ENOUGH or beyond <= hole:
                break
            hole = hole | beyond
        if best_quality >= _ENOUGH:
            break
    return best


def _simple(faces: list[tuple[int, int, int]]) -> bool:
    """Whether faces go once along each edge in each sense; where a hole is pinched, new elements would overlap."""
    edges = [pair for a, b, c in faces for pair in ((a, b), (b, c), (c, a))]
    return 0 < len(edges) == len(set(edges))


def _hull(hole: set[int], elements: dict[int, list[int]]) -> list[tuple[int, int, int]]:
    """Faces between the hole and the other elements, counter-clockwise seen from outside the hole."""
    faces = {}
    for number in hole:
        corners = elements[number]
        for i, j, k in TET_FACES.tolist():
            face = (corners[i], corners[j], corners[k])
            key = frozenset(face)
            if key in faces:
                del faces[key]
            else:
                faces[key] = face
    return list(faces.values())
