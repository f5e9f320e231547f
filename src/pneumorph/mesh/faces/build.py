"""Mesh bodies from files, whose faces are triangulated where they are in the file and moved by lattices."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import sparse

from pneumorph.cad.faces import Faces
from pneumorph.cad.parts import Parts, Place, Where, parts_of
from pneumorph.cad.solids import grouped
from pneumorph.geometry import Body
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.mesh.build import Boundary, mesh_within
from pneumorph.mesh.morph import Morph
from pneumorph.mesh.tets import TetMesh


@dataclass(frozen=True, eq=False)
class Capped(Boundary):
    """The faces of a file, with caps over the ports of chambers, see `TetMesh.caps`."""

    caps: dict[str, np.ndarray] = field(default_factory=dict)

    def followed(self, straight: TetMesh) -> tuple[TetMesh, sparse.csr_array, np.ndarray]:
        """The filled mesh with the caps."""
        return replace(straight, caps=self.caps), self.B, self.offset


@dataclass(frozen=True, eq=False)
class FacesMesher:
    """Meshes the body in a file, however lattices have moved it.

    Attributes
    ----------
    faces : function of a size in mm
        The faces in triangles with edges of about this length.
    ends : where base and tip are.
    chambers : where chambers are, by their names.
    regions : {region: (3,)}
        A point in the solid of each region, mm.
    rest : name of the region of all other solids.
    size : float
        Of the elements, mm.
    """

    faces: Callable[[float], Faces]
    ends: tuple[Where, Where]
    chambers: Mapping[str, Place]
    size: float
    regions: Mapping[str, np.ndarray] = field(default_factory=dict)
    rest: str = ""
    heights: Sequence[float] = ()

    def mesh(self, body: Body[LatticeSurface], finest: float = 0.0) -> Morph:
        """Mesh a body, see `mesh_within`."""
        return mesh_within(self._bound, body, self.size, finest)

    def _bound(self, body: Body[LatticeSurface], finer: float, _: float) -> Boundary:
        outline = grouped(self.faces(finer * self.size), self.regions)
        parts = parts_of(outline, *self.ends, self.chambers)
        faces = {name: outline.triangles[own] for name, own in parts.triangles.items() if len(own)}
        moved = np.zeros(len(outline.points), bool)
        offset, values, rows, columns = outline.points.copy(), [], [], []
        for surface, where in zip(body.surfaces, body.slices, strict=True):
            own = [f"chamber {surface.name}"] if surface.cavity else ["base", "tip", "exterior"]
            nodes = np.unique(np.concatenate([faces[name].ravel() for name in own if name in faces]))
            if not surface.cavity:
                nodes = np.union1d(nodes, self._between(outline, parts))
            # Nodes of the rim of a port are moved with the exterior.
            nodes = nodes[~moved[nodes]]
            moved[nodes] = True
            weights = surface.lattice.weights(outline.points[nodes]).tocoo()
            offset[nodes] -= weights @ surface.lattice.points()
            values.append(weights.data)
            rows.append(nodes[weights.row])
            columns.append(where.start + weights.col)
        entries = np.concatenate(values), (np.concatenate(rows), np.concatenate(columns))
        B = sparse.csr_array(entries, (len(outline.points), body.n_points))
        nodes = B @ body.control_points() + offset
        return Capped(B, offset, faces, nodes, self._solids(outline), caps=parts.caps)

    def _between(self, outline: Faces, parts: Parts) -> np.ndarray:
        """Nodes where solids meet that are on no chamber: they are moved with the exterior."""
        walls = [outline.triangles[own] for name, own in parts.triangles.items() if name.startswith("chamber ")]
        return np.setdiff1d(outline.between, np.concatenate([np.zeros(0, int), *(each.ravel() for each in walls)]))

    def _solids(self, outline: Faces) -> dict[str, np.ndarray]:
        """The triangles around the solids of every region."""
        if not self.regions:
            return {"": outline.triangles}
        solids = {name: outline.around(number) for number, name in enumerate((self.rest, *self.regions))}
        return {name: triangles for name, triangles in solids.items() if len(triangles)}
