"""The cut faces of a sector of a body: a triangulated surface through the axis, and its image turned by one sector.

Where a sector begins on the surfaces is no plane curve, since control points move freely. The first face is therefore
triangulated in the distance from the axis and the height, and its inner vertices get the angle that is harmonic there.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import spsolve

from pneumorph.errors import MeshError
from pneumorph.mesh.cut import Faces, filled, line, open_edges
from pneumorph.mesh.surface import UNLIKE
from pneumorph.mesh.tets import TURNED
from pneumorph.problem.symmetry import sector, turned

_WIDEST = 2.5  # rad; beyond this angle from the middle of a cut its edges may be more than half a turn apart


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
        If the body is not symmetric, or the edges of the first face cross when seen along the circles around the axis.
    """
    if not len(seam):
        raise MeshError(UNLIKE)
    first, last = seam.T
    rotation, edges = turned(turns)[1], open_edges(faces)
    nodes = nodes.copy()
    axis = np.setdiff1d(edges, seam)
    nodes[axis, :2] = 0.0
    rim = edges[np.isin(edges[:, 2], first)]
    upwards, nodes = line(axis, nodes, size, 2)
    axis = np.union1d(axis, upwards)
    # Seen from outside, the sector is left of its axis going down in the first face.
    rim = np.concatenate([rim, upwards[:, [1, 0, 2]]])

    across = nodes[:, 0] + 1j * nodes[:, 1]
    flat = np.column_stack([np.abs(across), np.zeros(len(nodes)), nodes[:, 2]])
    known = len(nodes)
    triangles, flat = filled(rim, flat, 1, size)
    added = np.arange(known, len(flat))
    middle = np.exp(1j * np.angle(across[first].sum()))
    angle = np.angle(across / middle)
    if np.abs(angle[first]).max() > _WIDEST:
        raise MeshError("a cut between sectors goes more than half around the axis")
    angle = _harmonic(triangles[:, :3], flat, np.concatenate([angle, np.zeros(len(added))]), first)
    places = flat[:, 0] * np.exp(1j * angle) * middle
    nodes = np.concatenate([nodes, np.column_stack([places.real, places.imag, flat[:, 2]])[added]])
    # Edges inside are straight.
    inner = np.isin(triangles[:, 3:], added)
    ends = triangles[:, [[0, 1], [1, 2], [2, 0]]][inner]
    nodes[triangles[:, 3:][inner]] = nodes[ends].mean(axis=1)

    image, count = np.arange(len(nodes)), len(nodes)
    image[first], image[added] = last, count + np.arange(len(added))
    nodes = np.concatenate([nodes, nodes[added]])
    off = np.concatenate([first, added])
    nodes[image[off]] = nodes[off] @ rotation.T
    return faces | {sector(turns): triangles, f"{sector(turns)} image": image[triangles[:, TURNED]]}, nodes


def _harmonic(triangles: np.ndarray, flat: np.ndarray, angle: np.ndarray, given: np.ndarray) -> np.ndarray:
    """Angles at all corners of triangles (nf, 3) that are harmonic between those that are given; others stay."""
    corners = flat[triangles][..., [0, 2]]
    sides = np.roll(corners, -1, axis=1) - np.roll(corners, -2, axis=1)
    area = sides[:, 0, 0] * sides[:, 1, 1] - sides[:, 0, 1] * sides[:, 1, 0]
    blocks = np.einsum("fai,fbi->fab", sides, sides) / (2.0 * area)[:, None, None]
    rows, columns = np.repeat(triangles, 3, axis=1), np.tile(triangles, (1, 3))
    stiffness = sparse.csr_array((blocks.ravel(), (rows.ravel(), columns.ravel())), (len(angle), len(angle)))
    inner = np.setdiff1d(triangles, given)
    found = angle.copy()
    if len(inner):
        held = np.intersect1d(triangles, given)
        known = stiffness[inner][:, held] @ angle[held]
        found[inner] = spsolve(sparse.csc_array(stiffness[inner][:, inner]), -known)
    return found
