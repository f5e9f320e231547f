"""Mesh bodies of tubes, or parts of symmetric ones, with their regions and what lies on their surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from pneumorph.errors import MeshError
from pneumorph.geometry import Body
from pneumorph.geometry.tube.cover import Cover
from pneumorph.geometry.tube.level import Level
from pneumorph.geometry.tube.lining import Lining
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.geometry.tube.wedge import Wedge
from pneumorph.mesh.build import DECIMALS, Boundary, mesh_within
from pneumorph.mesh.cut import with_cut_regions
from pneumorph.mesh.morph import Morph
from pneumorph.mesh.tets import TetMesh
from pneumorph.mesh.tube.cover import covered
from pneumorph.mesh.tube.finer import with_divided_edges
from pneumorph.mesh.tube.section import with_sections
from pneumorph.mesh.tube.sector import with_sector
from pneumorph.mesh.tube.surface import beginnings, surface_mesh
from pneumorph.mesh.tube.wedge import Inside, following, named, with_half_planes
from pneumorph.symmetry.part import Part, turns_of

_TURN = np.radians(45)
_TIMES = 5
"""How often edges of surfaces are divided beside poor elements, at most."""


@dataclass(frozen=True)
class TubeMesher:
    """Meshes the bodies of a run, or their parts; see `mesh_body` for what is not said here.

    A whole body is meshed where the cut of a sector would cross itself or a surface.
    """

    size: float
    part: Part = ()
    linings: Sequence[Lining] = ()
    covers: Sequence[Cover] = ()
    levels: Sequence[Level] = ()
    wedges: Sequence[Wedge] = ()

    @property
    def heights(self) -> Sequence[float]:
        """z of the planes between regions, mm."""
        return [level.height for level in self.levels]

    def mesh(self, body: Body[TubeSurface], finest: float = 0.0) -> Morph:
        """Mesh a body; where that fails, with finer elements, but with none below `finest`, in mm."""
        try:
            return self._meshed(body, self.part, finest)
        except MeshError:
            if turns_of(self.part) == 1:
                raise
        return self._meshed(body, (), finest)

    def _meshed(self, body: Body[TubeSurface], part: Part, finest: float) -> Morph:
        return mesh_body(body, self.size, part, self.linings, self.covers, self.levels, self.wedges, finest)


@dataclass(frozen=True, eq=False, kw_only=True)
class TubeBoundary(Boundary):
    """That of tubes, with what is in half-planes between regions and what lies on surfaces."""

    wedges: Sequence[Wedge]
    inside: Inside
    covers: Sequence[Cover]

    def followed(self, straight: TetMesh) -> tuple[TetMesh, sparse.csr_array, np.ndarray]:
        """See `Boundary.followed`."""
        straight = replace(straight, covers=covered(self.faces, self.param, self.covers))
        B, offset = following(self.inside, straight.points, self.B, self.offset)
        return named(straight, self.wedges), B, offset


def mesh_body(
    body: Body[TubeSurface],
    size: float,
    part: Part = (),
    linings: Sequence[Lining] = (),
    covers: Sequence[Cover] = (),
    levels: Sequence[Level] = (),
    wedges: Sequence[Wedge] = (),
    finest: float = 0.0,
) -> Morph:
    """Mesh a body with quadratic tetrahedra, or part of a symmetric one.

    That is the part at y ≥ 0 (mirror xz) and x ≥ 0 (mirror yz), or a sector.

    If chords of a coarse triangulation cross, or an element is inverted when curved, finer triangulations are tried.
    Sectors may also begin elsewhere.

    Parameters
    ----------
    body : Body of tubes
    size : float
        Approximate edge length, mm; edges are shorter where the surfaces are strongly curved.
    part : Part
        A sector has no linings, levels or wedges.
    linings : sequence of Lining
        Layers of other rubbers, which become regions of the mesh; what is in none is the region `REST`.
    covers : sequence of Cover
        Where sheets and fibres lie.
    levels : sequence of Level, from the lowest to the highest
        Planes above which what is in no layer becomes a region.
    wedges : sequence of Wedge, all around the axis
        Parts of the body between half-planes, without layers and planes.
    finest : float
        Edge length, mm, below which no finer triangulations are tried.

    Raises
    ------
    MeshError
        If no attempt gives a mesh without inverted or nearly flat elements.
    """
    turns = turns_of(part)

    def bound(body: Body[TubeSurface], finer: float, begin: float, divided: Sequence[np.ndarray]) -> TubeBoundary:
        surface = surface_mesh(body, finer * size, finer * _TURN, part, linings, levels, wedges, begin)
        for middles in divided:
            surface = with_divided_edges(surface, body.control_points(), middles)
        nodes = surface.B @ body.control_points() + surface.offset
        solids, nodes, inside = with_half_planes(surface.solids, nodes, wedges, finer * size)
        if turns > 1:
            faces, nodes = with_sector(surface.faces, nodes, surface.seam, turns, finer * size)
            solids = {"": np.concatenate(list(faces.values()))}
        else:
            solids, nodes = with_sections(solids, nodes, levels, part, finer * size)
            faces, solids, nodes = with_cut_regions(surface.faces, solids, nodes, part, finer * size)
        return TubeBoundary(
            surface.B, surface.offset, faces, nodes, solids, surface.param, wedges=wedges, inside=inside, covers=covers
        )

    rounded = body.with_control_points(np.round(body.control_points(), DECIMALS))
    heights = [level.height for level in levels]
    return mesh_within(bound, body, size, finest, beginnings(rounded, part), heights, times=_TIMES)
