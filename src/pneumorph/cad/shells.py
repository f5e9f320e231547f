"""Closed surfaces among the faces of a file: the outside of a body, and its voids."""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial

import numpy as np
from scipy import sparse
from scipy.sparse.csgraph import connected_components

from pneumorph.cad.faces import Faces
from pneumorph.errors import MeshError

SYMMETRIC = 3e-3
"""How far an image of a symmetric body may be from it, relative to its diagonal: triangles of faces are not exact."""


@dataclass(frozen=True, eq=False)
class Shell:
    """A closed surface.

    Attributes
    ----------
    triangles : (k,) int
        Its triangles in `Faces.triangles`.
    volume : float
        mm³ within it; negative for a void, whose normals point inwards.
    centre : (3,) float
        Centroid of what it encloses, mm.
    lower, upper : (3,) float
        Corners of the box that holds it, mm.
    """

    triangles: np.ndarray
    volume: float
    centre: np.ndarray
    lower: np.ndarray
    upper: np.ndarray


@dataclass(frozen=True, eq=False)
class Shells:
    """The outside of a body, and its voids, the largest first; equal ones in the order of z, y and x."""

    outside: Shell
    voids: tuple[Shell, ...]


def shells_of(faces: Faces) -> Shells:
    """The outside and the voids of a single body.

    Raises
    ------
    MeshError
        If its faces do not bound one solid; a sentence whose subject is the file.
    """
    _check_edges(faces)
    count, number = pieces(faces.triangles)
    found = sorted((_shell(faces, np.flatnonzero(number == each)) for each in range(count)), key=_size)
    outside, inner = found[-1], found[:-1]
    if outside.volume <= 0.0:
        raise MeshError("is turned inside out: the normals of its outside point inwards; reverse them in CAD")
    for shell in inner:
        within = encloses(faces, outside, _vertex(faces, shell))
        if shell.volume > 0.0 and within:
            raise MeshError(
                f"has a closed surface inside, at {place(shell.centre)}, whose normals point outwards; cut the void "
                "out of the solid in CAD, or reverse its normals"
            )
        if not within:
            raise MeshError(
                f"has a second body at {place(shell.centre)}, apart from the one at {place(outside.centre)}; unite "
                "them, or save one"
            )
    return Shells(outside, tuple(sorted(inner, key=partial(_place_among, faces.diagonal))))


def _place_among(diagonal: float, void: Shell) -> tuple[float, ...]:
    """By what voids are ordered: the largest first, and equal ones by the places of their centres in z, y and x.

    Four digits decide, of the volume and of the centre over the body's diagonal: the others are those of triangles,
    which may differ from one reading to the next.
    """
    return float(f"{void.volume:.3e}"), *(round(float(part) / diagonal, 3) + 0.0 for part in void.centre[::-1])


def pieces(triangles: np.ndarray, between: np.ndarray | None = None) -> tuple[int, np.ndarray]:
    """The number of connected pieces of a surface, and that of each triangle (m,).

    Triangles are connected by edges; only by those whose mid-side nodes are among `between`, if given.
    """
    count = len(triangles)
    mids, owner = triangles[:, 3:].ravel(), np.repeat(np.arange(count), 3)
    if between is not None:
        kept = np.isin(mids, between)
        mids, owner = mids[kept], owner[kept]
    _, edge = np.unique(mids, return_inverse=True)
    by = sparse.csr_array((np.ones(len(edge)), (owner, edge)), (count, edge.max(initial=-1) + 1))
    return connected_components(by @ by.T, directed=False)


def encloses(faces: Faces, shell: Shell, point: np.ndarray) -> bool:
    """Whether a closed surface is around a point (3,)."""
    return winds_around(faces.points, quarters(faces.triangles[shell.triangles]), point)


def winds_around(points: np.ndarray, triangles: np.ndarray, point: np.ndarray) -> bool:
    """Whether closed flat triangles (t, 3) wind around a point (3,)."""
    return abs(windings(points[triangles], point)) > 0.5


def windings(corners: np.ndarray, point: np.ndarray) -> float:
    """How often closed triangles (t, 3, 3) wind around a point (3,): 1 inside (Van Oosterom and Strackee 1983)."""
    a, b, c = np.moveaxis(corners - point, 1, 0)
    x, y, z = (np.linalg.norm(each, axis=1) for each in (a, b, c))
    volume = np.einsum("ti,ti->t", a, np.cross(b, c))
    below = x * y * z + _dot(a, b) * z + _dot(b, c) * x + _dot(c, a) * y
    return float(np.arctan2(volume, below).sum() / (2.0 * np.pi))


def asymmetry(points: np.ndarray, triangles: np.ndarray, operation: np.ndarray) -> tuple[float, np.ndarray]:
    """The largest distance of images of nodes under an operation from their surface, mm, and where (3,).

    Parameters
    ----------
    points : (n, 3) array
        mm.
    triangles : (m, 6) int
        Of the surface, with nodes among these points.
    operation : (3, 3) array
    """
    # Loads Numba, which most problems are read without.
    from pneumorph.cad.boxes import boxes_of, nearest

    images = points[np.unique(triangles)] @ operation.T
    surface = boxes_of(points, quarters(triangles))
    away = np.linalg.norm(nearest(surface, images).place - images, axis=1)
    worst = int(away.argmax())
    return float(away[worst]), images[worst]


def place(point: np.ndarray) -> str:
    """A place in mm as it is written in messages."""
    return f"({', '.join(f'{round(float(part), 2) + 0.0:g}' for part in point)}) mm"


def _dot(one: np.ndarray, other: np.ndarray) -> np.ndarray:
    return np.einsum("ti,ti->t", one, other)


def _size(shell: Shell) -> float:
    return float(np.linalg.norm(shell.upper - shell.lower))


def _vertex(faces: Faces, shell: Shell) -> np.ndarray:
    return faces.points[faces.triangles[shell.triangles[0], 0]]


def quarters(triangles: np.ndarray) -> np.ndarray:
    """Six-node triangles (m, 6) as flat ones (4 m, 3)."""
    i, j, k, ij, jk, ki = triangles.T
    flat = [np.stack(each, axis=1) for each in ((i, ij, ki), (ij, j, jk), (ki, jk, k), (ij, jk, ki))]
    return np.concatenate(flat)


def _shell(faces: Faces, triangles: np.ndarray) -> Shell:
    own = faces.triangles[triangles]
    nodes = faces.points[own].reshape(-1, 3)
    origin = nodes.mean(axis=0)
    rough, fine = (_moments(faces.points - origin, flat) for flat in (own[:, :3], quarters(own)))
    # The error of flat triangles is a quarter with halves of their edges.
    volume, moment = (4.0 * fine - rough)[0] / 3.0, (4.0 * fine - rough)[1:] / 3.0
    return Shell(triangles, float(volume), origin + moment / (volume or 1.0), nodes.min(axis=0), nodes.max(axis=0))


def _moments(points: np.ndarray, triangles: np.ndarray) -> np.ndarray:
    """Volume within flat triangles, and the integral (3,) of the place over it."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    volumes = _dot(a, np.cross(b, c)) / 6.0
    return np.concatenate([[volumes.sum()], volumes @ (a + b + c) / 4.0])


def _check_edges(faces: Faces) -> None:
    """Refuse edges that do not join two triangles which are turned alike."""
    mids, count = np.unique(faces.triangles[:, 3:], return_counts=True)
    for wrong, what, repair in (
        (count == 1, "open edges", "close the gap"),
        (count > 2, "edges where more than two faces meet", "separate the parts that touch there"),
    ):
        if wrong.any():
            where = place(faces.points[mids[wrong][0]])
            raise MeshError(f"has {np.count_nonzero(wrong)} {what}, the first at {where}; {repair} in CAD")
    starts = faces.triangles[:, :3].ravel()
    total = np.zeros(len(faces.points), int)
    # Both triangles of an edge go along it, in opposite directions if they are turned alike.
    np.add.at(total, faces.triangles[:, 3:].ravel(), starts - np.roll(faces.triangles[:, :3], -1, axis=1).ravel())
    if total.any():
        where = place(faces.points[np.flatnonzero(total)[0]])
        raise MeshError(f"has faces that are not turned alike, at {where}; make its normals consistent in CAD")


def section_area(corners: np.ndarray, normal: np.ndarray, place: float) -> float:
    """The area in mm² that triangles (t, 3, 3) around a solid or a void enclose in the plane at a place on its normal.

    Of every crossed triangle the plane holds a segment, from where its edges rise through the plane to where they fall.
    """
    ahead = np.roll(corners, -1, axis=1)
    side, next_side = corners @ normal - place, ahead @ normal - place
    ends = []
    for crossed in ((side < 0.0) & (next_side >= 0.0), (side >= 0.0) & (next_side < 0.0)):
        part = side[crossed] / (side[crossed] - next_side[crossed])
        ends.append(corners[crossed] + part[:, None] * (ahead[crossed] - corners[crossed]))
    if not len(ends[0]):
        return 0.0
    rising, falling = ends - ends[0].mean(axis=0)
    return float(abs((np.cross(rising, falling) @ normal).sum())) / 2.0
