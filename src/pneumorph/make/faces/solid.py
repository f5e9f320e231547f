"""The solid of a design of a body from a CAD file."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder
from OCP.BRepBuilderAPI import BRepBuilderAPI_Transform
from OCP.BRepClass3d import BRepClass3d
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.gp import gp_Pnt, gp_Trsf
from OCP.ShapeUpgrade import ShapeUpgrade_ShapeDivideClosed
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape, TopoDS_Solid

from pneumorph.cad.boxes import boxes_of, nearest
from pneumorph.cad.shells import quarters
from pneumorph.geometry import Body
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.start import faces_of, solid_of, surface_parts
from pneumorph.make.checks import parts_of
from pneumorph.make.faces.checks import triangles_of
from pneumorph.make.faces.shape import Displacement, Displacer
from pneumorph.make.step import read_step
from pneumorph.problem import Problem
from pneumorph.processes import temporary_folder

Array = NDArray[np.float64]

_COARSE = 30.0
"""Chords along the diagonal of a body with which it is seen which of its faces are which."""


@dataclass(frozen=True, eq=False)
class Made:
    """The solid of a design.

    Attributes
    ----------
    shape : TopoDS_Solid
    inner : dict of TopoDS_Solid
        What fills the closed voids, by the names of the chambers.
    shells : int
        Of the solid.
    deviation : float
        Of its faces and edges from the displaced ones of the file, at the points compared, mm.
    """

    shape: TopoDS_Shape
    inner: dict[str, TopoDS_Shape]
    shells: int
    deviation: float


def displaced_solid(problem: Problem, body: Body[LatticeSurface]) -> Made:
    """The solid in the CAD file of a problem as a design displaces it.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    shape = _in_the_file(problem)
    surface = _which(problem, body, shape)
    displacements = list(map(displacement, body.surfaces))
    made = Displacer(lambda face: displacements[surface(face)])
    (whole,) = parts_of(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    solid, inner = made.shape(whole), {}
    outside = BRepClass3d.OuterShell_s(TopoDS.Solid(whole))
    shells = parts_of(whole, TopAbs_ShapeEnum.TopAbs_SHELL)
    for shell in shells:
        if not shell.IsSame(outside):
            first = TopoDS.Face(parts_of(shell, TopAbs_ShapeEnum.TopAbs_FACE)[0])
            inner[body.surfaces[surface(first)].name] = _filled(made.shape(shell))
    return Made(solid, inner, len(shells), made.deviation)


def _filled(shell: TopoDS_Shape) -> TopoDS_Shape:
    """The solid within a shell of a void."""
    filled = TopoDS_Solid()
    BRep_Builder().MakeSolid(filled)
    BRep_Builder().Add(filled, shell.Reversed())
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
    return divided.Result()


def _which(problem: Problem, body: Body[LatticeSurface], shape: TopoDS_Shape) -> Callable[[TopoDS_Face], int]:
    """The number of the surface of each face: that most of its triangles are on."""
    faces = faces_of(problem)
    parts = list(surface_parts(problem, faces).values())
    flat = quarters(np.concatenate([faces.triangles[own] for own in parts]))
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
