"""Solids in OpenCASCADE: the exact patches of every tube with shared edges, closed by planes or poles."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.collections import Array1_double, Array1_int, Array2_gp_Pnt
from OCP.Geom import Geom_BSplineSurface, Geom_Curve, Geom_Plane
from OCP.Geom2d import Geom2d_Line
from OCP.gp import gp_Dir, gp_Dir2d, gp_Pnt, gp_Pnt2d
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Shell, TopoDS_Solid, TopoDS_Vertex, TopoDS_Wire

from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.make.patches import SAME, Patch, patches

# mm, the default of OpenCASCADE; points that should coincide differ by rounding, which is eight orders smaller.
_TOLERANCE = 1e-7
_HERE = TopLoc_Location()
_BUILDER = BRep_Builder()
_ALONG_Q, _ALONG_R = gp_Dir2d(1.0, 0.0), gp_Dir2d(0.0, 1.0)


def solid(surfaces: Iterable[TubeSurface]) -> TopoDS_Solid:
    """Build the solid bounded by surfaces, in mm: the first is its outer shell, the others are inner shells.

    Parameters
    ----------
    surfaces : iterable of TubeSurface
        A body's surfaces, the exterior first, or one chamber from `fill_chamber`.
    """
    made = TopoDS_Solid()
    _BUILDER.MakeSolid(made)
    for surface in surfaces:
        _BUILDER.Add(made, _shell(surface))
    return made


def bonded_faces(made: TopoDS_Solid, exterior: TubeSurface) -> Iterator[TopoDS_Face]:
    """The faces of what is bonded to the plate at a tip that is a dome, of the solid of a body with this exterior."""
    if exterior.bonded == 1.0:
        return
    shell = TopExp_Explorer(made, TopAbs_ShapeEnum.TopAbs_SHELL).Current()
    faces = TopExp_Explorer(shell, TopAbs_ShapeEnum.TopAbs_FACE)
    while faces.More():
        face = TopoDS.Face(faces.Current())
        surface = BRep_Tool.Surface_s(face)
        if isinstance(surface, Geom_BSplineSurface) and surface.Bounds()[2] > exterior.bonded - SAME:
            yield face
        faces.Next()


def fill_chamber(chamber: TubeSurface) -> TubeSurface:
    """The surface of a chamber as the exterior of the solid that fills it."""
    # The first column stays and q runs in the opposite sense, so that the normal points out of the filling solid.
    return replace(chamber, net=chamber.net[:, -np.arange(chamber.net.shape[1])], cavity=False)


def _shell(surface: TubeSurface) -> TopoDS_Shell:
    """The closed shell of a tube. The normals of its faces are r_q × r_r, so they point out of the solid.

    Vertices and edges are arranged in rings from base to tip: vertex k is at the start of patch k, parallel k runs
    along that patch to vertex k + 1, and meridian k from vertex k of a ring to vertex k of the next ring.
    """
    rows = [[_spline(patch) for patch in row] for row in patches(surface)]
    levels = [*(row[0].Bounds()[2] for row in rows), 1.0]
    around = range(len(rows[0]))
    following = [*around[1:], 0]
    rings, parallels = [], []
    for row, r in zip([*rows, rows[-1]], levels, strict=True):
        pole = (r == 0.0 and surface.poles[0]) or (r == 1.0 and surface.poles[1])
        if pole:
            ring = [_vertex(row[0].Value(0.0, r))] * len(row)
        else:
            ring = [_vertex(spline.Value(spline.Bounds()[0], r)) for spline in row]
        curves = [None if pole else spline.VIso(r) for spline in row]
        rings.append(ring)
        parallels.append([_edge(curves[k], ring[k], ring[following[k]]) for k in around])
    meridians = [
        [_edge(row[k].UIso(row[k].Bounds()[0]), rings[j][k], rings[j + 1][k]) for k in around]
        for j, row in enumerate(rows)
    ]

    shell = TopoDS_Shell()
    _BUILDER.MakeShell(shell)
    for j, row in enumerate(rows):
        for k, spline in enumerate(row):
            sides = parallels[j][k], meridians[j][following[k]], parallels[j + 1][k], meridians[j][k]
            _BUILDER.Add(shell, _patch_face(spline, *sides))
    # Normals point out of the material: away from the body's middle on the exterior, towards it on a chamber.
    out, clockwise = -1.0 if surface.cavity else 1.0, [edge.Reversed() for edge in reversed(parallels[0])]
    upwards, onwards = (out * np.array(direction) for direction in surface.directions)
    edges = (clockwise, parallels[-1])
    for pole, centre, normal, rim in zip(surface.poles, surface.end_centres, (-upwards, onwards), edges, strict=True):
        if not pole:
            _BUILDER.Add(shell, _face(Geom_Plane(_point(centre), gp_Dir(*normal)), rim))
    shell.Closed(True)
    return shell


def _patch_face(
    spline: Geom_BSplineSurface, below: TopoDS_Edge, right: TopoDS_Edge, above: TopoDS_Edge, left: TopoDS_Edge
) -> TopoDS_Face:
    """The face of a whole patch; its edges get their curves in the parameter plane."""
    q, q_end, r, r_end = spline.Bounds()
    for edge, start, along, span in (
        (below, gp_Pnt2d(0.0, r), _ALONG_Q, (q, q_end)),
        (above, gp_Pnt2d(0.0, r_end), _ALONG_Q, (q, q_end)),
        (left, gp_Pnt2d(q, 0.0), _ALONG_R, (r, r_end)),
        (right, gp_Pnt2d(q_end, 0.0), _ALONG_R, (r, r_end)),
    ):
        _BUILDER.UpdateEdge(edge, Geom2d_Line(start, along), spline, _HERE, _TOLERANCE)
        _BUILDER.Range(edge, spline, _HERE, *span)
    return _face(spline, [below, right, above.Reversed(), left.Reversed()])


def _spline(patch: Patch) -> Geom_BSplineSurface:
    n_q, n_r, _ = patch.poles.shape
    poles = Array2_gp_Pnt(1, n_q, 1, n_r)
    for i, j in np.ndindex(n_q, n_r):
        poles.SetValue(i + 1, j + 1, _point(patch.poles[i, j]))
    (q, times_q), (r, times_r) = _knots(patch.q), _knots(patch.r)
    return Geom_BSplineSurface(poles, q, r, times_q, times_r, 3, 3)


def _knots(distinct: NDArray[np.float64]) -> tuple[Array1_double, Array1_int]:
    """Distinct knots and their multiplicities, which are four at both ends and otherwise one."""
    knots, times = Array1_double(1, len(distinct)), Array1_int(1, len(distinct))
    for index, knot in enumerate(distinct, start=1):
        knots.SetValue(index, float(knot))
        times.SetValue(index, 4 if index in (1, len(distinct)) else 1)
    return knots, times


def _point(coordinates: NDArray[np.float64]) -> gp_Pnt:
    return gp_Pnt(*map(float, coordinates))


def _vertex(point: gp_Pnt) -> TopoDS_Vertex:
    vertex = TopoDS_Vertex()
    _BUILDER.MakeVertex(vertex, point, _TOLERANCE)
    return vertex


def _edge(curve: Geom_Curve | None, start: TopoDS_Vertex, stop: TopoDS_Vertex) -> TopoDS_Edge:
    """An edge along a whole curve, or the degenerate edge at a pole if there is no curve."""
    edge = TopoDS_Edge()
    if curve is None:
        _BUILDER.MakeEdge(edge)
        _BUILDER.Degenerated(edge, True)
    else:
        _BUILDER.MakeEdge(edge, curve, _TOLERANCE)
        _BUILDER.Range(edge, curve.FirstParameter(), curve.LastParameter())
    _BUILDER.Add(edge, start)
    _BUILDER.Add(edge, stop.Reversed())
    return edge


def _face(surface: Geom_BSplineSurface | Geom_Plane, edges: Iterable[TopoDS_Edge]) -> TopoDS_Face:
    """The face of a surface inside a closed chain of edges."""
    wire = TopoDS_Wire()
    _BUILDER.MakeWire(wire)
    for edge in edges:
        _BUILDER.Add(wire, edge)
    wire.Closed(True)
    face = TopoDS_Face()
    _BUILDER.MakeFace(face, surface, _TOLERANCE)
    _BUILDER.Add(face, wire)
    return face
