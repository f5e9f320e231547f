"""Chambers that open through ports: their walls, and caps over the rims."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.cad.faces import Faces
from pneumorph.cad.shells import pieces, place, quarters, winds_around
from pneumorph.errors import MeshError


@dataclass(frozen=True, eq=False)
class Open:
    """A chamber that opens through a port.

    Attributes
    ----------
    triangles : (k,) int
        Its walls, in `Faces.triangles`.
    cap : (c, 4) int
        Nodes of the parts of its cap: one in the plane of the rim, the ends of an edge of the rim, and the mid-side
        node of that. Each part is a six-node triangle with straight edges, but for the edge of the rim. Normals point
        into the chamber, as those of the walls do.
    volume : float
        mm³ within walls and cap, negative as for `Shell`.
    centre : (3,) float
        Mean of its nodes, mm.
    """

    triangles: np.ndarray
    cap: np.ndarray
    volume: float
    centre: np.ndarray


def open_chamber(faces: Faces, point: np.ndarray, in_plane: np.ndarray) -> Open:
    """The chamber around a point (3,) that opens through edges between nodes (n,) bool in the plane of a port.

    Raises
    ------
    MeshError
        If there is none; a sentence whose subject is the file.
    """
    ends = faces.triangles[:, [[0, 1], [1, 2], [2, 0]]]
    mids = faces.triangles[:, 3:]
    on_rim = in_plane[ends].all(axis=2) & in_plane[mids]
    count, number = pieces(faces.triangles, np.unique(mids[~on_rim]))
    flat = on_rim.all(axis=1)
    candidates = []
    for each in np.setdiff1d(np.arange(count), number[flat]):
        own = np.flatnonzero(number == each)
        edges = np.concatenate([ends[own][on_rim[own]], mids[own][on_rim[own]][:, None]], axis=1)
        cap = _cap(faces, edges, np.flatnonzero(in_plane))
        if not len(cap):
            continue
        closed = _closed(faces, own, cap)
        a, b, c = np.moveaxis(faces.points[closed] - point, 1, 0)
        volume = float(np.einsum("ti,ti->", a, np.cross(b, c))) / 6.0
        if volume < 0.0 and winds_around(faces.points, closed, point):
            candidates.append(Open(own, cap, volume, faces.points[np.unique(closed)].mean(axis=0)))
    if not candidates:
        raise MeshError(
            f"has no chamber around {place(point)} that opens in the plane of its port; give the plane in which the "
            "rim of its opening lies"
        )
    return max(candidates, key=lambda each: each.volume)


def opens_around(faces: Faces, found: Open, point: np.ndarray) -> bool:
    """Whether walls and cap of a chamber are around a point (3,)."""
    return winds_around(faces.points, _closed(faces, found.triangles, found.cap), point)


def part_of_cap(faces: Faces, walls: np.ndarray, in_plane: np.ndarray, cut: np.ndarray) -> np.ndarray:
    """The parts (c, 4) of the cap, see `Open.cap`, of a chamber of which a mirror plane may leave half.

    The half of a cap ends in the mirror plane, where its parts meet, as those of its image do.

    Parameters
    ----------
    faces : Faces
        Of the part of the body.
    walls : (k,) int
        Those of the chamber.
    in_plane, cut : (n,) bool
        The nodes in the plane of the port, and those among which the parts of the cap meet.

    Raises
    ------
    MeshError
        If there are none of the latter beside the rim; a sentence whose subject is the file.
    """
    own = faces.triangles[walls]
    edges = np.stack([own[:, [0, 1, 3]], own[:, [1, 2, 4]], own[:, [2, 0, 5]]], axis=1).reshape(-1, 3)
    _, first, count = np.unique(edges[:, 2], return_index=True, return_counts=True)
    rim = edges[first[(count == 1) & in_plane[edges[first]].all(axis=1)]]
    cap = _cap(faces, rim, np.flatnonzero(in_plane & cut))
    if not len(cap):
        raise MeshError("has a port that cannot be cut in a mirror plane; leave that plane out of body.symmetry")
    return cap


def _closed(faces: Faces, walls: np.ndarray, cap: np.ndarray) -> np.ndarray:
    """Flat triangles (t, 3) of walls and cap."""
    return np.concatenate([quarters(faces.triangles[walls]), cap[:, [0, 1, 3]], cap[:, [0, 3, 2]]])


def _cap(faces: Faces, rim: np.ndarray, beside: np.ndarray) -> np.ndarray:
    """The parts (c, 4) of the cap over a rim (c, 3): the ends of edges as the walls go along it, and their middles.

    They meet in the node nearest to the rim of those `beside` it in its plane, where what the parts cover beyond the
    rim cancels. In a node of the rim itself, parts beside it would have a node twice.
    """
    others = np.setdiff1d(beside, rim)
    if not len(rim) or not len(others):
        return np.zeros((0, 4), int)
    away = np.linalg.norm(faces.points[others] - faces.points[rim[:, :2]].reshape(-1, 3).mean(axis=0), axis=1)
    apex = np.full(len(rim), others[away.argmin()])
    # The cap goes along the rim the other way.
    return np.stack([apex, rim[:, 1], rim[:, 0], rim[:, 2]], axis=1)
