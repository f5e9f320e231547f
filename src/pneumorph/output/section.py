"""Cut bodies open by a plane of the undeformed body; quadratic elements are divided into small linear ones for it."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, cast

import numpy as np
import pyvista as pv

from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES, chambers_of, tet_shape, triangle_shape
from pneumorph.output.view import Shape, Shell

HALVINGS = 2
"""How often elements are halved for drawing, so that their curved sides look smooth."""

ASIDE = 1e-3
"""Offset of the cut in mm: symmetric meshes have faces in the plane itself, where both neighbours would be cut."""

CREASE = 50.0
"""Angle in degrees between two facets from which their edge is drawn sharp."""


class Opened(NamedTuple):
    """A body that is cut open and deformed: its skin, the cut face and the line around that face.

    All have point data "field" if the shape has a field. Of a body that is not cut, face and rim are empty.
    """

    skin: pv.PolyData
    face: pv.PolyData
    rim: pv.PolyData


def cut_open(shapes: Sequence[Shape | Shell], normal: np.ndarray, offset: float | None) -> list[Opened]:
    """Cut states of one body open, which are cut once for all, and deform each by its u.

    The part towards which `normal` (3,) points is kept, all of it if `offset` is None. The plane is one of the body at
    rest, `offset` mm from the origin, so the cut is through the same material for every motion.
    """
    first = shapes[0]
    if isinstance(first, Shell):
        return [_cut_shell(shape, normal, offset) for shape in shapes if isinstance(shape, Shell)]
    states = [shape for shape in shapes if isinstance(shape, Shape)]
    skin = _skin(states)
    if offset is None:
        return [Opened(_shaded(skin, number), pv.PolyData(), pv.PolyData()) for number in range(len(states))]
    place = offset + ASIDE
    origin = tuple(place * normal)
    rim = skin.slice(normal=tuple(normal), origin=origin)
    skin = skin.clip(normal=tuple(-normal), origin=origin)

    mesh = first.mesh
    side = mesh.points[mesh.tets] @ normal - place
    crossed = mesh.tets[(side.min(axis=1) <= 0.0) & (side.max(axis=1) >= 0.0)]
    points, cells = _flat(mesh.points, crossed, _TETRAHEDRA, tet_shape)
    solid = pv.UnstructuredGrid({pv.CellType.TETRA: cells}, points)
    solid.point_data.update(_carried(states, crossed, _TETRAHEDRA, tet_shape))
    face = solid.slice(normal=tuple(normal), origin=origin)
    return [Opened(_shaded(skin, k), _moved(face, k), _moved(rim, k)) for k in range(len(states))]


def outline(shape: Shape | Shell, normal: np.ndarray, offset: float | None) -> np.ndarray:
    """Where the plane cuts the exterior of a body at rest, as pieces of lines (n, 2, 3) in mm."""
    if offset is None or isinstance(shape, Shell):
        return np.zeros((0, 2, 3))
    faces = [triangles for name, triangles in shape.mesh.faces.items() if not chambers_of(name)]
    skin = pv.PolyData.from_regular_faces(*_flat(shape.mesh.points, np.concatenate(faces), _TRIANGLES, triangle_shape))
    rim = skin.slice(normal=tuple(normal), origin=tuple((offset + ASIDE) * normal))
    return np.asarray(rim.points)[np.asarray(rim.lines).reshape(-1, 3)[:, 1:]]


def _skin(states: Sequence[Shape]) -> pv.PolyData:
    """The surfaces of a mesh at rest; "moved 0", … are their positions in the states."""
    mesh = states[0].mesh
    triangles = np.concatenate(list(mesh.faces.values()))
    skin = pv.PolyData.from_regular_faces(*_flat(mesh.points, triangles, _TRIANGLES, triangle_shape))
    skin.point_data.update(_carried(states, triangles, _TRIANGLES, triangle_shape))
    return skin


def _cut_shell(shell: Shell, normal: np.ndarray, offset: float | None) -> Opened:
    whole = _triangles(shell)
    if offset is None:
        return Opened(_shaded(whole, 0), pv.PolyData(), pv.PolyData())
    origin = (offset + ASIDE) * normal
    closed = whole.clip_closed_surface(normal=tuple(normal), origin=tuple(origin))
    inside = np.abs((closed.points - origin) @ normal) < ASIDE / 10
    flat = inside[closed.regular_faces].all(axis=1)
    face = cast(pv.PolyData, pv.PolyData.from_regular_faces(closed.points, closed.regular_faces[flat]).clean())
    skin = whole.clip(normal=tuple(-normal), origin=tuple(origin))
    return Opened(_shaded(skin, 0), face, whole.slice(normal=tuple(normal), origin=tuple(origin)))


def _triangles(shell: Shell) -> pv.PolyData:
    surface = pv.PolyData.from_regular_faces(shell.points, shell.triangles)
    surface.point_data["moved 0"] = shell.points
    return surface


def _shaded(skin: pv.PolyData, number: int) -> pv.PolyData:
    """The deformed skin with normals for smooth shading between creases; the cut face is not shaded."""
    return cast(
        pv.PolyData,
        _moved(skin, number).compute_normals(feature_angle=CREASE, split_vertices=True, consistent_normals=False),
    )


def _moved(surface: pv.PolyData, number: int) -> pv.PolyData:
    """The surface as a state deforms it, with the points of neighbouring elements merged."""
    # Points with equal coordinates are merged by hashing; with a tolerance it would take a minute.
    moved = pv.PolyData()
    moved.points = np.round(surface.point_data[f"moved {number}"], 5)
    moved.SetPolys(surface.GetPolys())
    moved.SetLines(surface.GetLines())
    if f"field {number}" in surface.point_data:
        moved.point_data["field"] = surface.point_data[f"field {number}"]
    return cast(pv.PolyData, moved.clean())


def _flat(points: np.ndarray, elements: np.ndarray, pieces: np.ndarray, shape) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of the linear pieces of quadratic elements; elements do not share points."""
    values = shape(pieces[..., 1:]).reshape(-1, elements.shape[1])
    places = np.einsum("pa,eai->epi", values, points[elements]).reshape(-1, 3)
    return places, np.arange(len(places)).reshape(-1, pieces.shape[1])


def _carried(states: Sequence[Shape], elements: np.ndarray, pieces: np.ndarray, functions) -> dict[str, np.ndarray]:
    """The points of `_flat` as the states deform them, and their fields there."""
    values = functions(pieces[..., 1:]).reshape(-1, elements.shape[1])
    carried = {}
    for number, shape in enumerate(states):
        moved = shape.points[elements]
        carried[f"moved {number}"] = np.einsum("pa,eai->epi", values, moved, optimize=True).reshape(-1, 3)
        if shape.field is not None:
            carried[f"field {number}"] = np.einsum("pa,ea->ep", values, shape.field[elements], optimize=True).ravel()
    return carried


def _pieces(edges: np.ndarray, children: np.ndarray) -> np.ndarray:
    """Barycentric corners (pieces, k, k) of a repeatedly halved simplex.

    `children` are the corners of its parts, numbered corners first, then the middles of `edges`.
    """
    pieces = np.eye(edges.max() + 1)[None]
    for _ in range(HALVINGS):
        middles = pieces[:, edges].mean(axis=2)
        pieces = np.concatenate([pieces, middles], axis=1)[:, children].reshape(-1, *pieces.shape[1:])
    return pieces


_TRIANGLES = _pieces(TRIANGLE_EDGES, np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]]))
_TETRAHEDRA = _pieces(
    TET_EDGES,
    np.array(
        [
            [0, 4, 6, 7],
            [4, 1, 5, 8],
            [6, 5, 2, 9],
            [7, 8, 9, 3],
            [4, 9, 5, 8],
            [4, 9, 8, 7],
            [4, 9, 7, 6],
            [4, 9, 6, 5],
        ]
    ),
)
