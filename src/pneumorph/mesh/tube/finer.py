"""Surfaces of tubes with some of their triangles divided, where elements between them are poor.

A part of a six-node triangle is a six-node triangle too, so new nodes are fixed means of those there were, and follow
the control points as these do.
"""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from scipy import sparse

from pneumorph.mesh.longest import Edges, Middles, divided, edges_of, middles_of
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
    whole = np.concatenate([*surface.faces.values(), *surface.solids.values()])
    points, (first, last) = surface.B @ P + surface.offset, surface.seam.T
    edges = edges_of(whole, TRIANGLE_EDGES, points, (last, first), middles)
    new = middles_of(_parts(whole, edges), whole, TRIANGLE_EDGES, edges, triangle_shape)

    def quadratic(triangles: np.ndarray) -> np.ndarray:
        corners = _parts(triangles, edges).corners
        return np.concatenate([corners, new.of(corners, TRIANGLE_EDGES)], axis=1)

    return replace(
        surface,
        B=sparse.csr_array(sparse.vstack([surface.B, new.rows @ surface.B])),
        offset=np.concatenate([surface.offset, new.rows @ surface.offset]),
        faces={name: quadratic(face) for name, face in surface.faces.items()},
        solids={name: quadratic(solid) for name, solid in surface.solids.items()},
        param={name: _param(_of_tube(surface, name), own, edges) for name, own in surface.param.items()},
        seam=np.concatenate([surface.seam, _images(surface.seam, new)]),
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


def _images(seam: np.ndarray, new: Middles) -> np.ndarray:
    """New nodes in the middle of halves of edges at which a sector begins, each with its image, (n, 2)."""
    edges = new.edges
    image = np.arange(edges.count)
    image[seam[:, 0]] = seam[:, 1]
    at = edges.halved()
    at = at[np.isin(edges.middle[at], seam[:, 0])]
    middle = edges.middle[at]
    halves = [(new.between(middle, end), new.between(image[middle], image[end])) for end in edges.ends(at).T]
    return np.concatenate([np.column_stack(pair) for pair in halves])
