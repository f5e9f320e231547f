"""Checks of the files of a body from a file, which are read back and compared with the design."""

# pyright: reportAttributeAccessIssue=false, reportArgumentType=false
# OCP has no stubs: neither its names nor its types are known.
from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from OCP.BRep import BRep_Tool
from OCP.BRepMesh import BRepMesh_IncrementalMesh
from OCP.gp import gp_Pnt, gp_Vec
from OCP.TopAbs import TopAbs_ShapeEnum
from OCP.TopLoc import TopLoc_Location
from OCP.TopoDS import TopoDS, TopoDS_Face, TopoDS_Shape

from pneumorph.cad.boxes import boxes_of, nearest
from pneumorph.cad.shells import quarters
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.between import Interface
from pneumorph.geometry.lattice.pieces import places_on
from pneumorph.make.checks import Check, parts_of, shells_are, validity, volume_of
from pneumorph.make.faces.triangles import SAMPLES
from pneumorph.make.step import read_step
from pneumorph.make.triangles import Triangles, together

Array = NDArray[np.float64]

DEVIATION = 0.02
"""Largest allowed distance in mm of a point of the design from the faces in a STEP file."""

_CHORD = 0.1
"""Chord error with which it is seen which place of the faces in a STEP file is nearest, mm."""

_NEARER = 3
"""Steps of Newton's method from there."""

_QUADRATURE = 1e-6
"""Relative accuracy to which OpenCASCADE integrates volumes."""


def points_of(surfaces: Sequence[LatticeSurface | Interface]) -> Array:
    """Points (n, 3) of all faces of surfaces and interfaces, displaced, mm."""
    points = []
    for surface in surfaces:
        nodes = surface.outline[surface.patches]
        patch, bary = np.repeat(np.arange(len(nodes)), len(SAMPLES)), np.tile(SAMPLES, (len(nodes), 1))
        points.append(surface.moved(places_on(nodes, patch, bary)))
    return np.concatenate(points)


def volume_within(surfaces: Sequence[LatticeSurface | Interface]) -> float:
    """The volume within surfaces whose normals point outwards all, mm³."""
    # The error of flat triangles is a quarter with halves of their edges.
    shells = [(surface.shell()[0], surface.patches) for surface in surfaces]
    fine = sum(Triangles(points, quarters(patches)).volume for points, patches in shells)
    return (4.0 * fine - sum(Triangles(points, patches[:, :3]).volume for points, patches in shells)) / 3.0


def check_solids(
    path: Path,
    surfaces: Sequence[LatticeSurface | Interface],
    shells: int,
    volumes: Mapping[str, float],
    rubbers: Sequence[str],
) -> Iterator[Check]:
    """Check the solids in a STEP file against the surfaces that bound them.

    Parameters
    ----------
    path : Path
    surfaces : sequence of LatticeSurface or Interface
    shells : int
        Number of closed shells of all solids.
    volumes : mapping of str to float
        Of the rubbers, mm³, by their names.
    rubbers : sequence of str
        That of each solid in the file.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    shape, name = read_step(path), path.name
    closed = shells_are(name, shape, len(rubbers), shells)
    yield closed
    if not closed.passed:
        return
    yield validity(name, shape)
    nearest = Nearest(shape)
    solids = parts_of(shape, TopAbs_ShapeEnum.TopAbs_SOLID)
    for rubber, volume in volumes.items():
        what = "volume error" if len(volumes) == 1 else f"volume error of {rubber}"
        made = sum(volume_of(each, _QUADRATURE) for each, own in zip(solids, rubbers, strict=True) if own == rubber)
        yield Check(name, what, abs(made - volume), DEVIATION * nearest.area, "mm³")
    # Nodes are on the faces of the file, what is between them only in the triangles of a design.
    furthest = float(nearest.distances(np.concatenate([surface.shell()[0] for surface in surfaces])).max())
    yield Check(name, "distance of the design's points from the faces", furthest, DEVIATION, "mm")


class Nearest:
    """The faces of a shape, in coarse triangles to begin with."""

    def __init__(self, shape: TopoDS_Shape) -> None:
        BRepMesh_IncrementalMesh(shape, _CHORD)
        faces = list(map(TopoDS.Face, parts_of(shape, TopAbs_ShapeEnum.TopAbs_FACE)))
        seen = list(map(triangles_of, faces))
        self.surfaces = list(map(BRep_Tool.Surface_s, faces))
        self.face = np.repeat(np.arange(len(faces)), [len(each.corners) for each in seen])
        self.triangles = together(seen)
        self.parameters = np.concatenate(list(map(_parameters, faces)))

    @property
    def area(self) -> float:
        """mm²."""
        a, b, c = np.moveaxis(self.triangles.points[self.triangles.corners], 1, 0)
        return float(np.linalg.norm(np.cross(b - a, c - a), axis=1).sum()) / 2.0

    def distances(self, points: Array) -> Array:
        """Distances (n,) of points (n, 3) from the nearest place that is found on the faces, mm."""
        part = self.triangles
        cell, near = nearest(boxes_of(part.points, part.corners), points)
        corners = part.corners[cell]
        places = np.einsum("nc,ncd->nd", _shares(part.points[corners], near), self.parameters[corners])
        least, spot, along, across = np.full(len(points), np.inf), gp_Pnt(), gp_Vec(), gp_Vec()
        for step in range(_NEARER + 1):
            at = np.empty((len(points), 3, 3))
            for row, face, (u, v) in zip(at, self.face[cell].tolist(), places.tolist(), strict=True):
                self.surfaces[face].D1(u, v, spot, along, across)
                row[:] = [(each.X(), each.Y(), each.Z()) for each in (spot, along, across)]
            away = points - at[:, 0]
            least = np.minimum(least, np.linalg.norm(away, axis=1))
            if step < _NEARER:
                slopes = at[:, 1:]
                square = np.einsum("nac,nbc->nab", slopes, slopes)
                right = np.einsum("nac,nc->na", slopes, away)
                places = places + np.einsum("nab,nb->na", np.linalg.pinv(square, rcond=1e-9), right)
        return least


def _shares(triangles: Array, points: Array) -> Array:
    """Barycentric coordinates (n, 3) of points (n, 3) in the planes of triangles (n, 3, 3)."""
    sides = triangles[:, 1:] - triangles[:, :1]
    square = np.einsum("nac,nbc->nab", sides, sides)
    right = np.einsum("nac,nc->na", sides, points - triangles[:, 0])
    two = np.einsum("nab,nb->na", np.linalg.pinv(square), right)
    return np.column_stack([1.0 - two.sum(axis=1), two])


def _parameters(face: TopoDS_Face) -> Array:
    """The parameters (n, 2) of the nodes of the triangles of a face."""
    mesh = BRep_Tool.Triangulation_s(face, TopLoc_Location())
    nodes = [mesh.UVNode(number) for number in range(1, mesh.NbNodes() + 1)]
    return np.array([(node.X(), node.Y()) for node in nodes])


def triangles_of(face: TopoDS_Face) -> Triangles:
    """The triangles of a face that is meshed."""
    place = TopLoc_Location()
    mesh = BRep_Tool.Triangulation_s(face, place)
    nodes = [mesh.Node(number).Transformed(place.Transformation()) for number in range(1, mesh.NbNodes() + 1)]
    corners = [mesh.Triangle(number).Get() for number in range(1, mesh.NbTriangles() + 1)]
    points = np.array([(node.X(), node.Y(), node.Z()) for node in nodes])
    return Triangles(points, np.array(corners, dtype=np.int64).reshape(-1, 3) - 1)
