"""The surface of a deformed body, whether it self-intersects, and where."""

from __future__ import annotations

from functools import cache, cached_property
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from pneumorph.mesh import TetMesh, Unfolded, unfold

if TYPE_CHECKING:
    import ipctk

PARTS, MOST = (2, 4, 8), 1_000_000
"""Into how many parts the edges of faces are divided, one after another while their flat triangles intersect: coarse
ones of the two sides of a thin wall do where the wall is sound. No more triangles than the second are made, beyond the
coarsest ones."""


ROUNDING = 1e-9
"""Distance from a plane over the length of an edge, up to which its end is in that plane."""


class Places(NamedTuple):
    """Places on faces: the six nodes (…, 6) of the face that each is on, and their weights (…, 6)."""

    nodes: np.ndarray
    weights: np.ndarray

    def at(self, x: np.ndarray) -> np.ndarray:
        """Where they are (…, 3) if nodes are at x (N, 3)."""
        return np.einsum("...k,...kc->...c", self.weights, x[self.nodes])

    def only(self, some: np.ndarray | int) -> Places:
        """Some of them."""
        return Places(self.nodes[some], self.weights[some])


class Skin:
    """The surface of a whole body as flat triangles, from the mesh of the body or of its part."""

    def __init__(self, mesh: TetMesh):
        self._mesh = mesh
        self._divided: dict[int, _Divided] = {}

    @cached_property
    def whole(self) -> Unfolded:
        """The mesh of the whole body."""
        return unfold(self._mesh)

    @cached_property
    def _faces(self) -> np.ndarray:
        return np.concatenate(list(self.whole.mesh.faces.values()))

    @property
    def _fine_enough(self) -> list[int]:
        return [parts for parts in PARTS if parts == PARTS[0] or len(self._faces) * parts**2 <= MOST]

    def intersects_itself(self, x: np.ndarray) -> bool:
        """Whether it self-intersects with the nodes of the mesh at x (N, 3): if an edge goes through a triangle."""
        places = self.whole.vectors(x)
        return all(self._flat(parts).intersect(places) for parts in self._fine_enough)

    def crossings(self, x: np.ndarray) -> Places:
        """Where it self-intersects with the nodes of the mesh at x (N, 3), on both sides: places of the whole body.

        The first (k, 2) of each pair is an end of an edge that goes through a triangle, the second a corner of that.
        """
        places = self.whole.vectors(x)
        found = self._flat(PARTS[0]).crossings(places)
        beside = self._faces[np.isin(self._faces, found.nodes).any(axis=1)]
        if not len(beside):
            return found
        finer = _Divided(beside, self._fine_enough[-1], self.whole.vectors(self._mesh.points)).crossings(places)
        return finer if len(finer.nodes) else found

    def near(self, place: np.ndarray, reach: float, X: np.ndarray, size: float) -> Places:
        """The corners (n, 3) of flat triangles of the whole body whose middle is near a place, at least of one.

        Parameters
        ----------
        place : (3,) in the body at rest, mm.
        reach : mm.
        X : (N, 3) nodes of the mesh at rest, mm.
        size : of faces, mm: they are divided into triangles that are small beside the reach, as far as possible.
        """
        parts = next((parts for parts in PARTS if size <= 0.5 * reach * parts), PARTS[-1])
        at_rest = self.whole.vectors(X)
        away = np.linalg.norm(at_rest[self._faces].mean(axis=1) - place, axis=1)
        faces = self._faces[away <= max(reach, away.min()) + 2.0 * size]
        _, triangles, shape = _lattice(parts)
        corners = (len(faces), len(triangles), 3, 6)
        every = Places(np.broadcast_to(faces[:, None, None], corners), np.broadcast_to(shape[triangles], corners))
        away = np.linalg.norm(every.at(at_rest).mean(axis=2) - place, axis=2)
        return every.only(away <= max(reach, away.min()))

    def _flat(self, parts: int) -> _Divided:
        if parts not in self._divided:
            self._divided[parts] = _Divided(self._faces, parts, self.whole.vectors(self._mesh.points))
        return self._divided[parts]


class _Divided:
    """Six-node faces (F, 6) of nodes at x (N, 3) as flat triangles between points of the curved surface."""

    def __init__(self, faces: np.ndarray, parts: int, x: np.ndarray):
        share, triangles, shape = _lattice(parts)
        # The same point of two faces has the same shares of the same corners.
        shares = np.where(share > 0, faces[:, None, :3].astype(np.int64) * (parts + 1) + share, -1)
        key = np.sort(shares, axis=2).reshape(-1, 3)
        first, number = _distinct(key)
        face, point = np.divmod(first, len(share))
        self._nodes, self._weights = faces[face], shape[point]
        flat = number.reshape(len(faces), -1)[:, triangles].reshape(-1, 3)
        self._mesh = collision_mesh(self._places(x), flat)

    def _places(self, x: np.ndarray) -> np.ndarray:
        return np.asfortranarray(np.einsum("pk,pkc->pc", self._weights, x[self._nodes]))

    def intersect(self, x: np.ndarray) -> bool:
        import ipctk

        return bool(ipctk.has_intersections(self._mesh, self._places(x)))

    def crossings(self, x: np.ndarray) -> Places:
        import ipctk

        places, search = self._places(x), ipctk.LBVH()
        edges, triangles = self._mesh.edges, self._mesh.faces
        search.build(places, edges, triangles, 0.0)
        found = search.detect_edge_face_candidates()
        edge, face = np.array([(each.edge_id, each.face_id) for each in found], int).reshape(-1, 2).T
        edge, face = edges[edge], triangles[face]
        cross = ~(edge[:, :, None] == face[:, None]).any(axis=(1, 2)) & _pass_through(places[edge], places[face])
        both = np.column_stack([edge[cross, 0], face[cross, 0]])
        return Places(self._nodes[both], self._weights[both])


def _pass_through(edges: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Whether edges (n, 2, 3) pass through triangles (n, 3, 3); those in one plane, but for rounding, do not."""
    (p, q), (a, b, c) = np.moveaxis(edges, 1, 0), np.moveaxis(triangles, 1, 0)
    along, normal = q - p, np.cross(b - a, c - a)
    ends = np.array([np.einsum("nc,nc->n", normal, end - a) for end in (p, q)])
    least = ROUNDING * np.linalg.norm(normal, axis=1) * np.linalg.norm(along, axis=1)
    sides = np.array(
        [np.einsum("nc,nc->n", along, np.cross(one - p, other - p)) for one, other in ((a, b), (b, c), (c, a))]
    )
    through = (sides > 0.0).all(axis=0) | (sides < 0.0).all(axis=0)
    return through & (np.abs(ends) > least).all(axis=0) & (ends[0] * ends[1] < 0.0)


@cache
def _lattice(parts: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points of a triangle divided evenly.

    Returns their barycentric coordinates (L, 3) times `parts`, the small triangles (parts², 3) between them, and the
    shape functions (L, 6) of a six-node triangle there.
    """
    share = np.array([(parts - i - j, i, j) for i in range(parts + 1) for j in range(parts + 1 - i)])
    number = {(i, j): row for row, (_, i, j) in enumerate(share.tolist())}
    triangles = [
        [number[corner] for corner in small]
        for i, j in number
        for small in (((i, j), (i + 1, j), (i, j + 1)), ((i + 1, j), (i + 1, j + 1), (i, j + 1)))
        if all(corner in number for corner in small)
    ]
    at = share / parts
    shape = np.concatenate([at * (2.0 * at - 1.0), 4.0 * at * np.roll(at, -1, axis=1)], axis=1)
    return share, np.array(triangles), shape


def collision_mesh(places: np.ndarray, triangles: np.ndarray) -> ipctk.CollisionMesh:
    """Triangles (T, 3) between places (N, 3), with their edges."""
    # Imported where it is used, which takes a while.
    import ipctk

    edges = np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    edges = edges[_distinct(edges)[0]]
    return ipctk.CollisionMesh(places, edges.astype(np.int32), triangles.astype(np.int32))


def _distinct(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where each distinct one of integer rows (n, k) is first, in their order, and which of these each row is.

    `np.unique` of rows takes three times as long.
    """
    order = np.lexsort(rows.T[::-1])
    new = np.ones(len(rows), dtype=bool)
    new[1:] = (np.diff(rows[order], axis=0) != 0).any(axis=1)
    number = np.empty(len(rows), dtype=np.int64)
    number[order] = np.cumsum(new) - 1
    return order[new], number
