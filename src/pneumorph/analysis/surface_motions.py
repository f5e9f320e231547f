"""Motions of a body's surfaces as faults of casting make them: walls that are thicker, cores that are not in place.

Base and tip stay in their planes. Nodes that are on none of the moved surface's triangles stay where they are.
"""

from __future__ import annotations

import numpy as np

from pneumorph.mesh.tets import TetMesh

EDGE = 0.1
"""Directions in which the normals around a node vary less than this, relative to their mean, count as tangential."""

CORNERS = 3
"""The first nodes of a six-node triangle."""


def offset(mesh: TetMesh, face: str) -> np.ndarray:
    """Motion (N, 3) of nodes that adds rubber of thickness 1 to a face, by the length along its normals.

    Normals point out of the rubber. Where several triangles meet in a node, its motion has the component 1 along each
    of their normals, in the sense of least squares: at edges both sides move by 1. On base and tip it is along their
    planes.

    Parameters
    ----------
    mesh : of a whole body.
    face : "exterior" or that of a chamber.
    """
    triangles = mesh.faces[face]
    first, second, third = (mesh.points[triangles[:, k]] for k in range(CORNERS))
    normals = np.cross(second - first, third - first)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    nodes, place = np.unique(triangles, return_inverse=True)
    place = place.reshape(triangles.shape)
    along = _within_ends(mesh, nodes)
    outer, mean, count = np.zeros((len(nodes), 3, 3)), np.zeros((len(nodes), 3)), np.zeros(len(nodes))
    for column in place.T:
        seen = np.einsum("nij,nj->ni", along[column], normals)
        np.add.at(outer, column, seen[:, :, None] * seen[:, None, :])
        np.add.at(mean, column, seen)
        np.add.at(count, column, 1.0)
    moved = np.zeros_like(mesh.points)
    inverse = np.linalg.pinv(outer / count[:, None, None], rcond=EDGE, hermitian=True)
    moved[nodes] = np.einsum("nij,nj->ni", inverse, mean / count[:, None])
    return moved


def core_shift(mesh: TetMesh, face: str) -> np.ndarray:
    """Motions (3, N, 3) of nodes that displace a chamber by 1 along x, y and z.

    Parameters
    ----------
    mesh : of a whole body.
    face : of the chamber.
    """
    nodes = np.unique(mesh.faces[face])
    return np.array([_kept(mesh, nodes, np.tile(axis, (len(nodes), 1))) for axis in np.eye(3)])


def core_tilt(mesh: TetMesh, face: str) -> np.ndarray:
    """Motions (2, N, 3) of nodes, per rad, that turn a chamber about x and y through its end towards the base.

    Parameters
    ----------
    mesh : of a whole body.
    face : of the chamber.
    """
    nodes = np.unique(mesh.faces[face])
    places = mesh.points[nodes]
    lowest = places[:, 2].min()
    middle = (places.min(axis=0) + places.max(axis=0)) / 2
    held = np.array([middle[0], middle[1], lowest])
    return np.array([_kept(mesh, nodes, np.cross(axis, places - held)) for axis in np.eye(3)[:2]])


def growth(mesh: TetMesh) -> np.ndarray:
    """Motion (N, 3) of all nodes per relative growth of the whole body."""
    return mesh.points.copy()


def _kept(mesh: TetMesh, nodes: np.ndarray, motion: np.ndarray) -> np.ndarray:
    moved = np.zeros_like(mesh.points)
    moved[nodes] = np.einsum("nij,nj->ni", _within_ends(mesh, nodes), motion)
    return moved


def _within_ends(mesh: TetMesh, nodes: np.ndarray) -> np.ndarray:
    """Projections (n, 3, 3) of motions of nodes onto the planes of base and tip, where they are on them."""
    projections = np.tile(np.eye(3), (len(nodes), 1, 1))
    for end in ("base", "tip"):
        if end in mesh.faces:
            triangles = mesh.points[mesh.faces[end][:, :CORNERS]]
            normal = np.cross(triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]).sum(axis=0)
            normal /= np.linalg.norm(normal)
            own = np.isin(nodes, mesh.faces[end])
            projections[own] = projections[own] @ (np.eye(3) - np.outer(normal, normal))
    return projections
