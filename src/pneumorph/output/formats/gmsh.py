"""A meshed body for Gmsh and what reads its files: format 2.2, ASCII, with named groups.

Groups of faces are those of the mesh: base, tip, exterior, and one for each chamber; groups of solids are the regions.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.mesh.tets import TetMesh
from pneumorph.problem.regions import REST

TETRAHEDRON, TRIANGLE = 11, 9
"""Gmsh's numbers of the ten-node tetrahedron and the six-node triangle."""

ORDER = [0, 1, 2, 3, 4, 5, 6, 7, 9, 8]
"""The nodes of a tetrahedron in Gmsh's order, whose last two edges are 23 and 13."""


def gmsh_mesh(mesh: TetMesh) -> str:
    """The file of a mesh in mm. Node k of the mesh is k + 1; of elements the faces come first."""
    solids = mesh.regions or {REST: np.arange(len(mesh.tets))}
    return "\n".join([*_names(mesh, solids), *_nodes(mesh), *_elements(mesh, solids), ""])


def _names(mesh: TetMesh, solids: dict[str, np.ndarray]) -> Iterator[str]:
    yield from ("$MeshFormat", "2.2 0 8", "$EndMeshFormat", "$PhysicalNames")
    yield str(len(mesh.faces) + len(solids))
    yield from (f'2 {number} "{name}"' for number, name in enumerate(mesh.faces, 1))
    yield from (f'3 {number} "{name}"' for number, name in enumerate(solids, len(mesh.faces) + 1))
    yield "$EndPhysicalNames"


def _nodes(mesh: TetMesh) -> Iterator[str]:
    yield from ("$Nodes", str(len(mesh.points)))
    yield from (f"{k} {x:.12e} {y:.12e} {z:.12e}" for k, (x, y, z) in enumerate(mesh.points, 1))
    yield "$EndNodes"


def _elements(mesh: TetMesh, solids: dict[str, np.ndarray]) -> Iterator[str]:
    groups = [(TRIANGLE, faces) for faces in mesh.faces.values()]
    groups += [(TETRAHEDRON, mesh.tets[tets][:, ORDER]) for tets in solids.values()]
    yield from ("$Elements", str(sum(len(nodes) for _, nodes in groups)))
    rows = ((kind, group, own) for group, (kind, nodes) in enumerate(groups, 1) for own in nodes + 1)
    for number, (kind, group, own) in enumerate(rows, 1):
        # Two tags: the named group, and the part of the geometry, which is the same here.
        yield f"{number} {kind} 2 {group} {group} {' '.join(map(str, own))}"
    yield "$EndElements"
