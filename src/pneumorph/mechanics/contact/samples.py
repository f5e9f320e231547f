"""The points of a body's surface at which its distance from obstacles is measured."""

from __future__ import annotations

import numpy as np

from pneumorph.mechanics.elements.terms import Connectivity, connect
from pneumorph.mesh.tets import TetMesh, is_cut, triangle_gradient, triangle_shape

_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0], [0.5, 0.0], [0.5, 0.5], [0.0, 0.5], [1 / 3, 1 / 3]])
SAMPLE_N, SAMPLE_DN = triangle_shape(_CORNERS), triangle_gradient(_CORNERS)
SAMPLE_WEIGHTS = np.repeat([1 / 40, 1 / 15, 9 / 40], [3, 3, 1])
"""The rule of degree 3 whose points are the six nodes and the centre: under a plane every node keeps its distance, and
a uniform gap gives the nodal forces of a uniform pressure."""


def surface_of(mesh: TetMesh) -> Connectivity:
    """All faces of a mesh but a cut one; the data of a face (7,) are its areas at the sample points, mm²."""
    faces = np.concatenate([nodes for name, nodes in mesh.faces.items() if not is_cut(name)])
    along, across = np.einsum("fai,qak->kfqi", mesh.points[faces], SAMPLE_DN)
    return connect(faces, data=SAMPLE_WEIGHTS * np.linalg.norm(np.cross(along, across), axis=-1), objects=True)


def sample_places(surface: Connectivity, x: np.ndarray) -> np.ndarray:
    """The sample points (F, 7, 3) of the faces of a surface, with nodes at x (N, 3)."""
    return np.einsum("qa,fai->fqi", SAMPLE_N, x[surface.nodes])
