"""Meshes of the bodies of a problem, whatever their surfaces are."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from pneumorph.doing import doing
from pneumorph.geometry import Body
from pneumorph.geometry.tube import build_covers, build_levels, build_linings, build_wedges
from pneumorph.mesh import Mesher, Morph, TetMesh
from pneumorph.mesh.bisect import as_fine_as
from pneumorph.mesh.faces import FacesMesher
from pneumorph.mesh.faces.cover import FaceCover
from pneumorph.mesh.tube import TubeMesher
from pneumorph.problem import FibresSpec, Problem, Reinforcement, SolidSpec, reinforcements
from pneumorph.problem.mirrored_solid import chamber_images
from pneumorph.problem.regions import REST
from pneumorph.symmetry.part import Part


def mesher_of(problem: Problem, part: Part, size: float | None = None) -> Mesher:
    """What meshes the bodies of a problem with their regions and covers.

    Parameters
    ----------
    problem : whose regions and covers they have.
    part : of the bodies that is meshed; all of one where the cut of a sector would cross itself or a surface.
    size : of the elements, mm; by default that of the problem.
    """
    solid = problem.solid
    if solid is not None:
        regions = {each.name: np.array(each.inside) for each in problem.region}
        return FacesMesher(
            solid.faces,
            solid.ends_at,
            solid.chambers_at,
            size or problem.mesh.size,
            regions=regions,
            rest=REST,
            covers=[_cover(each, solid) for each in reinforcements(problem)],
            part=part,
            images={plane: chamber_images(solid, plane) or {} for plane in part},
        )
    return TubeMesher(
        size or problem.mesh.size,
        part,
        linings=build_linings(problem.tubes, problem.region),
        covers=build_covers(problem.tubes, reinforcements(problem)),
        levels=build_levels(problem.tubes, problem.region),
        wedges=build_wedges(problem.tubes, problem.region),
    )


def _cover(each: Reinforcement, body: SolidSpec) -> FaceCover:
    """Where a reinforcement lies on a body from a file."""
    base, tip = body.ends
    own = each.along if isinstance(each, FibresSpec) else None
    x, y, z = own or ((tip - base) / np.linalg.norm(tip - base)).tolist()
    on = None if each.on is None else tuple(chosen.where for chosen in each.on)
    return FaceCover(each.name, each.surfaces, on, (x, y, z), isinstance(each, FibresSpec))


def mesh_of(problem: Problem, body: Body, part: Part, size: float | None = None, like: TetMesh | None = None) -> Morph:
    """Mesh a body of a problem, see `mesher_of`.

    What cannot be meshed so is tried with finer elements.

    Parameters
    ----------
    problem : Problem
        Whose regions and covers the body has.
    body : Body
        One of its designs.
    part : Part
        Of the body that is meshed.
    size : float, optional
        Edge length of the elements, mm; by default that of the problem.
    like : TetMesh, optional
        Another mesh of the same part; elements are divided where its were, see `as_fine_as`.

    Raises
    ------
    MeshError
        If the body cannot be meshed.
    """
    with doing("meshing"):
        mesher = mesher_of(problem, part, size)
        morph = mesher.mesh(body)
        return as_fine_like(morph, body.control_points(), like, mesher.heights)


def as_fine_like(morph: Morph, P: np.ndarray, like: TetMesh | None, heights: Sequence[float]) -> Morph:
    """A morph with its elements divided where those of another mesh were, if it is one of the same part."""
    if like is None or like.halved is None or like.part != morph.mesh.part:
        return morph
    return as_fine_as(morph, P, like, heights)
