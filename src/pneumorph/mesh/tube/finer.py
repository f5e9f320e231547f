"""Surfaces of tubes with some of their triangles divided, where elements between them are poor.

A part of a six-node triangle is a six-node triangle too, so new nodes are fixed means of those there were, and follow
the control points as these do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from pneumorph.mesh.longest import Edges, divided, edges_of
from pneumorph.mesh.refine import NODES_OF_TRIANGLE, Parts
from pneumorph.mesh.tets import TRIANGLE_EDGES, chambers_of, triangle_shape
from pneumorph.mesh.tube.surface import SurfaceMesh
from pneumorph.problem.reinforcement import EXTERIOR


def with_divided_edges(surface: SurfaceMesh, P: np.ndarray, middles: np.ndarray) -> SurfaceMesh:
    """The surfaces with edges divided, and others as far as triangles would not fit together.

    Parameters
    ----------
    surface : SurfaceMesh
    P : (n_points, 3) float
        Control points, mm: the longest edge of a triangle is divided first.
    middles : (k,) int
        Nodes in the middle of the edges.
    """
    if not len(middles):
        return surface
    whole = np.concatenate([*surface.faces.values(), *surface.solids.values()])
    points, (first, last) = surface.B @ P + surface.offset, surface.seam.T
    edges = edges_of(whole, TRIANGLE_EDGES, points, (last, first), middles)
    parts = _parts(whole, edges)
    ends = parts.corners[:, TRIANGLE_EDGES]
    keys = edges.key(ends[..., 0], ends[..., 1])
    part, edge = np.nonzero(edges.place(keys) < 0)
    fresh, at = np.unique(keys[part, edge], return_index=True)
    part, edge = part[at], edge[at]
    weights = triangle_shape(parts.local[part[:, None], TRIANGLE_EDGES[edge]].mean(axis=1))
    rows = np.repeat(np.arange(len(fresh)), 6)
    new = sparse.csr_array((weights.ravel(), (rows, whole[parts.owner[part]].ravel())), (len(fresh), len(points)))
    new.eliminate_zeros()

    def quadratic(triangles: np.ndarray) -> np.ndarray:
        corners = _parts(triangles, edges).corners
        ends = corners[:, TRIANGLE_EDGES]
        return np.concatenate([corners, edges.between(ends[..., 0], ends[..., 1], fresh)], axis=1)

    return replace(
        surface,
        B=sparse.csr_array(sparse.vstack([surface.B, new @ surface.B])),
        offset=np.concatenate([surface.offset, new @ surface.offset]),
        faces={name: quadratic(face) for name, face in surface.faces.items()},
        solids={name: quadratic(solid) for name, solid in surface.solids.items()},
        param={name: _param(_of_tube(surface, name), own, edges) for name, own in surface.param.items()},
        seam=np.concatenate([surface.seam, _images(surface.seam, edges, fresh)]),
    )


def _parts(triangles: np.ndarray, edges: Edges) -> Parts:
    return divided(triangles[:, :3], NODES_OF_TRIANGLE[:3], TRIANGLE_EDGES, edges)


def _of_tube(surface: SurfaceMesh, name: str) -> np.ndarray:
    """The triangles (nf, 6) of a tube, with the parameters of that name."""
    if name == EXTERIOR:
        face = surface.faces[name]
    else:
        face = next(own for face, own in surface.faces.items() if chambers_of(face)[:1] == (name,))
    return face[: len(surface.param[name])]


def _param(triangles: np.ndarray, param: np.ndarray, edges: Edges) -> np.ndarray:
    """The parameters (m, 6, 2) of the parts of triangles (nf, 6), of which they are linear but for those at poles."""
    parts = _parts(triangles, edges)
    corners = np.einsum("fcn,fni->fci", triangle_shape(parts.local), param[parts.owner])
    return np.concatenate([corners, corners[:, TRIANGLE_EDGES].mean(axis=2)], axis=1)


def _images(seam: np.ndarray, edges: Edges, fresh: np.ndarray) -> np.ndarray:
    """New nodes in the middle of halves of edges at which a sector begins, each with its image, (n, 2)."""
    image = np.arange(edges.count)
    image[seam[:, 0]] = seam[:, 1]
    halved = np.flatnonzero((edges.rank >= 0) & np.isin(edges.middle, seam[:, 0]))
    middle, ends = edges.middle[halved], edges.ends(halved)
    pairs = [
        np.column_stack([edges.between(middle, end, fresh), edges.between(image[middle], image[end], fresh)])
        for end in ends.T
    ]
    return np.concatenate(pairs)
