"""The whole mesh of a symmetric body from that of its half, by adding the mirror image."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.mesh.tets import TetMesh, chambers_of
from pneumorph.problem.symmetry import MIRRORS, NORMALS

# Nodes of images are reordered so that the orientation is preserved.
_TET_IMAGE = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
_TRIANGLE_IMAGE = [0, 2, 1, 5, 4, 3]


@dataclass(frozen=True, eq=False)
class Unfolded:
    """The exactly symmetric whole mesh of half a mesh.

    Attributes
    ----------
    mesh : TetMesh
        The whole mesh; the nodes of the half come first.
    source : (N,) int
        For every node, the node of the half that it is or whose image it is.
    sign : (N, 3) float
        Signs by which the components of vectors at the source node are multiplied.
    """

    mesh: TetMesh
    source: np.ndarray
    sign: np.ndarray

    def vectors(self, half: np.ndarray) -> np.ndarray:
        """Nodal vectors (N, 3) on the whole mesh from those on the half (n, 3)."""
        return self.sign * half[self.source]


def unfold(mesh: TetMesh) -> Unfolded:
    """Build the whole mesh from that of a half; a whole mesh is returned unchanged."""
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
