"""The surface of a deformed body, and whether it self-intersects."""

from __future__ import annotations

from functools import cache, cached_property
from typing import TYPE_CHECKING

import numpy as np

from pneumorph.mesh import TetMesh, Unfolded, unfold

if TYPE_CHECKING:
    import ipctk

PARTS, MOST = (2, 4, 8), 1_000_000
"""Into how many parts the edges of faces are divided, one after another while their flat triangles intersect: coarse
ones of the two sides of a thin wall do where the wall is sound. No more triangles than the second are made, beyond the
coarsest ones."""


class Skin:
    """The surface of a whole body as flat triangles, from the mesh of the body or of its part."""

    def __init__(self, mesh: TetMesh):
        self._mesh = mesh
        self._divided: dict[int, _Divided] = {}

    @cached_property
    def _image(self) -> Unfolded:
        return unfold(self._mesh)

    @cached_property
    def _faces(self) -> np.ndarray:
        return np.concatenate(list(self._image.mesh.faces.values()))

    def intersects_itself(self, x: np.ndarray) -> bool:
        """Whether it self-intersects with the nodes of the mesh at x (N, 3): if an edge goes through a triangle."""
        places = self._image.vectors(x)
        fine_enough = [parts for parts in PARTS if parts == PARTS[0] or len(self._faces) * parts**2 <= MOST]
        return all(self._flat(parts).intersect(places) for parts in fine_enough)

    def _flat(self, parts: int) -> _Divided:
        if parts not in self._divided:
            self._divided[parts] = _Divided(self._faces, parts, self._image.vectors(self._mesh.points))
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
