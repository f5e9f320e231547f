"""Tetrahedra between the surfaces: filled in by Netgen, then repaired where flat, and given mid-side nodes."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pneumorph.cad.netgen_process import call
from pneumorph.interrupts import stop_if_asked
from pneumorph.mesh.repair import repair
from pneumorph.mesh.split import split_long_edges
from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES, TetMesh

_JITTER = 1e-5
"""Random displacement of points, relative to the size, while Netgen fills the space between them. Where many points lie
on one sphere, as on regular surfaces, Netgen took 150 s and made four times as many elements; with it 0.4 s."""

_LONGEST = 1.8  # inner edges longer than this, relative to the size, are bisected


def fill(solids: dict[str, np.ndarray], faces: dict[str, np.ndarray], nodes: np.ndarray, size: float) -> TetMesh:
    """Fill regions with quadratic tetrahedra with straight edges.

    Each is filled on its own; since triangles between two regions are kept, their meshes fit together.

    Parameters
    ----------
    solids : dict of (nt, 6) int
        Triangles that bound each region and are closed together, normals outwards. A single region "" has no name in
        the mesh.
    faces : dict of (nf, 6) int
        Those that bound the body, see `TetMesh.faces`.
    nodes : (n_nodes, 3) float
        Their nodes, including mid-side nodes. They become the first nodes of the mesh, with mid-side nodes moved to the
        chords.
    size : float
        Desired edge length inside, mm.

    Raises
    ------
    MeshError
        If Netgen fails, for example because the triangles of two walls cross.
    """
    points, tets = nodes.copy(), []
    for triangles in solids.values():
        points[triangles[:, 3:]] = nodes[triangles[:, TRIANGLE_EDGES]].mean(axis=2)
    sides = {tuple(corners) for name in faces if name.startswith("sector ") for corners in faces[name][:, :3].tolist()}
    for triangles in solids.values():
        cut = np.array([tuple(corners) in sides for corners in triangles[:, :3].tolist()])
        added, filling = _filled(triangles, nodes, size, len(points), cut)
        points = np.concatenate([points, added])
        tets.append(filling)
    starts = np.cumsum([0, *map(len, tets)])
    numbers = [np.arange(first, last) for first, last in pairwise(starts)]
    regions = {} if set(solids) == {""} else dict(zip(solids, numbers, strict=True))
    return TetMesh(points, np.concatenate(tets), faces, regions)


def _filled(
    triangles: np.ndarray, nodes: np.ndarray, size: float, first: int, cut: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """The inner nodes of a solid (n, 3), which are numbered from `first`, and its tetrahedra (m, 10).

    Triangles (nt,) of a `cut` are no part of the surfaces.
    """
    # Netgen gets only the corners, which are renumbered for it.
    vertices, corners = np.unique(triangles[:, :3], return_inverse=True)
    n_vertices = len(vertices)
    triangles = np.hstack([corners.reshape(-1, 3), triangles[:, 3:]])
    points, tets = _fill_straight(nodes[vertices], triangles[:, :3], size)
    repaired, repaired_tets = repair(points, tets, triangles, nodes, cut)
    if repaired is not points:
        # Smoothing the new vertices may make other elements poor, so repair once more.
        points, tets = _optimised(repaired, repaired_tets, triangles[:, :3], size, "m", 1)
        points, tets = repair(points, tets, triangles, nodes, cut)

    ends = np.sort(tets[:, TET_EDGES].reshape(-1, 2), axis=1)
    edges, inverse = np.unique(ends, axis=0, return_inverse=True)
    n_interior = len(points) - n_vertices
    mids = np.empty(len(edges), int)
    # Edges of surface triangles have their mid-side nodes already.
    surface_edges, chosen = np.unique(
        np.sort(triangles[:, TRIANGLE_EDGES].reshape(-1, 2), axis=1), axis=0, return_index=True
    )
    rank = _key(edges, len(points)).searchsorted(_key(surface_edges, len(points)))
    mids[rank] = triangles[:, 3:].ravel()[chosen]
    inner = np.setdiff1d(np.arange(len(edges)), rank)
    mids[inner] = first + n_interior + np.arange(len(inner))
    number = np.concatenate([vertices, first + np.arange(n_interior)])
    added = np.concatenate([points[n_vertices:], points[edges[inner]].mean(axis=1)])
    return added, np.hstack([number[tets], mids[inverse.reshape(-1, 6)]])


def _key(edges: np.ndarray, n: int) -> np.ndarray:
    return edges[:, 0] * n + edges[:, 1]


def _fill_straight(points: np.ndarray, triangles: np.ndarray, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Straight, positively oriented tetrahedra inside closed surfaces of triangles; the given points come first."""
    moved = points + _JITTER * size * np.random.default_rng(0).standard_normal(points.shape)
    stop_if_asked()
    # Netgen leaves walls up to twice as thick as the edge length without inner vertices.
    filled, tets = call("fill", moved, triangles, size)
    filled, tets = split_long_edges(filled, tets, triangles, _LONGEST * size)
    filled, tets = _optimised(filled, tets, triangles, size, "cmdmustm", 3)
    return np.concatenate([points, filled[len(points) :]]), tets


def _optimised(
    points: np.ndarray, tets: np.ndarray, triangles: np.ndarray, size: float, moves: str, steps: int
) -> tuple[np.ndarray, np.ndarray]:
    """Improve a mesh by Netgen's optimiser, see `netgen_child.optimise`."""
    stop_if_asked()
    return call("optimise", points, tets, triangles, size, moves, steps)
