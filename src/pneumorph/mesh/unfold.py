"""The whole mesh of a symmetric body from that of its part, by adding the images."""

from __future__ import annotations

from collections.abc import Collection
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mesh.tets import TURNED, Covered, TetMesh, chambers_of, is_cut
from pneumorph.symmetry.operations import MIRRORS, NORMALS, turned
from pneumorph.symmetry.part import turns_of

# Nodes of mirror images are reordered so that the orientation is preserved.
_TET_IMAGE = [0, 2, 1, 3, 6, 5, 4, 7, 9, 8]
_CAP_IMAGE = [0, 2, 1, 3]


@dataclass(frozen=True, eq=False)
class Unfolded:
    """The exactly symmetric mesh of which a mesh is a part.

    Attributes
    ----------
    mesh : TetMesh
        The nodes of the part come first, then those of its images.
    source : (N,) int
        For every node, the node of the part that it is or whose image it is.
    turn : (N, 3, 3) float
        The operation that maps vectors at the source node to those here.
    copies : int
        How often it contains the part.
    """

    mesh: TetMesh
    source: np.ndarray
    turn: np.ndarray
    copies: int

    def vectors(self, part: np.ndarray) -> np.ndarray:
        """Nodal vectors (N, 3) on the unfolded mesh from those on the part (n, 3)."""
        return _applied(self.turn, part[self.source])


def unfold(mesh: TetMesh, keep: Collection[str] = ()) -> Unfolded:
    """Unfold a mesh about the cuts of its part, but for those to `keep`; a whole mesh is returned unchanged."""
    n = len(mesh.points)
    unfolded = Unfolded(mesh, np.arange(n), np.tile(np.eye(3), (n, 1, 1)), 1)
    for cut in mesh.part:
        if cut not in keep:
            step = _doubled(unfolded.mesh, cut) if cut in MIRRORS else _joined(mesh)
            source, turn = unfolded.source[step.source], step.turn @ unfolded.turn[step.source]
            unfolded = Unfolded(step.mesh, source, turn, step.copies * unfolded.copies)
    return unfolded


def _doubled(mesh: TetMesh, plane: str) -> Unfolded:
    """The mesh and its image in one of its mirror planes."""
    n, cut = len(mesh.points), mesh.mirror_nodes(plane)
    doubled = np.setdiff1d(np.arange(n), cut)
    image = np.arange(n)
    image[doubled] = n + np.arange(len(doubled))
    source = np.concatenate([np.arange(n), doubled])
    turn = np.tile(np.eye(3), (len(source), 1, 1))
    turn[n:] = np.diag(MIRRORS[plane])
    points = mesh.points.copy()
    points[cut, NORMALS[plane]] = 0.0
    faces = {}
    for name, triangles in mesh.faces.items():
        mirrored = image[triangles[:, TURNED]]
        own, other = _shared_out(mesh, name, plane)
        if other:
            faces |= {f"chamber {' '.join(own)}": triangles, f"chamber {' '.join(other)}": mirrored}
        elif name != f"mirror {plane}":
            faces[name] = np.concatenate([triangles, mirrored])
    caps = {}
    for name, nodes in mesh.caps.items():
        mirrored = image[nodes[:, _CAP_IMAGE]]
        own, other = _shared_out(mesh, f"chamber {name}", plane)
        if other:
            caps |= {" ".join(own): nodes, " ".join(other): mirrored}
        else:
            caps[name] = np.concatenate([nodes, mirrored])
    tets = np.concatenate([mesh.tets, image[mesh.tets[:, _TET_IMAGE]]])
    unfolded = _unfolded(mesh, points, tets, faces, [np.arange(n), image], source, turn)
    return replace(unfolded, mesh=replace(unfolded.mesh, caps=caps))


def _joined(mesh: TetMesh) -> Unfolded:
    """All sectors of the body of which the mesh is one."""
    turns, n = turns_of(mesh.part), len(mesh.points)
    (second, first), axis = mesh.tied, mesh.axis
    new = np.setdiff1d(np.arange(n), np.concatenate([first, axis]))
    images, sources, number = [np.arange(n)], [np.arange(n)], n
    for copy in range(1, turns):
        image = np.arange(n)
        image[first] = images[-1][second]
        # The last sector ends where the first one begins.
        added = new if copy < turns - 1 else np.setdiff1d(new, second)
        image[second] = first
        image[added] = number + np.arange(len(added))
        number += len(added)
        images.append(image)
        sources.append(added)
    turn = np.repeat(turned(turns), [len(each) for each in sources], axis=0)
    faces = {}
    for name, triangles in mesh.faces.items():
        names = chambers_of(name)
        if len(names) > 1:
            faces |= {f"chamber {own}": image[triangles] for own, image in zip(names, images, strict=True)}
        elif not is_cut(name):
            faces[name] = np.concatenate([image[triangles] for image in images])
    tets = np.concatenate([image[mesh.tets] for image in images])
    return _unfolded(mesh, mesh.points, tets, faces, images, np.concatenate(sources), turn)


def _unfolded(
    mesh: TetMesh,
    points: np.ndarray,
    tets: np.ndarray,
    faces: dict[str, np.ndarray],
    images: list[np.ndarray],
    source: np.ndarray,
    turn: np.ndarray,
) -> Unfolded:
    """The unfolded mesh, where the nodes of every copy of the part have numbers `images`."""
    count = len(mesh.tets)
    starts = count * np.arange(len(images))[:, None]
    regions = {name: (starts + part).ravel() for name, part in mesh.regions.items()}
    covers = {
        name: Covered(np.concatenate([image[own.nodes] for image in images]), np.tile(own.points, (len(images), 1, 1)))
        for name, own in mesh.covers.items()
    }
    halved = None if mesh.halved is None else np.tile(mesh.halved, len(images))
    whole = TetMesh(_applied(turn, points[source]), tets, faces, regions, covers, halved=halved)
    return Unfolded(whole, source, turn, len(images))


def _applied(turn: np.ndarray, vectors: np.ndarray) -> np.ndarray:
    return np.einsum("nij,nj->ni", turn, vectors)


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
