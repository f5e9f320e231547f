"""Simple solids and their combinations in OpenCASCADE."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from OCP.BRepAlgoAPI import BRepAlgoAPI_Common, BRepAlgoAPI_Cut, BRepAlgoAPI_Fuse
from OCP.BRepBuilderAPI import BRepBuilderAPI_MakeFace, BRepBuilderAPI_MakePolygon
from OCP.BRepPrimAPI import BRepPrimAPI_MakeCone, BRepPrimAPI_MakeCylinder, BRepPrimAPI_MakePrism
from OCP.collections import List_TopoDS_Shape
from OCP.gp import gp_Ax2, gp_Dir, gp_Pnt, gp_Vec
from OCP.TopoDS import TopoDS_Shape

from pneumorph.errors import ComputationError

Array = NDArray[np.float64]


def radial(angle: float) -> Array:
    """Unit vector at an angle about z."""
    return np.array([np.cos(angle), np.sin(angle), 0.0])


def across(angle: float) -> Array:
    """Unit vector of growing angle."""
    return np.array([-np.sin(angle), np.cos(angle), 0.0])


def point(coordinates: Sequence[float] | Array) -> gp_Pnt:
    """A point of OpenCASCADE."""
    return gp_Pnt(*map(float, coordinates))


def cylinder(
    start: Sequence[float] | Array, direction: Sequence[float] | Array, radius: float, height: float
) -> TopoDS_Shape:
    """A cylinder.

    Parameters
    ----------
    start : (3,)
        Centre of the first end, mm.
    direction : (3,)
        Of the axis, away from there.
    radius, height : float
        mm.
    """
    axis = gp_Ax2(point(start), gp_Dir(*map(float, direction)))
    return BRepPrimAPI_MakeCylinder(axis, float(radius), float(height)).Shape()


def cone(
    start: Sequence[float] | Array, direction: Sequence[float] | Array, first: float, last: float, height: float
) -> TopoDS_Shape:
    """A truncated cone; a cylinder where both radii are equal.

    Parameters
    ----------
    start : (3,)
        Centre of the first end, mm.
    direction : (3,)
        Of the axis, away from there.
    first, last : float
        Radii of both ends, mm.
    height : float
        mm.
    """
    if abs(first - last) < 1e-9:
        return cylinder(start, direction, first, height)
    axis = gp_Ax2(point(start), gp_Dir(*map(float, direction)))
    return BRepPrimAPI_MakeCone(axis, float(first), float(last), float(height)).Shape()


def prism(corners: Sequence[Array], along: Sequence[float] | Array) -> TopoDS_Shape:
    """The prism of a polygon that is moved along a vector."""
    polygon = BRepBuilderAPI_MakePolygon()
    for corner in corners:
        polygon.Add(point(corner))
    polygon.Close()
    face = BRepBuilderAPI_MakeFace(polygon.Wire()).Face()
    return BRepPrimAPI_MakePrism(face, gp_Vec(*map(float, along))).Shape()


def fuse(shape: TopoDS_Shape, others: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    """A shape united with others."""
    return _boolean(BRepAlgoAPI_Fuse(), shape, others)


def cut(shape: TopoDS_Shape, others: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    """A shape without others."""
    return _boolean(BRepAlgoAPI_Cut(), shape, others)


def common(shape: TopoDS_Shape, other: TopoDS_Shape) -> TopoDS_Shape:
    """What two shapes share."""
    return _boolean(BRepAlgoAPI_Common(), shape, [other])


def _boolean(operation, shape: TopoDS_Shape, others: Sequence[TopoDS_Shape]) -> TopoDS_Shape:
    if not others:
        return shape
    arguments, tools = List_TopoDS_Shape(), List_TopoDS_Shape()
    arguments.Append(shape)
    for other in others:
        tools.Append(other)
    operation.SetArguments(arguments)
    operation.SetTools(tools)
    operation.Build()
    if not operation.IsDone():
        raise ComputationError("OpenCASCADE could not combine two solids of the mould; try another make.mould_wall")
    return operation.Shape()
