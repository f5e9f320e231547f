"""The cut faces of a sector of a body: a triangulated surface through the axis, and its image turned by one sector.

Where a sector begins on the surfaces is no plane curve, since control points move freely, and goes straight through the
walls between them (`slant.py`). The first face is therefore triangulated in a plane of the height and the distance from
the exterior, and its inner vertices get the x and y that are harmonic there.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pneumorph.errors import MeshError
from pneumorph.mesh.cut import Faces, filled, line, open_edges
from pneumorph.mesh.tets import TURNED, chambers_of
from pneumorph.mesh.tube.surface import UNLIKE
from pneumorph.symmetry.part import onwards, sector


def with_sector(faces: Faces, nodes: np.ndarray, seam: np.ndarray, turns: int, size: float) -> tuple[Faces, np.ndarray]:
    """Close the surfaces of a sector by its two cut faces.

    Parameters
    ----------
    faces : dict of (nf, 6) int
        Triangles of the surfaces, which are open where the sector begins and ends.
    nodes : (n, 3) float
    seam : (k, 2) int
        Nodes where it begins, each with its image, where it ends; other nodes of open edges are on the axis.
    turns : int
        Number of sectors.
    size : float
        Desired edge length away from the surfaces, mm.

    Returns
    -------
    faces : dict of (nf, 6) int
        The given ones, ``"sector <turns>"`` and ``"sector <turns> image"``, see `TetMesh.faces`.
    nodes : (n + added, 3) float
        The given ones first; images are exact.

    Raises
    ------
    MeshError
        If the body is not symmetric, the edges of the first face cross in that plane, or a chamber is outside.
    """
    if not len(seam):
        raise MeshError(UNLIKE)
    first, last = seam.T
    rotation, edges = onwards(turns), open_edges(faces)
    nodes = nodes.copy()
    axis = np.setdiff1d(edges, seam)
    nodes[axis, :2] = 0.0
    rim = edges[np.isin(edges[:, 2], first)]
    upwards, nodes = line(axis, nodes, size, 2)
    axis = np.union1d(axis, upwards)
    # Seen from outside, the sector is left of its axis going down in the first face.
    rim = np.concatenate([rim, upwards[:, [1, 0, 2]]])

    flat, known = _flattened(nodes, first[np.isin(first, faces["exterior"])]), len(nodes)
    flat[axis, 0] = 0.0
    triangles, flat = filled(rim, flat, 1, size)
    added = np.arange(known, len(flat))
    nodes = np.concatenate([nodes, flat[added]])
    nodes[:, :2] = _harmonic(triangles[:, :3], flat, nodes[:, :2], np.union1d(first, axis))
    # Edges inside are straight.
    inner = np.isin(triangles[:, 3:], added)
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]][inner]
    nodes[triangles[:, 3:][inner]] = nodes[ends].mean(axis=1)

    image, count = np.arange(len(nodes)), len(nodes)
    image[first], image[added] = last, count + np.arange(len(added))
    nodes = np.concatenate([nodes, nodes[added]])
    off = np.concatenate([first, added])
    nodes[image[off]] = nodes[off] @ rotation.T
    faces = faces | {sector(turns): triangles, f"{sector(turns)} image": image[triangles[:, TURNED]]}
    for name in faces:
        if len(chambers_of(name)) > 1 and not _inside(faces, name, nodes):
            raise MeshError(f"{name} is outside of the sector: the exterior has turned too far around it")
    return faces, nodes


def _inside(faces: Faces, name: str, nodes: np.ndarray) -> bool:
    """Whether a face is inside of the others, by the solid angle that these have from a point of it.

    Of a triangle it is that of van Oosterom and Strackee (1983), IEEE Transactions on Biomedical Engineering 30, 125.
    """
    others = np.concatenate([triangles[:, :3] for other, triangles in faces.items() if other != name])
    a, b, c = np.moveaxis(nodes[others] - nodes[faces[name][0, 0]], 1, 0)
    x, y, z = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    ab, bc, ca = (np.sum(one * other, axis=1) for one, other in ((a, b), (b, c), (c, a)))
    half = np.arctan2(np.linalg.det(np.stack([a, b, c], axis=1)), x * y * z + ab * z + bc * x + ca * y)
    return bool(abs(half.sum()) > np.pi)


def _flattened(nodes: np.ndarray, line: np.ndarray) -> np.ndarray:
    """Nodes (N, 3) in a plane y = 0, where `line`, on the exterior, is as far from the axis as it is.

    Others are at their horizontal distance from it, towards the axis.
    """
    ordered = nodes[line[np.argsort(nodes[line, 2], kind="stable")]]
    across = np.column_stack([np.interp(nodes[:, 2], ordered[:, 2], ordered[:, axis]) for axis in (0, 1)])
    away = np.linalg.norm(across, axis=1) - np.linalg.norm(nodes[:, :2] - across, axis=1)
    return np.column_stack([away, np.zeros(len(nodes)), nodes[:, 2]])


def _harmonic(triangles: np.ndarray, flat: np.ndarray, values: np.ndarray, given: np.ndarray) -> np.ndarray:
    """Values (N, k) at all corners of triangles (nf, 3) that are harmonic between those that are given; others stay."""
    corners = flat[triangles][..., [0, 2]]
    sides = np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)
    area = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    blocks = np.einsum("fai,fbi->fab", sides, sides) / (2.0 * area)[:, None, None]
    rows, columns = np.repeat(triangles, 3, axis=1), np.tile(triangles, (1, 3))
    stiffness = sparse.csr_array((blocks.ravel(), (rows.ravel(), columns.ravel())), (len(values), len(values)))
    inner, held = np.setdiff1d(triangles, given), np.intersect1d(triangles, given)
    harmonic = values.copy()
    if len(inner):
        factor = splu(sparse.csc_matrix(stiffness[inner][:, inner]))
        harmonic[inner] = -factor.solve(stiffness[inner][:, held] @ values[held])
    return harmonic
