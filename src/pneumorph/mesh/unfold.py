"""The whole mesh of a symmetric body from that of its half or quarter, by adding the mirror images."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass

import numpy as np

from pneumorph.mesh.tets import Covered, TetMesh, chambers_of
from pneumorph.problem.symmetry import MIRRORS, NORMALS

# Nodes of images are reordered so that the orientation is preserved.
_TET_IMAGE = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
_TRIANGLE_IMAGE = [0, 2, 1, 5, 4, 3]


@dataclass(frozen=True, eq=False)
class Unfolded:
    """The exactly symmetric mesh of which a mesh is a half or a quarter.

    Attributes
    ----------
    mesh : TetMesh
        The nodes of the part come first, then those of its images.
    source : (N,) int
        For every node, the node of the part that it is or whose image it is.
    sign : (N, 3) float
        Signs by which the components of vectors at the source node are multiplied.
    """

    mesh: TetMesh
    source: np.ndarray
    sign: np.ndarray

    def vectors(self, part: np.ndarray) -> np.ndarray:
        """Nodal vectors (N, 3) on the unfolded mesh from those on the part (n, 3)."""
        return self.sign * part[self.source]


def unfold(mesh: TetMesh, keep: Collection[str] = ()) -> Unfolded:
    """Unfold a mesh about its mirror planes, but for those to `keep`; a whole mesh is returned unchanged."""
    n = len(mesh.points)
    found = Unfolded(mesh, np.arange(n), np.ones((n, 3)))
    for plane in mesh.mirrors:
        if plane not in keep:
            step = _doubled(found.mesh, plane)
            found = Unfolded(step.mesh, found.source[step.source], step.sign * found.sign[step.source])
    return found


def _doubled(mesh: TetMesh, plane: str) -> Unfolded:
    """The mesh and its image in one of its mirror planes."""
    n, cut = len(mesh.points), mesh.mirror_nodes(plane)
    doubled = np.setdiff1d(np.arange(n), cut)
    image = np.arange(n)
    image[doubled] = n + np.arange(len(doubled))
    source = np.concatenate([np.arange(n), doubled])
    sign = np.ones((len(source), 3))
    sign[n:] = MIRRORS[plane]
    points = mesh.points.copy()
    points[cut, NORMALS[plane]] = 0.0
    faces = {}
    for name, triangles in mesh.faces.items():
        mirrored = image[triangles[:, _TRIANGLE_IMAGE]]
        own, other = _shared_out(mesh, name, plane)
        if other:
            faces |= {f"chamber {' '.join(own)}": triangles, f"chamber {' '.join(other)}": mirrored}
        elif name != f"mirror {plane}":
            faces[name] = np.concatenate([triangles, mirrored])
    tets = np.concatenate([mesh.tets, image[mesh.tets[:, _TET_IMAGE]]])
    regions = {name: np.concatenate([part, len(mesh.tets) + part]) for name, part in mesh.regions.items()}
    covers = {
        name: Covered(np.concatenate([own.nodes, image[own.nodes]]), np.concatenate([own.points, own.points]))
        for name, own in mesh.covers.items()
    }
    return Unfolded(TetMesh(sign * points[source], tets, faces, regions, covers), source, sign)


def _shared_out(mesh: TetMesh, face: str, plane: str) -> tuple[list[str], list[str]]:
    """The chambers that a face represents on this side of a mirror plane, and those on the other side.

    The number of a name in the order of `TetMesh.faces` has a binary digit for every plane that does not cut the face.
    """
    names = chambers_of(face)
    uncut = [each for each in mesh.mirrors if not np.isin(mesh.faces[face], mesh.mirror_nodes(each)).any()]
    if len(names) < 2 or plane not in uncut:
        return list(names), []
    digit = 1 << uncut.index(plane)
    own = [name for number, name in enumerate(names) if not number & digit]
    return own, [name for name in names if name not in own]
