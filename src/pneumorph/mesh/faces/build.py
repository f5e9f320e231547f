"""Mesh bodies from files, whose faces are triangulated where they are in the file and moved by lattices."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace

import numpy as np
from scipy import sparse

from pneumorph.cad.faces import Faces
from pneumorph.cad.parts import FLAT, Parts, Place, Where, faces_where, meeting_where, parts_of, triangles_where
from pneumorph.cad.ports import Open, part_of_cap
from pneumorph.cad.shells import Shell
from pneumorph.cad.solids import grouped, groups_of
from pneumorph.geometry import Body
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.between import in_the_file, weights_between
from pneumorph.mesh.build import Boundary, mesh_within
from pneumorph.mesh.cut import IN_PLANE, with_cut_regions
from pneumorph.mesh.faces.cover import FaceCover, covered
from pneumorph.mesh.faces.part import as_in
from pneumorph.mesh.morph import Morph
from pneumorph.mesh.tets import Covered, TetMesh
from pneumorph.symmetry.operations import NORMALS
from pneumorph.symmetry.part import Part


@dataclass(frozen=True, eq=False)
class Capped(Boundary):
    """The faces of a file, with caps over the ports of chambers, see `TetMesh.caps`, and with what covers them."""

    caps: dict[str, np.ndarray] = field(default_factory=dict)
    covers: dict[str, Covered] = field(default_factory=dict)

    def followed(self, straight: TetMesh) -> tuple[TetMesh, sparse.csr_array, np.ndarray]:
        """The filled mesh with caps and covers."""
        return replace(straight, caps=self.caps, covers=self.covers), self.B, self.offset


@dataclass(frozen=True, eq=False)
class FacesMesher:
    """Meshes the body in a file, however lattices have moved it.

    Attributes
    ----------
    faces : function of a size in mm and a part
        The faces in triangles with edges of about this length; those of a part are open in its mirror planes.
    ends : where base and tip are.
    chambers : where chambers are, by their names.
    regions : {region: (3,)}
        A point in the solid of each region, mm.
    rest : name of the region of all other solids.
    covers : where sheets and fibres lie.
    part : of the body that is meshed, between mirror planes.
    images : {plane: {chamber: chamber}}
        The image of each chamber in these.
    size : float
        Of the elements, mm.
    """

    faces: Callable[[float, Part], Faces]
    ends: tuple[Where, Where]
    chambers: Mapping[str, Place]
    size: float
    regions: Mapping[str, np.ndarray] = field(default_factory=dict)
    rest: str = ""
    covers: Sequence[FaceCover] = ()
    part: Part = ()
    images: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    heights: Sequence[float] = ()

    def mesh(self, body: Body[LatticeSurface], finest: float = 0.0) -> Morph:
        """Mesh a body, see `mesh_within`."""
        return mesh_within(self._bound, body, self.size, finest)

    def _bound(self, body: Body[LatticeSurface], finer: float, *_: object) -> Boundary:
        size = finer * self.size
        found, parts, covers = self._of_part(size) if self.part else self._of_all(size)
        faces = {self._named(name): found.triangles[own] for name, own in parts.triangles.items() if len(own)}
        rows, order = [], []
        placed = np.zeros(len(found.points), bool)
        for surface, where in zip(body.surfaces, body.slices, strict=True):
            own = [f"chamber {surface.name}"] if surface.cavity else ["base", "tip", "exterior"]
            nodes = np.unique(found.triangles[np.concatenate([parts.triangles[name] for name in own])])
            # Nodes of the rim of a port are moved with the exterior.
            nodes = nodes[~placed[nodes]]
            placed[nodes] = True
            weights = surface.lattice.weights(found.points[nodes]).tocoo()
            shape = len(nodes), body.n_points
            rows.append(sparse.coo_array((weights.data, (weights.row, where.start + weights.col)), shape))
            order.append(nodes)
        between = np.flatnonzero(~placed)
        rows.append(weights_between(body, found.points[between]))
        order.append(between)
        B = sparse.csr_array(sparse.vstack(rows))[np.argsort(np.concatenate(order))]
        offset = found.points - B @ in_the_file(body)
        nodes, solids = B @ body.control_points() + offset, self._solids(found)
        if self.part:
            faces, solids, nodes = with_cut_regions(faces, solids, nodes, self.part, size)
        caps = {self._named(f"chamber {name}").removeprefix("chamber "): own for name, own in parts.caps.items()}
        return Capped(B, offset, faces, nodes, solids, caps=caps, covers=covers)

    def _of_all(self, size: float) -> tuple[Faces, Parts, dict[str, Covered]]:
        """The faces of the whole body, which of them are what, and what covers them."""
        found = self.faces(size, ())
        found = grouped(found, groups_of(found, self.regions))
        parts = parts_of(found, *self.ends, self.chambers)
        return found, parts, covered(found, parts, self.covers, lambda where: triangles_where(found, where))

    def _of_part(self, size: float) -> tuple[Faces, Parts, dict[str, Covered]]:
        """The same of a part, whose faces are what the outline of the whole body says."""
        whole = self.faces(0.0, ())
        group = groups_of(whole, self.regions)
        found, twin, meeting = as_in(whole, self.faces(size, self.part))
        one, other = group[found.sides.T]
        found, meeting = grouped(found, group), meeting[one != other]
        known = parts_of(grouped(whole, group), *self.ends, self.chambers)
        triangles = {name: np.flatnonzero(np.isin(twin, own)) for name, own in known.triangles.items()}
        parts = Parts(triangles, self._open_in_part(found, triangles, known.chambers))

        def on(where: Where) -> np.ndarray:
            chosen, touching = faces_where(whole, where), meeting_where(whole, where)
            return np.concatenate([found.triangles[chosen[twin]], found.between[touching[meeting]]])

        return found, parts, covered(found, parts, self.covers, on)

    def _open_in_part(
        self, found: Faces, triangles: Mapping[str, np.ndarray], chambers: Mapping[str, Shell | Open]
    ) -> dict[str, Shell | Open]:
        """The chambers with ports that a part has, with their walls and caps there."""
        parts: dict[str, Shell | Open] = {}
        for name, each in chambers.items():
            own, port = triangles[f"chamber {name}"], self.chambers[name].port
            if isinstance(each, Open) and port is not None and len(own):
                cut = np.ones(len(found.points), bool)
                for plane in self.part:
                    if self.images[plane][name] == name:
                        cut &= np.abs(found.points[:, NORMALS[plane]]) <= IN_PLANE
                cap = part_of_cap(found, own, port.holds(found, FLAT * found.diagonal), cut)
                parts[name] = replace(each, triangles=own, cap=cap)
        return parts

    def _named(self, name: str) -> str:
        """The name of a face in the mesh: that of a chamber has those of its images too, see `TetMesh.faces`."""
        if not name.startswith("chamber "):
            return name
        names = [name.removeprefix("chamber ")]
        for plane in self.part:
            image = self.images[plane]
            if image[names[0]] != names[0]:
                names += [image[each] for each in names]
        return f"chamber {' '.join(names)}"

    def _solids(self, outline: Faces) -> dict[str, np.ndarray]:
        """The triangles around the solids of every region."""
        if not self.regions:
            return {"": outline.triangles}
        solids = {name: outline.around(number) for number, name in enumerate((self.rest, *self.regions))}
        return {name: triangles for name, triangles in solids.items() if len(triangles)}
