"""The whole body that half a mesh stands for: its image in the mirror plane joined to it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.mesh.tets import TetMesh, chambers_of
from pneumorph.problem.symmetry import MIRRORS, NORMALS

# Images are numbered so that their orientation is that of their originals.
_TET_IMAGE = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
_TRIANGLE_IMAGE = [0, 2, 1, 5, 4, 3]


@dataclass(frozen=True, eq=False)
class Unfolded:
    """A whole mesh, exactly symmetric.

    Attributes
    ----------
    mesh : TetMesh
        The nodes of the half come first.
    source : (N,) int
        The node of the half that every node is, or is the image of.
    sign : (N, 3) float
        What is made of a vector's components on the way.
    """

    mesh: TetMesh
    source: np.ndarray
    sign: np.ndarray

    def vectors(self, half: np.ndarray) -> np.ndarray:
        """Vectors (N, 3) from those on the half (n, 3)."""
        return self.sign * half[self.source]


def unfolded(mesh: TetMesh) -> Unfolded:
    """The whole body of half a mesh; a whole mesh comes back as it is."""
    n = len(mesh.points)
    if mesh.mirror is None:
        return Unfolded(mesh, np.arange(n), np.ones((n, 3)))
    doubled = np.setdiff1d(np.arange(n), mesh.mirror_nodes)
    image = np.arange(n)
    image[doubled] = n + np.arange(len(doubled))
    source = np.concatenate([np.arange(n), doubled])
    sign = np.ones((len(source), 3))
    sign[n:] = MIRRORS[mesh.mirror]
    points = mesh.points.copy()
    points[mesh.mirror_nodes, NORMALS[mesh.mirror]] = 0.0
    faces = {}
    for name, triangles in mesh.faces.items():
        mirrored = image[triangles[:, _TRIANGLE_IMAGE]]
        match chambers_of(name):
            case (one, other):
                faces |= {f"chamber {one}": triangles, f"chamber {other}": mirrored}
            case _ if not name.startswith("mirror "):
                faces[name] = np.concatenate([triangles, mirrored])
    tets = np.concatenate([mesh.tets, image[mesh.tets[:, _TET_IMAGE]]])
    regions = {name: np.concatenate([part, len(mesh.tets) + part]) for name, part in mesh.regions.items()}
    return Unfolded(TetMesh(sign * points[source], tets, faces, regions), source, sign)
