"""Mesh a body; the mesh follows its surfaces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import product

import numpy as np

from pneumorph.errors import MeshError
from pneumorph.geometry import Body
from pneumorph.geometry.tube.cover import Cover
from pneumorph.geometry.tube.level import Level
from pneumorph.geometry.tube.lining import Lining
from pneumorph.geometry.tube.wedge import Wedge
from pneumorph.interrupts import stop_if_asked
from pneumorph.mesh.cut import with_cut_regions
from pneumorph.mesh.morph import Morph, build_morph
from pneumorph.mesh.quality import scaled_jacobian
from pneumorph.mesh.relax import relax
from pneumorph.mesh.tube.cover import covered
from pneumorph.mesh.tube.section import with_sections
from pneumorph.mesh.tube.sector import with_sector
from pneumorph.mesh.tube.surface import beginnings, surface_mesh
from pneumorph.mesh.tube.wedge import following, named, with_half_planes
from pneumorph.mesh.volume import fill
from pneumorph.symmetry.part import Part, turns_of

_TURN = np.radians(45)
_FINER = (1.0, 0.93, 0.86, 0.8, 0.65, 0.5)
"""Factors on size and turning angle in successive attempts. A slightly finer mesh suffices where chords just cross;
half the size has eight times as many elements."""
_DECIMALS = 6
"""Decimals (of mm) to which control points are rounded while a body is meshed, so that rounding errors do not change
the mesh, which is moved to the exact surfaces afterwards."""
_WORST = 0.02
"""Quality (see `scaled_jacobian`) below which a mesh is rejected."""
_FLAT = 1e-9
"""Quality, of either sign, below which an element with straight edges counts as flat."""


def mesh_body(
    body: Body,
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
    body : Body
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
    exact, turns = body.control_points(), turns_of(part)
    P = np.round(exact, _DECIMALS)
    body = body.with_control_points(P)
    reason = MeshError("no attempt was made")
    factors = [factor for factor in _FINER if factor == 1.0 or factor * size >= finest]
    for finer, begin in product(factors, beginnings(body, part)):
        stop_if_asked()
        try:
            surface = surface_mesh(body, finer * size, finer * _TURN, part, linings, levels, wedges, begin)
            nodes = surface.B @ P + surface.offset
            solids, nodes, inside = with_half_planes(surface.solids, nodes, wedges, finer * size)
            if turns > 1:
                faces, nodes = with_sector(surface.faces, nodes, surface.seam, turns, finer * size)
                solids = {"": np.concatenate(list(faces.values()))}
            else:
                solids, nodes = with_sections(solids, nodes, levels, part, finer * size)
                faces, solids, nodes = with_cut_regions(surface.faces, solids, nodes, part, finer * size)
            straight = replace(fill(solids, faces, nodes, finer * size), covers=covered(faces, surface.param, covers))
        except MeshError as error:
            reason = error
            continue
        # Elements that are inverted while straight may be sound when curved; those of no volume have no gradients.
        if np.abs(scaled_jacobian(straight.points, straight.tets)).min() < _FLAT:
            reason = MeshError("the mesh has a flat element")
            continue
        heights = [level.height for level in levels]
        B, offset = following(inside, straight.points, surface.B, surface.offset)
        result = relax(
            build_morph(named(straight, wedges), B, offset, exact, finer * size, surface.param, heights), exact
        )
        result = replace(result, mesh=result.at(exact))
        worst = scaled_jacobian(result.mesh.points, result.mesh.tets).min()
        if worst > _WORST:
            return result
        reason = MeshError(f"the mesh has an element of quality {worst:.2g}")
    raise MeshError(f"{reason}; surfaces may touch, or the mesh size of {size:g} mm may be too coarse for the walls")
