"""Stretches and stresses at the nodes of a mesh, from displacements that are known."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumorph.mechanics import Rubber
from pneumorph.mechanics.elements.element import TET_CORNER_N
from pneumorph.mechanics.elements.kinematics import deformation_gradients, largest_stretch, volume_ratio
from pneumorph.mechanics.material.rubber import nominal_stress
from pneumorph.mesh import TetMesh
from pneumorph.mesh.transfer import linear


def nodal_stretch(mesh: TetMesh, u: np.ndarray) -> np.ndarray:
    """Largest principal stretch at the nodes (N,), from displacements u (N, 3) in mm."""
    return _at_nodes(mesh, largest_stretch(deformation_gradients(mesh.tets, mesh.points, u)).T)


def nodal_stress(mesh: TetMesh, u: np.ndarray, rubbers: Mapping[str, Rubber]) -> np.ndarray:
    """Von Mises stress at the nodes (N,) in MPa, of the Cauchy stress; hydrostatic stress does not contribute.

    `rubbers` are those of the mesh's regions; of a mesh without regions there is one. Where rubbers meet, it is a mean.
    """
    F = deformation_gradients(mesh.tets, mesh.points, u)
    regions = mesh.regions or {name: np.arange(len(mesh.tets)) for name in rubbers}
    stress = np.empty(F.shape[2:])
    for name, own in regions.items():
        stress[:, own] = _von_mises(F[..., own], rubbers[name])
    return _at_nodes(mesh, stress.T)


def _von_mises(F: np.ndarray, rubber: Rubber) -> np.ndarray:
    """Von Mises stress (...) in MPa at deformation gradients F (3, 3, ...)."""
    nominal = nominal_stress(rubber.isochoric, F, np.array(rubber.parameters))
    stress = np.einsum("ik...,jk...->ij...", nominal, F) / volume_ratio(F)
    mean = (stress[0, 0] + stress[1, 1] + stress[2, 2]) / 3.0
    deviator = stress - mean * np.eye(3).reshape(3, 3, *[1] * (F.ndim - 2))
    return np.sqrt(1.5 * (deviator**2).sum(axis=(0, 1)))


def _at_nodes(mesh: TetMesh, values: np.ndarray) -> np.ndarray:
    """A field (N,) from values (M, 4) at the quadrature points, averaged over the elements at every corner node.

    Mid-side nodes get the mean of the ends of their edge: too few elements share them for an average of their own.
    """
    # On the other side of a cut of a sector are the elements at the images of its nodes.
    images, sources = mesh.tied
    source = np.arange(len(mesh.points))
    source[images] = sources
    # Linear extrapolation from the four points of the rule to the corners.
    at_corners, corners = values @ np.linalg.inv(TET_CORNER_N).T, source[mesh.tets[:, :4]].ravel()
    count = np.bincount(corners, minlength=len(mesh.points))
    return linear(mesh, (np.bincount(corners, at_corners.ravel(), minlength=len(count)) / np.maximum(count, 1))[source])
