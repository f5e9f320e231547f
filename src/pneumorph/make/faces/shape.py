"""The solids of a CAD file with every face and edge where a design moves it.

Faces keep their parameters: that of a point of a displaced face is that of the point in the file. So edges keep their
curves in the parameter planes, and which of them bound which face stays as it is.
"""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Builder, BRep_Tool
from OCP.BRepTools import BRepTools
from OCP.collections import (
    Array1_double,
    Array1_gp_Pnt,
    Array1_int,
    Array2_gp_Pnt,
    IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher,
)
from OCP.Geom import Geom_BSplineCurve, Geom_BSplineSurface, Geom_Curve, Geom_Surface
from OCP.gp import gp_Pnt
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Edge, TopoDS_Face, TopoDS_Iterator, TopoDS_Shape, TopoDS_Vertex

from pneumorph.make.faces.splines import DEGREE, Spline, fitted

Array = NDArray[np.float64]

FIT = 1e-3
"""`Displacement.fit` of what is displaced by splines."""

STILL = 1e-7
"""Faces and edges that are displaced by less are as in the file, mm; this is the tolerance of OpenCASCADE."""

_BUILDER = BRep_Builder()
_HERE = TopLoc_Location()
_START = 3
"""Knot spans to begin with where nothing else is known."""
_TESTS = np.linspace(0.0, 1.0, 5)
_ALONG = ((np.arange(50) + 0.37) / 50.0).tolist()
"""Where an edge is compared with its faces: not at equal parts, where splines go through what they are to be."""
_SAFETY = 1.5
"""By how much the tolerance of an edge is larger than the distances found."""


@dataclass(frozen=True, eq=False)
class Displacement:
    """How a part of a body is displaced.

    Attributes
    ----------
    move : function
        From places (n, 3) in the file to places (n, 3) of the design, mm.
    lower, upper : (3,) array
        Corners of the box in which it is known, mm.
    planes : sequence of (k,) array
        Where it is less smooth: the knots along x, y and z, mm.
    fit : float
        Distance of splines from the displaced faces and edges that is near enough, mm.
    """

    move: Callable[[Array], Array]
    lower: Array
    upper: Array
    planes: Sequence[Array]
    fit: float = FIT


@dataclass(eq=False)
class Displacer:
    """Displaces shapes; what several of them share stays shared.

    Attributes
    ----------
    of_face : function
        The displacement of a face.
    deviation : float
        The largest distance of what was made from what it is to be, at the points compared, mm.
    """

    of_face: Callable[[TopoDS_Face], Displacement]
    deviation: float = 0.0
    _made: dict[int, Any] = field(default_factory=dict)
    _known: Any = field(default_factory=IndexedMap_TopoDS_Shape_TopTools_ShapeMapHasher)

    def shape(self, shape: TopoDS_Shape) -> TopoDS_Shape:
        """A compound, solid or shell, displaced."""
        if shape.ShapeType() == TopAbs_ShapeEnum.TopAbs_FACE:
            made = self._once(shape, partial(self._face, TopoDS.Face(_forward(shape))))
        else:
            made = self._once(shape, lambda: self._around(_forward(shape)))
        return made.Oriented(shape.Orientation())

    def _around(self, shape: TopoDS_Shape) -> TopoDS_Shape:
        made = shape.EmptyCopied()
        # What is in it comes with its location.
        made.Location(_HERE)
        for part in _parts(shape):
            _BUILDER.Add(made, self.shape(part))
        made.Closed(shape.Closed())
        return made

    def _once(self, shape: TopoDS_Shape, make: Callable[[], Any]) -> Any:
        number = self._known.Add(shape)
        if number not in self._made:
            self._made[number] = make()
        return self._made[number]

    def _face(self, face: TopoDS_Face) -> TopoDS_Face:
        """A face that is turned forward."""
        by = self.of_face(face)
        surface, bounds = BRep_Tool.Surface_s(face), _bounds(face)
        spline = fitted_surface(surface, bounds, by)
        made = TopoDS_Face()
        _BUILDER.MakeFace(made, surface if spline is None else _surface(spline), STILL)
        new = BRep_Tool.Surface_s(made)
        self.deviation = max(self.deviation, 0.0 if spline is None else spline.deviation)
        for wire in _parts(face):
            around = _forward(wire.EmptyCopied())
            around.Location(_HERE)
            for edge in map(TopoDS.Edge, _parts(_forward(wire))):
                own = self._once(edge, partial(self._edge, edge, by))
                self._lie(own, edge, face, new)
                _BUILDER.Add(around, own.Oriented(edge.Orientation()))
            around.Closed(True)
            _BUILDER.Add(made, around.Oriented(wire.Orientation()))
        return made

    def _edge(self, edge: TopoDS_Edge, by: Displacement) -> TopoDS_Edge:
        made, edge = TopoDS_Edge(), TopoDS.Edge(_forward(edge))
        if BRep_Tool.Degenerated_s(edge):
            _BUILDER.MakeEdge(made)
            _BUILDER.Degenerated(made, True)
        else:
            curve, (start, stop) = BRep_Tool.Curve_s(edge, 0.0, 0.0), BRep_Tool.Range_s(edge)
            spline = fitted_curve(curve, (start, stop), by)
            self.deviation = max(self.deviation, 0.0 if spline is None else spline.deviation)
            _BUILDER.MakeEdge(made, curve if spline is None else _curve(spline), STILL)
            _BUILDER.Range(made, start, stop)
        for vertex in map(TopoDS.Vertex, _parts(edge)):
            _BUILDER.Add(made, self._once(vertex, partial(self._vertex, vertex, by)).Oriented(vertex.Orientation()))
        return made

    def _vertex(self, vertex: TopoDS_Vertex, by: Displacement) -> TopoDS_Vertex:
        made = TopoDS_Vertex()
        _BUILDER.MakeVertex(made, _point(by.move(_coordinates([BRep_Tool.Pnt_s(vertex)]))[0]), STILL)
        return made

    def _lie(self, made: TopoDS_Edge, edge: TopoDS_Edge, face: TopoDS_Face, new: Geom_Surface) -> None:
        """Give an edge the curve in the parameter plane of a displaced face that it has in the file."""
        forward = TopoDS.Edge(_forward(edge))
        flat, span = BRep_Tool.CurveOnSurface_s(forward, face, 0.0, 0.0), BRep_Tool.Range_s(forward, face)
        _BUILDER.UpdateEdge(made, flat, new, _HERE, STILL)
        _BUILDER.Range(made, new, _HERE, *span)
        if BRep_Tool.Degenerated_s(edge):
            return
        curve, (start, stop) = BRep_Tool.Curve_s(made, 0.0, 0.0), BRep_Tool.Range_s(made)
        places = [flat.Value(span[0] + t * (span[1] - span[0])) for t in _ALONG]
        here = _coordinates([new.Value(place.X(), place.Y()) for place in places])
        there = _coordinates([curve.Value(start + t * (stop - start)) for t in _ALONG])
        away = float(np.linalg.norm(here - there, axis=1).max())
        if away > STILL:
            _BUILDER.UpdateEdge(made, _SAFETY * away)
            for vertex in map(TopoDS.Vertex, _parts(made)):
                _BUILDER.UpdateVertex(vertex, _SAFETY * away)


def fitted_surface(
    surface: Geom_Surface, bounds: tuple[tuple[float, float], tuple[float, float]], by: Displacement
) -> Spline | None:
    """A surface between parameters, displaced; None if it stays."""

    def places(*at: Array) -> Array:
        return _coordinates([surface.Value(u, v) for u in at[0].tolist() for v in at[1].tolist()])

    knots = [[], []]
    if isinstance(surface, Geom_BSplineSurface):
        knots = [_knots(surface, side) for side in "UV"]
    return _fitted(places, bounds, knots, by)


def fitted_curve(curve: Geom_Curve, bounds: tuple[float, float], by: Displacement) -> Spline | None:
    """A curve between parameters, displaced; None if it stays."""

    def places(*at: Array) -> Array:
        return _coordinates([curve.Value(t) for t in at[0].tolist()])

    return _fitted(places, (bounds,), [_knots(curve) if isinstance(curve, Geom_BSplineCurve) else []], by)


def _fitted(
    places: Callable[..., Array],
    bounds: Sequence[tuple[float, float]],
    knots: Sequence[Sequence[float]],
    by: Displacement,
) -> Spline | None:
    def value(*at: Array) -> tuple[Array, NDArray[np.bool_]]:
        shape, points = tuple(map(len, at)), places(*at)
        inside = np.all((points >= by.lower - STILL) & (points <= by.upper + STILL), axis=1)
        return by.move(points).reshape(*shape, 3), inside.reshape(shape)

    starts = [_begin(places, bounds, axis, own, by) for axis, own in enumerate(knots)]
    tests = [_spread(np.unique(each)) for each in starts]
    moved, inside = value(*tests)
    away = np.linalg.norm(moved - places(*tests).reshape(moved.shape), axis=-1)
    if away[inside].max(initial=0.0) < STILL:
        return None
    return fitted(value, starts, by.fit)


def _spread(ends: Array) -> Array:
    return np.unique((ends[:-1, None] + np.diff(ends)[:, None] * _TESTS).ravel())


def _begin(
    places: Callable[..., Array],
    bounds: Sequence[tuple[float, float]],
    axis: int,
    own: Sequence[float],
    by: Displacement,
) -> Array:
    """Knots along a parameter to begin with: where the surface or its displacement is less smooth, if that is known."""
    start, stop = bounds[axis]
    tests = [low + (high - low) * _TESTS for low, high in bounds]
    grid = np.moveaxis(places(*tests).reshape(*(len(each) for each in tests), 3), axis, 0).reshape(len(_TESTS), -1, 3)
    # Along a parameter that is a coordinate, up to a factor, the displacement has its knots in known places.
    straight = grid[0] + _TESTS[:, None, None] * (grid[-1] - grid[0])
    along = grid[-1, 0] - grid[0, 0]
    coordinate = int(np.abs(along).argmax())
    rest = np.delete(np.arange(3), coordinate)
    size = np.abs(along[coordinate])
    if (
        np.abs(grid - straight).max() < STILL
        and np.abs(along[rest]).max() < STILL
        and np.ptp(grid[0, :, coordinate]) < STILL
        and size > STILL
    ):
        inner = start + (by.planes[coordinate] - grid[0, 0, coordinate]) / along[coordinate] * (stop - start)
    else:
        spacing = np.min([np.diff(each).min() for each in by.planes])
        length = np.linalg.norm(np.diff(grid, axis=0), axis=2).sum(axis=0).max()
        inner = np.linspace(start, stop, max(_START, int(length / spacing) + 1) + 1)
    near = 1e-6 * (stop - start)
    inner = inner[(inner > start + near) & (inner < stop - near)]
    own = [each for each in own if start + near < each < stop - near]
    # Those of the surface come with their multiplicity, and none beside them.
    inner = inner[~(np.abs(inner[:, None] - np.array(own)) < near).any(axis=1)] if own else inner
    return np.sort(np.concatenate([[start], inner, own, [stop]]))


def _knots(spline: Any, side: str = "") -> list[float]:
    """The inner knots of a spline, so often that a cubic one is as smooth there."""
    degree = getattr(spline, f"{side}Degree")()
    knots: list[float] = []
    for number in range(2, getattr(spline, f"Nb{side}Knots")()):
        smooth = degree - getattr(spline, f"{side}Multiplicity")(number)
        knots += [getattr(spline, f"{side}Knot")(number)] * max(1, DEGREE - max(smooth, 0))
    return knots


def _bounds(face: TopoDS_Face) -> tuple[tuple[float, float], tuple[float, float]]:
    """The rectangle of parameters of a face."""
    u, u_end, v, v_end = BRepTools.UVBounds_s(face)
    surface = BRep_Tool.Surface_s(face)
    low, high, lower, upper = surface.Bounds()
    if not surface.IsUPeriodic():
        u, u_end = max(u, low), min(u_end, high)
    if not surface.IsVPeriodic():
        v, v_end = max(v, lower), min(v_end, upper)
    return (u, u_end), (v, v_end)


def _parts(shape: TopoDS_Shape) -> list[TopoDS_Shape]:
    parts, each = [], TopoDS_Iterator(shape)
    while each.More():
        parts.append(each.Value())
        each.Next()
    return parts


def _forward(shape: TopoDS_Shape) -> TopoDS_Shape:
    return shape.Oriented(TopAbs_Orientation.TopAbs_FORWARD)


def _coordinates(points: Sequence[gp_Pnt]) -> Array:
    return np.array([(point.X(), point.Y(), point.Z()) for point in points]).reshape(-1, 3)


def _point(coordinates: Array) -> gp_Pnt:
    return gp_Pnt(*map(float, coordinates))


def _surface(spline: Spline) -> Geom_BSplineSurface:
    n, m, _ = spline.poles.shape
    poles = Array2_gp_Pnt(1, n, 1, m)
    for i, j in np.ndindex(n, m):
        poles.SetValue(i + 1, j + 1, _point(spline.poles[i, j]))
    (u, times_u), (v, times_v) = map(_distinct, spline.knots)
    return Geom_BSplineSurface(poles, u, v, times_u, times_v, DEGREE, DEGREE)


def _curve(spline: Spline) -> Geom_BSplineCurve:
    poles = Array1_gp_Pnt(1, len(spline.poles))
    for i, pole in enumerate(spline.poles, 1):
        poles.SetValue(i, _point(pole))
    return Geom_BSplineCurve(poles, *_distinct(spline.knots[0]), DEGREE)


def _distinct(knots: Array) -> tuple[Array1_double, Array1_int]:
    """Distinct knots and their multiplicities."""
    values, counts = np.unique(knots, return_counts=True)
    distinct, times = Array1_double(1, len(values)), Array1_int(1, len(values))
    for index, (knot, count) in enumerate(zip(values.tolist(), counts.tolist(), strict=True), 1):
        distinct.SetValue(index, knot)
        times.SetValue(index, count)
    return distinct, times
