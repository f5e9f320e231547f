"""Triangles of solids that OpenCASCADE has built."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.BRepTools import BRepTools
from OCP.Geom import Geom_BSplineSurface
from OCP.IMeshTools import IMeshTools_Parameters
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Shape

from pneumorph.make.triangles import Triangles

_ANGLE = 0.35  # largest angle between neighbouring triangles, radians
_DECIMALS = 6  # faces share their edges' points up to rounding
_FINER, _MOST = 0.6, 3  # factor of the error that is asked for each time, and how often it is reduced


@dataclass(frozen=True, eq=False)
class Tessellation:
    """A closed surface of triangles, and which of its triangles are part of the rubber's own spline surfaces.

    Attributes
    ----------
    triangles : Triangles
    spline : (m,) bool array
        Whether a triangle lies on a B-spline; all other faces are planes, cylinders, cones and spheres.
    """

    triangles: Triangles
    spline: NDArray[np.bool_]


def tessellated(shape: TopoDS_Shape, chord: float) -> Tessellation:
    """Triangulate a solid such that no triangle's centre is farther than the chord error (mm) from its face.

    OpenCASCADE exceeds the error that it is asked for by up to three times, so it is asked for less until it suffices.
    """
    asked = _FINER * chord
    faces = _meshed(shape, asked)
    for _ in range(_MOST):
        if max(_error(face) for face in faces) <= chord:
            break
        asked *= _FINER
        faces = _meshed(shape, asked)
    first = np.cumsum([0, *(len(face.points) for face in faces)])
    points = np.concatenate([face.points for face in faces])
    corners = np.concatenate([face.corners + start for face, start in zip(faces, first, strict=False)])
    spline = np.concatenate([np.full(len(face.corners), face.spline is not None) for face in faces])
    _, kept, merged = np.unique(np.round(points, _DECIMALS) + 0.0, axis=0, return_index=True, return_inverse=True)
    joined = merged.reshape(-1)[corners]
    proper = (joined != np.roll(joined, 1, axis=1)).all(axis=1)
    return Tessellation(Triangles(points[kept], joined[proper]), spline[proper])


class _Face(NamedTuple):
    """The triangles of a face: points (n, 3), their parameters (n, 2), corners (m, 3), and its surface if a spline."""

    points: NDArray[np.float64]
    parameters: NDArray[np.float64]
    corners: NDArray[np.int64]
    spline: Geom_BSplineSurface | None


def _meshed(shape: TopoDS_Shape, chord: float) -> list[_Face]:
    BRepTools.Clean_s(shape)
    settings = IMeshTools_Parameters()
    settings.Deflection = settings.DeflectionInterior = chord
    settings.Angle = settings.AngleInterior = _ANGLE
    settings.InternalVerticesMode = settings.ControlSurfaceDeflection = settings.InParallel = True
    BRepMesh_IncrementalMesh(shape, settings)
    found, explorer = [], TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
    while explorer.More():
        face = TopoDS.Face(explorer.Current())
        explorer.Next()
        mesh, surface = BRep_Tool.Triangulation_s(face, TopLoc_Location()), BRep_Tool.Surface_s(face)
        nodes = [mesh.Node(k) for k in range(1, mesh.NbNodes() + 1)]
        points = np.array([(node.X(), node.Y(), node.Z()) for node in nodes])
        corners = np.array([mesh.Triangle(k).Get() for k in range(1, mesh.NbTriangles() + 1)], dtype=np.int64)[:, -3:]
        if face.Orientation() == TopAbs_Orientation.TopAbs_REVERSED:
            corners = corners[:, ::-1]
        spline, parameters = None, np.zeros((0, 2))
        if isinstance(surface, Geom_BSplineSurface):
            spline = surface
            places = [mesh.UVNode(k) for k in range(1, mesh.NbNodes() + 1)]
            parameters = np.array([(place.X(), place.Y()) for place in places])
        found.append(_Face(points, parameters, corners - 1, spline))
    return found


def _error(face: _Face) -> float:
    """Largest distance of the centre of a triangle from the point of the spline at the mean of its parameters."""
    if face.spline is None:
        return 0.0
    values = [face.spline.Value(u, v) for u, v in face.parameters[face.corners].mean(axis=1).tolist()]
    exact = np.array([(value.X(), value.Y(), value.Z()) for value in values])
    centre = face.points[face.corners]
    normal = np.cross(centre[:, 1] - centre[:, 0], centre[:, 2] - centre[:, 0])
    normal /= np.maximum(np.linalg.norm(normal, axis=1, keepdims=True), 1e-300)
    return float(np.abs(np.einsum("nc,nc->n", exact - centre.mean(axis=1), normal)).max())
