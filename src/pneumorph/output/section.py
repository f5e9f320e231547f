"""Cut bodies open: divide quadratic elements into small linear ones and cut these by a plane of the undeformed body."""

from __future__ import annotations

from typing import cast

import numpy as np
import pyvista as pv

from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES, tet_shape, triangle_shape
from pneumorph.output.view import Shape

HALVINGS = 2
"""How often elements are halved for drawing, so that their curved sides look smooth."""

ASIDE = 1e-3
"""Offset of the cut in mm: symmetric meshes have faces in the plane itself, where both neighbours would be cut."""

CREASE = 50.0
"""Angle in degrees between two facets from which their edge is drawn sharp."""


def cut_open(shape: Shape, normal: np.ndarray, offset: float = 0.0) -> tuple[pv.PolyData, pv.PolyData, pv.PolyData]:
    """Cut a body open and deform it by u; returns its skin, the cut face and the line around that face.

    The part towards which `normal` (3,) points is kept. The plane is parallel to the axis of the body at rest, `offset`
    mm from it, so the cut is through the same material for every motion. All three have point data "field" if the shape
    has a field.
    """
    mesh, place = shape.mesh, offset + ASIDE
    origin = tuple(place * normal)
    triangles = np.concatenate(list(mesh.faces.values()))
    skin = pv.PolyData.from_regular_faces(*_flat(mesh.points, triangles, _TRIANGLES, triangle_shape))
    skin.point_data.update(_carried(shape, triangles, _TRIANGLES, triangle_shape))
    rim = skin.slice(normal=tuple(normal), origin=origin)
    skin = skin.clip(normal=tuple(-normal), origin=origin)

    side = mesh.points[mesh.tets] @ normal - place
    crossed = mesh.tets[(side.min(axis=1) <= 0.0) & (side.max(axis=1) >= 0.0)]
    points, cells = _flat(mesh.points, crossed, _TETRAHEDRA, tet_shape)
    solid = pv.UnstructuredGrid({pv.CellType.TETRA: cells}, points)
    solid.point_data.update(_carried(shape, crossed, _TETRAHEDRA, tet_shape))
    face = solid.slice(normal=tuple(normal), origin=origin)
    # Smooth shading between creases for the skin; the cut face is not shaded.
    shaded = cast(
        pv.PolyData, _moved(skin).compute_normals(feature_angle=CREASE, split_vertices=True, consistent_normals=False)
    )
    return shaded, _moved(face), _moved(rim)


def _moved(surface: pv.PolyData) -> pv.PolyData:
    """The surface in its deformed position, with the points of neighbouring elements merged."""
    moved = surface.copy()
    # Points with equal coordinates are merged by hashing; with a tolerance it would take a minute.
    moved.points = np.round(surface.point_data["moved"], 5)
    return cast(pv.PolyData, moved.clean())


def _flat(points: np.ndarray, elements: np.ndarray, pieces: np.ndarray, shape) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of the linear pieces of quadratic elements; elements do not share points."""
    values = shape(pieces[..., 1:]).reshape(-1, elements.shape[1])
    places = np.einsum("pa,eai->epi", values, points[elements]).reshape(-1, 3)
    return places, np.arange(len(places)).reshape(-1, pieces.shape[1])


def _carried(shape: Shape, elements: np.ndarray, pieces: np.ndarray, functions) -> dict[str, np.ndarray]:
    """Deformed positions of the points of `_flat`, and the field there."""
    values = functions(pieces[..., 1:]).reshape(-1, elements.shape[1])
    moved = (shape.mesh.points + shape.u)[elements]
    carried = {"moved": np.einsum("pa,eai->epi", values, moved).reshape(-1, 3)}
    if shape.field is not None:
        carried["field"] = np.einsum("pa,ea->ep", values, shape.field[elements]).ravel()
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
