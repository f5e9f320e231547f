"""The half-planes along a body between which it is of different rubbers: six-node triangles from its surfaces inwards.

Where the axis is in the solid they meet on it. Their nodes follow the surfaces within them: those on the axis are
between the ends of their part of it, those beside it are where a diffusion equation on the triangles has them.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pneumorph.geometry.tube.wedge import Wedge
from pneumorph.mesh.cut import IN_PLANE, filled, line, open_edges
from pneumorph.mesh.tets import TRIANGLE_RULE, TURNED, TetMesh, triangle_gradient
from pneumorph.problem.regions import REST


@dataclass(frozen=True)
class Inside:
    """What is in half-planes.

    Attributes
    ----------
    triangles : (nf, 6) int
    axis : (n, 3) int
        Edges on the axis, with their mid-side nodes.
    """

    triangles: np.ndarray
    axis: np.ndarray


def with_half_planes(
    solids: dict[str, np.ndarray], nodes: np.ndarray, wedges: Sequence[Wedge], size: float
) -> tuple[dict[str, np.ndarray], np.ndarray, Inside]:
    """Close wedges by the half-planes between them.

    Parameters
    ----------
    solids : dict of (n, 6) int
        Triangles that bound each wedge, normals outwards; open in half-planes, and in mirror planes.
    nodes : (n, 3) float
    wedges : sequence of Wedge, all around the axis
        Without any, nothing is changed.
    size : float
        Desired edge length away from the surfaces, mm.

    Returns
    -------
    solids : dict of (n, 6) int
        Still open in mirror planes.
    nodes : (n + added, 3) float
        The given ones first; those in half-planes are moved into them exactly.
    inside : Inside

    Raises
    ------
    MeshError
        If profiles cross.
    """
    nodes, closed = nodes.copy(), dict(solids)
    triangles, axis = [np.zeros((0, 6), int)], np.zeros((0, 3), int)
    for number, wedge in enumerate(wedges):
        before, after = str((number - 1) % len(wedges)), str(number)
        cosine, sine = math.cos(wedge.start), math.sin(wedge.start)
        # So turned that the half-plane is y = 0, x > 0.
        turn = np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]])
        local = nodes @ turn
        edges = open_edges({"": solids[after]})
        x, y, _ = np.moveaxis(local[edges], 2, 0)
        rim = edges[((np.abs(y) < IN_PLANE) & (x > -IN_PLANE)).all(axis=1)]
        if not len(rim):
            # Of half a body.
            continue
        local[np.unique(rim), 1] = 0.0
        corners, count = np.unique(rim[:, :2], return_counts=True)
        local[corners[count == 1], 0] = 0.0
        if not len(axis):
            axis, local = line(corners[count == 1], local, size, 2)
        # Seen from before the wedge, it is left of its axis going down.
        section, local = filled(np.concatenate([rim, axis[:, [1, 0, 2]]]), local, 1, size)
        nodes = local @ turn.T
        closed[after] = np.concatenate([closed[after], section])
        closed[before] = np.concatenate([closed[before], section[:, TURNED]])
        triangles.append(section)
    nodes[np.unique(axis), :2] = 0.0
    # Of half a body, wedges on the other side are empty.
    closed = {name: own for name, own in closed.items() if len(own)}
    return closed, nodes, Inside(np.concatenate(triangles), axis)


def following(
    inside: Inside, straight: np.ndarray, B: sparse.csr_array, offset: np.ndarray
) -> tuple[sparse.csr_array, np.ndarray]:
    """`Morph.B` and `Morph.offset` with those of the nodes in half-planes.

    Parameters
    ----------
    inside : Inside
        Whose nodes are numbered from the first one that is on no surface.
    straight : (N, 3) float
        The straight mesh.
    B, offset : as in `SurfaceMesh`.
    """
    if not len(inside.triangles):
        return B, offset
    first = len(offset)
    known, axis = np.unique(inside.triangles), np.unique(inside.axis)
    count = int(known.max()) + 1 - first
    follow = sparse.lil_array((count, first))
    ends = axis[axis < first]
    ends, between = ends[np.argsort(straight[ends, 2])], axis[axis >= first]
    upper = np.searchsorted(straight[ends, 2], straight[between, 2])
    low, high = ends[upper - 1], ends[upper]
    share = (straight[between, 2] - straight[low, 2]) / (straight[high, 2] - straight[low, 2])
    follow[between - first, low] = 1.0 - share
    follow[between - first, high] = share

    free = np.setdiff1d(known[known >= first], axis)
    edge = np.setdiff1d(known, free)
    stiffness = _stiffness(straight, inside.triangles)[free]
    weights = -splu(sparse.csc_matrix(stiffness[:, free])).solve(stiffness[:, edge].toarray())
    # Those at the edge are on surfaces or on the axis.
    of_edge = sparse.vstack([sparse.eye_array(first), follow]).tocsr()[edge]
    of_free = sparse.coo_array(sparse.csr_array(weights) @ of_edge)
    rows = sparse.csr_array((of_free.data, (free[of_free.row] - first, of_free.col)), shape=(count, first))
    follow = sparse.csr_array(follow.tocsr() + rows)
    added = straight[first : first + count] + follow @ (offset - straight[:first])
    return sparse.csr_array(sparse.vstack([B, follow @ B])), np.concatenate([offset, added])


def _stiffness(points: np.ndarray, triangles: np.ndarray) -> sparse.csr_array:
    """Scalar diffusion on plane straight triangles, ∫∇a·∇b / A over every element."""
    rule, weights = TRIANGLE_RULE
    slopes = triangle_gradient(rule)
    sides = points[triangles[:, 1:3]] - points[triangles[:, :1]]
    metric = np.linalg.inv(np.einsum("eai,ebi->eab", sides, sides))
    blocks = np.einsum("g,gka,eab,glb->ekl", 2.0 * weights, slopes, metric, slopes, optimize=True)
    rows, columns = np.repeat(triangles, 6, axis=1), np.tile(triangles, (1, 6))
    return sparse.csr_array((blocks.ravel(), (rows.ravel(), columns.ravel())), shape=(len(points),) * 2)


def named(mesh: TetMesh, wedges: Sequence[Wedge]) -> TetMesh:
    """The mesh with regions in place of wedges by number."""
    if not wedges:
        return mesh
    regions: dict[str, list[np.ndarray]] = {REST: []}
    for number, wedge in enumerate(wedges):
        regions.setdefault(wedge.region, []).append(mesh.regions.get(str(number), np.zeros(0, int)))
    return replace(mesh, regions={name: np.concatenate(parts) for name, parts in regions.items()})
