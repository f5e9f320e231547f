"""The solids of a design of a body from a CAD file."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder
from OCP.BRepAlgoAPI import BRepAlgoAPI_BuilderAlgo
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepClass3d import BRepClass3d_SolidClassifier
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.collections import List_TopoDS_Shape
from OCP.gp import gp_Pnt, gp_Trsf
from OCP.ShapeUpgrade import ShapeUpgrade_ShapeDivideClosed
from OCP.TopAbs import TopAbs_ShapeEnum, TopAbs_State
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape, TopoDS_Shell, TopoDS_Solid

from pneumorph.cad.boxes import boxes_of, nearest
from pneumorph.cad.shells import quarters
from pneumorph.geometry import Body
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.between import Interface
from pneumorph.geometry.lattice.start import faces_of, solid_of, surface_parts
from pneumorph.make.checks import parts_of
from pneumorph.make.faces.checks import triangles_of
from pneumorph.make.faces.shape import STILL, Displacement, Displacer
from pneumorph.make.step import read_step
from pneumorph.problem import Problem
from pneumorph.problem.regions import REST
from pneumorph.processes import temporary_folder

Array = NDArray[np.float64]

_COARSE = 30.0
"""Chords along the diagonal of a body with which it is seen which of its faces are which."""


_MEETING = 5e-3
"""`Displacement.fit` where solids meet: displacements there have kinks half way between surfaces."""


@dataclass(frozen=True, eq=False)
class Made:
    """The solids of a design.

    Attributes
    ----------
    solids : tuple of TopoDS_Shape
    rubbers : tuple of str
        The rubber of each: the name of its region.
    inner : dict of TopoDS_Shape
        What fills the closed voids, by the names of the chambers.
    shells : int
        Of all solids.
    deviation : float
        Of faces and edges from the displaced ones of the file, at the points compared, mm.
    """

    solids: tuple[TopoDS_Shape, ...]
    rubbers: tuple[str, ...]
    inner: dict[str, TopoDS_Shape]
    shells: int
    deviation: float


def displaced_solids(problem: Problem, body: Body[LatticeSurface]) -> Made:
    """The solids in the CAD file of a problem as a design displaces them.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    shape = _in_the_file(problem)
    surface = _which(problem, body, shape)
    displacements = [*map(displacement, body.surfaces), _where_solids_meet(body)]
    made = Displacer(lambda face: displacements[surface(face)])
    known = parts_of(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    solids, rubbers = tuple(map(made.shape, known)), tuple(_rubber(problem, solid) for solid in known)
    faces: dict[int, list[TopoDS_Shape]] = {}
    for face in parts_of(shape, TopAbs_ShapeEnum.TopAbs_FACE):
        faces.setdefault(surface(TopoDS.Face(face)), []).append(face)
    closed = {each.name for each in problem.body.chamber if getattr(each, "port", None) is None}
    inner = {
        each.name: _filled([made.shape(face) for face in faces[number]])
        for number, each in enumerate(body.surfaces)
        if each.cavity and each.name in closed
    }
    shells = sum(len(parts_of(solid, TopAbs_ShapeEnum.TopAbs_SHELL)) for solid in known)
    return Made(solids, rubbers, inner, shells, made.deviation)


def _rubber(problem: Problem, solid: TopoDS_Shape) -> str:
    """The name of the region of a solid, whose point is in it, or of the rest."""
    inside = BRepClass3d_SolidClassifier(solid)
    for region in problem.region:
        inside.Perform(gp_Pnt(*map(float, region.inside or ())), STILL)
        if inside.State() == TopAbs_State.TopAbs_IN:
            return region.name
    return REST


def _filled(faces: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    """The solid within the faces around a void."""
    shell, filled = TopoDS_Shell(), TopoDS_Solid()
    builder = BRep_Builder()
    builder.MakeShell(shell)
    for face in faces:
        builder.Add(shell, face)
    shell.Closed(True)
    builder.MakeSolid(filled)
    builder.Add(filled, shell.Reversed())
    return filled


def _in_the_file(problem: Problem) -> TopoDS_Shape:
    """The shape in the file in mm; no face of it is closed in itself."""
    solid = solid_of(problem)
    with temporary_folder() as folder:
        path = folder / f"body.{solid.format}"
        path.write_bytes(solid.content)
        if solid.format == "step":
            shape = read_step(path)
        else:
            shape = TopoDS_Shape()
            BRepTools.Read_s(shape, str(path), BRep_Builder())
    if solid.factor != 1.0:
        larger = gp_Trsf()
        larger.SetScale(gp_Pnt(0.0, 0.0, 0.0), solid.factor)
        shape = BRepBuilderAPI_Transform(shape, larger, True).Shape()
    # STEP readers lose the seams of closed faces.
    divided = ShapeUpgrade_ShapeDivideClosed(shape)
    divided.Perform()
    return _glued(divided.Result())


def _glued(shape: TopoDS_Shape) -> TopoDS_Shape:
    """A shape of whose solids those that touch share the faces where they do."""
    solids = parts_of(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    if len(solids) == 1:
        return shape
    those, fuse = List_TopoDS_Shape(), BRepAlgoAPI_BuilderAlgo()
    for solid in solids:
        those.Append(solid)
    fuse.SetArguments(those)
    fuse.Build()
    return fuse.Shape()


def _which(problem: Problem, body: Body[LatticeSurface], shape: TopoDS_Shape) -> Callable[[TopoDS_Face], int]:
    """The number of the surface of each face: that most of its triangles are on; after all others where solids meet."""
    faces = faces_of(problem)
    parts = [faces.triangles[own] for own in surface_parts(problem, faces).values()] + [faces.between]
    flat = quarters(np.concatenate(parts))
    surface = np.tile(np.repeat(np.arange(len(parts)), list(map(len, parts))), 4)
    known = boxes_of(faces.points, flat)
    BRepMesh_IncrementalMesh(shape, faces.diagonal / _COARSE)

    def find(face: TopoDS_Face) -> int:
        seen = triangles_of(face)
        near = nearest(known, seen.points[seen.corners].mean(axis=1))
        return int(np.bincount(surface[near.triangle]).argmax())

    return find


def displacement(surface: LatticeSurface) -> Displacement:
    """How a surface is displaced."""
    lattice = surface.lattice
    knots = [
        low + basis.breaks * (high - low)
        for basis, low, high in zip(lattice.bases, lattice.lower, lattice.upper, strict=True)
    ]
    return Displacement(surface.moved, lattice.lower, lattice.upper, knots)


def _where_solids_meet(body: Body[LatticeSurface]) -> Displacement:
    """How faces between solids are displaced."""
    meeting = Interface(body, np.zeros((0, 3)), np.zeros((0, 6), dtype=np.int64))
    everywhere = np.full(3, np.inf)
    return Displacement(meeting.moved, -everywhere, everywhere, displacement(body.exterior).planes, _MEETING)
