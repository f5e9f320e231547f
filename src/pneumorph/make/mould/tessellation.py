"""Triangles of solids that OpenCASCADE has built, within a chord error on their spline surfaces.

OpenCASCADE exceeds the error that it is asked for by up to three times, and by asking for less one only gets more
triangles elsewhere. So edges inside a spline face whose middles are too far from it are split there.
"""

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
from OCP.TopAbs import TopAbs_Orientation, TopAbs_ShapeEnum
from OCP.TopExp import TopExp_Explorer
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Shape

from pneumorph.make.triangles import Triangles, together

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

_ANGLE = 0.35  # largest angle between neighbouring triangles, radians
_DECIMALS = 6  # faces share their edges' points up to rounding
_EDGES = 0.8  # error that is asked for, relative to the chord error: edges of faces are not split afterwards
_SPLIT = 0.9  # of the chord error: edges with a larger error are split; inside a triangle it is little larger
_MOST = 8  # successive splits


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


class _Face(NamedTuple):
    """The triangles of a face: points (n, 3), their parameters (n, 2) if it is a spline, and corners (m, 3)."""

    points: Array
    parameters: Array
    corners: Ints
    spline: Geom_BSplineSurface | None


def tessellated(shape: TopoDS_Shape, chord: float) -> Tessellation:
    """Triangulate a solid with a chord error in mm."""
    faces = [_refined(face, _SPLIT * chord) for face in _meshed(shape, _EDGES * chord)]
    whole = together([Triangles(face.points, face.corners) for face in faces])
    spline = np.concatenate([np.full(len(face.corners), face.spline is not None) for face in faces])
    _, kept, merged = np.unique(np.round(whole.points, _DECIMALS) + 0.0, axis=0, return_index=True, return_inverse=True)
    joined = merged.reshape(-1)[whole.corners]
    proper = (joined != np.roll(joined, 1, axis=1)).all(axis=1)
    return Tessellation(Triangles(whole.points[kept], joined[proper]), spline[proper])


def _meshed(shape: TopoDS_Shape, chord: float) -> list[_Face]:
    """The triangles of every face as OpenCASCADE makes them."""
    BRepTools.Clean_s(shape)
    BRepMesh_IncrementalMesh(shape, chord, False, _ANGLE, True)
    faces, explorer = [], TopExp_Explorer(shape, TopAbs_ShapeEnum.TopAbs_FACE)
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
        faces.append(_Face(points, parameters, corners - 1, spline))
    return faces


def _refined(face: _Face, most: float) -> _Face:
    """The face with edges split in their middles until these are within `most` mm of its spline."""
    spline = face.spline
    if spline is None:
        return face
    known: set[tuple[int, ...]] = set()
    for _ in range(_MOST):
        sides = np.sort(face.corners[:, [[0, 1], [1, 2], [2, 0]]], axis=2).reshape(-1, 2)
        edges, each, count = np.unique(sides, axis=0, return_inverse=True, return_counts=True)
        # Edges that belong to one triangle are shared with another face, which has the same points on them.
        new = [k for k, pair in enumerate(edges.tolist()) if count[k] == 2 and tuple(pair) not in known]
        middle = face.parameters[edges[new]].mean(axis=1)
        exact = np.array([(p.X(), p.Y(), p.Z()) for p in (spline.Value(u, v) for u, v in middle.tolist())])
        ends = face.points[edges[new]]
        away = np.linalg.norm(exact.reshape(-1, 3) - ends.mean(axis=1), axis=1)
        # Next to a pole the mean of two parameters may be anywhere around it.
        split = (away > most) & (away < 0.5 * np.linalg.norm(ends[:, 0] - ends[:, 1], axis=1))
        known.update(map(tuple, edges[new].tolist()))
        if not split.any():
            break
        inserted = np.full(len(edges), -1)
        inserted[np.array(new)[split]] = len(face.points) + np.arange(np.count_nonzero(split))
        face = _Face(
            np.concatenate([face.points, exact[split]]),
            np.concatenate([face.parameters, middle[split]]),
            _divided(face.corners, inserted[each.reshape(-1, 3)]),
            spline,
        )
    return face


def _divided(corners: Ints, middles: Ints) -> Ints:
    """Divide triangles (m, 3) at the points in the middles of their edges 01, 12, 20, where these are not -1."""
    parts = [corners[(middles < 0).all(axis=1)]]
    for first in range(3):
        turn = [first, (first + 1) % 3, (first + 2) % 3]
        (a, b, c), (ab, bc, ca) = corners[:, turn].T, middles[:, turn].T
        one = (ab >= 0) & (bc < 0) & (ca < 0)
        two = (ab >= 0) & (bc >= 0) & (ca < 0)
        parts += [np.stack(each, axis=1)[one] for each in ((a, ab, c), (ab, b, c))]
        parts += [np.stack(each, axis=1)[two] for each in ((ab, b, bc), (a, ab, bc), (a, bc, c))]
    all_three = (middles >= 0).all(axis=1)
    (a, b, c), (ab, bc, ca) = corners[all_three].T, middles[all_three].T
    parts += [np.stack(each, axis=1) for each in ((a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca))]
    return np.concatenate(parts)
