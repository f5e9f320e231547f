"""Bodies cut open: quadratic elements broken into small flat ones, and cut by a plane of the undeformed body."""

from __future__ import annotations

from typing import cast

import numpy as np
import pyvista as pv

from pneumorph.mesh.tets import TET_EDGES, TRIANGLE_EDGES, tet_shape, triangle_shape
from pneumorph.output.view import Shape

HALVINGS = 2
"""How often elements are halved for drawing; their curved sides then look smooth."""

ASIDE = 1e-3
"""Way in mm of the cut from the axis: in its plane a symmetric mesh has edges, where a cut would find pieces twice."""

CREASE = 50.0
"""Angle in degrees from which two facets meet in an edge that is drawn sharp."""


def cut_open(shape: Shape, normal: np.ndarray, offset: float = 0.0) -> tuple[pv.PolyData, pv.PolyData, pv.PolyData]:
    """Skin, cut face and the line around it of the half of a body towards which `normal` (3,) points, as moved by u.

    The plane is parallel to the axis of the body at rest, `offset` mm from it, so the same rubber is cut whatever the
    motion. All have point data "field" where the shape has a field.
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
    # Smooth shading between creases, for the skin alone: the cut has no use for normals.
    shaded = cast(
        pv.PolyData, _moved(skin).compute_normals(feature_angle=CREASE, split_vertices=True, consistent_normals=False)
    )
    return shaded, _moved(face), _moved(rim)


def _moved(surface: pv.PolyData) -> pv.PolyData:
    """The surface where its points have gone, those of neighbouring elements joined."""
    moved = surface.copy()
    # Points that are equal to the last digit are joined by hashing; with a tolerance it would take a minute.
    moved.points = np.round(surface.point_data["moved"], 5)
    return cast(pv.PolyData, moved.clean())


def _flat(points: np.ndarray, elements: np.ndarray, pieces: np.ndarray, shape) -> tuple[np.ndarray, np.ndarray]:
    """Points and cells of the flat pieces of quadratic elements; every element has points of its own."""
    values = shape(pieces[..., 1:]).reshape(-1, elements.shape[1])
    places = np.einsum("pa,eai->epi", values, points[elements]).reshape(-1, 3)
    return places, np.arange(len(places)).reshape(-1, pieces.shape[1])


def _carried(shape: Shape, elements: np.ndarray, pieces: np.ndarray, functions) -> dict[str, np.ndarray]:
    """Where the points of `_flat` have gone, and the field there."""
    values = functions(pieces[..., 1:]).reshape(-1, elements.shape[1])
    moved = (shape.mesh.points + shape.u)[elements]
    carried = {"moved": np.einsum("pa,eai->epi", values, moved).reshape(-1, 3)}
    if shape.field is not None:
        carried["field"] = np.einsum("pa,ea->ep", values, shape.field[elements]).ravel()
    return carried


def _pieces(edges: np.ndarray, children: np.ndarray) -> np.ndarray:
    """Barycentric corners (pieces, k, k) of a simplex halved again and again; children name corners, then mid-sides."""
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
