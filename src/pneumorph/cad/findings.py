"""What is found in a body from a file: its size, its voids, its thinnest wall, and where it intersects itself."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from pneumorph.cad.faces import Faces
from pneumorph.cad.shells import Shells, quarters, shells_of
from pneumorph.interrupts import stop_if_asked

_OFF = 1e-7
"""How far within the solid segments begin, relative to its diagonal: they do not meet the triangle they are of."""

_AT_ONCE = 1000
"""Segments between two looks at whether to stop."""


@dataclass(frozen=True, eq=False)
class Wall:
    """The thinnest place of the solid: its thickness along the normal of a triangle, and its middle (3,), mm."""

    thickness: float
    place: np.ndarray


@dataclass(frozen=True, eq=False)
class Findings:
    """What is found in a body from a file.

    Attributes
    ----------
    lower, upper : (3,) float
        The box that holds it, mm.
    volume : float
        Of the solid without its voids, mm³.
    faces : int
        Their number.
    shells : Shells
    wall : Wall
    crossing : (3,) float or None
        A place where its surface intersects itself, mm.
    """

    lower: np.ndarray
    upper: np.ndarray
    volume: float
    faces: int
    shells: Shells
    wall: Wall
    crossing: np.ndarray | None


def findings_of(faces: Faces) -> Findings:
    """What is found in the triangles of a body, which are taken as four flat ones each.

    Raises
    ------
    MeshError
        If they do not bound one solid.
    """
    shells = shells_of(faces)
    flat = quarters(faces.triangles)
    return Findings(
        lower=faces.points.min(axis=0),
        upper=faces.points.max(axis=0),
        volume=shells.outside.volume + sum(void.volume for void in shells.voids),
        faces=len(np.unique(faces.face)),
        shells=shells,
        wall=thinnest(faces.points, flat, faces.diagonal),
        crossing=crossing(faces.points, flat),
    )


def thinnest(points: np.ndarray, triangles: np.ndarray, diagonal: float) -> Wall:
    """The least thickness of a solid, from the middle of every triangle along its normal, inwards to the other side."""
    corners = points[triangles]
    middles = corners.mean(axis=1)
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    lengths = np.linalg.norm(normals, axis=1)
    real = lengths > 0.0
    middles, inwards = middles[real], -normals[real] / lengths[real, None]
    starts, stops = middles + _OFF * diagonal * inwards, middles + diagonal * inwards
    found = Wall(np.inf, middles[0])
    for middle, hit in zip(middles, _first_hits(points, triangles, starts, stops), strict=True):
        if hit is not None and (thickness := float(np.linalg.norm(hit[0] - middle))) < found.thickness:
            found = Wall(thickness, (hit[0] + middle) / 2.0)
    return found


def crossing(points: np.ndarray, triangles: np.ndarray) -> np.ndarray | None:
    """A place (3,) where an edge goes through a triangle, mm; None if there is none."""
    import ipctk

    ends = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    surface = ipctk.CollisionMesh(points, ends.astype(np.int32), triangles.astype(np.int32))
    if not ipctk.has_intersections(surface, np.asfortranarray(points)):
        return None
    for edge, hit in zip(ends, _first_hits(points, triangles, *points[ends.T]), strict=True):
        if hit is not None and not np.isin(edge, triangles[hit[1]]).any():
            return hit[0]
    return points[ends[0, 0]]


def _first_hits(
    points: np.ndarray, triangles: np.ndarray, starts: np.ndarray, stops: np.ndarray
) -> Iterator[tuple[np.ndarray, int] | None]:
    """Where each segment first meets a triangle, and which; None where it meets none."""
    # Imported where they are used, which takes a while.
    import pyvista
    from vtkmodules.vtkCommonCore import mutable
    from vtkmodules.vtkCommonDataModel import vtkStaticCellLocator

    locator = vtkStaticCellLocator()
    locator.SetDataSet(pyvista.PolyData.from_regular_faces(points, triangles))
    locator.BuildLocator()
    share, part, cell, place, at = mutable(0.0), mutable(0), mutable(0), np.zeros(3), np.zeros(3)
    for number, (start, stop) in enumerate(zip(starts, stops, strict=True)):
        if number % _AT_ONCE == 0:
            stop_if_asked()
        # VTK's types do not know what it writes into.
        met = locator.IntersectWithLine(start, stop, 0.0, share, place, at, part, cell)  # pyright: ignore
        yield (place.copy(), int(cell)) if met else None  # pyright: ignore[reportArgumentType]
