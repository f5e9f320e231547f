"""The surface of a deformed body, and whether it goes through itself."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pneumorph.mesh import TetMesh, unfold

if TYPE_CHECKING:
    import ipctk

FLAT = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""The flat triangles of a six-node triangle, with its orientation."""


class Skin:
    """The surface of a whole body as four flat triangles for every face, from the mesh of the body or of its part."""

    def __init__(self, mesh: TetMesh):
        image = unfold(mesh)
        faces = np.concatenate(list(image.mesh.faces.values()))
        nodes, corners = np.unique(faces[:, FLAT].reshape(-1, 3), return_inverse=True)
        self._source, self._turn = image.source[nodes], image.turn[nodes]
        self._mesh = collision_mesh(self._places(mesh.points), corners.reshape(-1, 3))

    def intersects_itself(self, x: np.ndarray) -> bool:
        """Whether it goes through itself with the nodes of the mesh at x (N, 3): if an edge goes through a triangle."""
        import ipctk

        return bool(ipctk.has_intersections(self._mesh, self._places(x)))

    def _places(self, x: np.ndarray) -> np.ndarray:
        return np.asfortranarray(np.einsum("nij,nj->ni", self._turn, x[self._source]))


def collision_mesh(places: np.ndarray, triangles: np.ndarray) -> ipctk.CollisionMesh:
    """Triangles (T, 3) between places (N, 3), with their edges."""
    # Imported where it is used, which takes a while.
    import ipctk

    edges = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    return ipctk.CollisionMesh(places, edges.astype(np.int32), triangles.astype(np.int32))
