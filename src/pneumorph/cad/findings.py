"""What is found in a body from a file: its size, its voids, its thinnest wall, and where it intersects itself."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.cad.faces import Faces
from pneumorph.cad.shells import Shells, quarters, shells_of

_OFF = 1e-7
"""How far within the solid segments begin, relative to its diagonal: they do not meet the triangle they are of. So do
edges, relative to their lengths, for those beside them."""


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
    # Loads Numba, which most problems are read without.
    from pneumorph.cad.boxes import boxes_of, first_hits

    starts, stops = middles + _OFF * diagonal * inwards, middles + diagonal * inwards
    hits = first_hits(boxes_of(points, triangles), starts, stops)
    thickness = np.where(hits.triangle >= 0, np.linalg.norm(hits.place - middles, axis=1), np.inf)
    least = int(thickness.argmin())
    if np.isinf(thickness[least]):
        return Wall(np.inf, middles[0])
    return Wall(float(thickness[least]), (hits.place[least] + middles[least]) / 2.0)


def crossing(points: np.ndarray, triangles: np.ndarray) -> np.ndarray | None:
    """A place (3,) where an edge goes through a triangle, mm; None if there is none."""
    import ipctk

    from pneumorph.cad.boxes import boxes_of, first_hits

    ends = np.unique(np.sort(triangles[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
    surface = ipctk.CollisionMesh(points, ends.astype(np.int32), triangles.astype(np.int32))
    if not ipctk.has_intersections(surface, np.asfortranarray(points)):
        return None
    # All triangles around an end of an edge meet it there.
    one, other = points[ends.T]
    hits = first_hits(boxes_of(points, triangles), one + _OFF * (other - one), other - _OFF * (other - one))
    apart = ~(ends[:, :, None] == triangles[hits.triangle][:, None]).any(axis=(1, 2))
    through = np.flatnonzero((hits.triangle >= 0) & apart)
    return hits.place[through[0]] if len(through) else one[0]
