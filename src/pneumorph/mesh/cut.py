"""The cut faces of half or a quarter of a body: six-node triangles in mirror planes.

They are bounded by the profiles of the cut surfaces and, where two planes cut the body, by its axis.
"""

from __future__ import annotations

import numpy as np

from pneumorph.mesh.plane import triangulate
from pneumorph.mesh.tets import TRIANGLE_EDGES, is_cut
from pneumorph.symmetry.operations import NORMALS

Faces = dict[str, np.ndarray]

IN_PLANE = 1e-4
"""How far from a plane nodes in it may be, mm: control points are rounded while a body is meshed."""


def with_cut_regions(
    faces: Faces, solids: Faces, nodes: np.ndarray, mirrors: tuple[str, ...], size: float
) -> tuple[Faces, Faces, np.ndarray]:
    """Close every region, whose triangles are `solids`, and join their faces in mirror planes to those of the body.

    Parameters
    ----------
    faces : dict of (nf, 6) int
        Triangles of the surfaces, which are open in the planes.
    solids : dict of (nf, 6) int
        Triangles around every region, open in the planes.
    nodes, mirrors, size
        As for `with_cuts`.

    Raises
    ------
    MeshError
        If profiles cross.
    """
    closed: Faces = {}
    for region, triangles in solids.items():
        cut, nodes = with_cuts({"": triangles}, nodes, mirrors, size)
        closed[region] = np.concatenate(list(cut.values()))
        for name in cut.keys() - {""}:
            faces = faces | {name: np.concatenate([faces.get(name, np.zeros((0, 6), int)), cut[name]])}
    order = [*(name for name in faces if not is_cut(name)), *(f"mirror {plane}" for plane in mirrors)]
    return {name: faces[name] for name in order}, closed, nodes


def with_cuts(faces: Faces, nodes: np.ndarray, mirrors: tuple[str, ...], size: float) -> tuple[Faces, np.ndarray]:
    """Close the surfaces of half or a quarter of a body by faces in its mirror planes.

    Parameters
    ----------
    faces : dict of (nf, 6) int
        Triangles of the surfaces, which are open in the planes.
    nodes : (n, 3) float
    mirrors : tuple of "xz" and "yz"
        None for a whole body, whose surfaces are closed. Planes that no surface touches are left out.
    size : float
        Desired edge length away from the surfaces, mm.

    Returns
    -------
    faces : dict of (nf, 6) int
        The given ones and ``"mirror <plane>"``, whose normals point out of the meshed part.
    nodes : (n + added, 3) float
        The given ones first; those in a plane are moved into it exactly.

    Raises
    ------
    MeshError
        If profiles cross.
    """
    nodes = nodes.copy()
    rims = {plane: rim for plane, rim in _rims(open_edges(faces), nodes, mirrors).items() if len(rim)}
    for plane, rim in rims.items():
        nodes[np.unique(rim), NORMALS[plane]] = 0.0
    if len(rims) == 2:
        ends = np.intersect1d(rims["xz"][:, :2], rims["yz"][:, :2])
        if len(ends):
            upwards, nodes = line(ends, nodes, size, 2)
            # Seen from outside, the quarter is left of its axis going up in yz, and going down in xz.
            rims["yz"] = np.concatenate([rims["yz"], upwards])
            rims["xz"] = np.concatenate([rims["xz"], upwards[:, [1, 0, 2]]])
    for plane, rim in rims.items():
        triangles, nodes = filled(rim, nodes, NORMALS[plane], size)
        faces = faces | {f"mirror {plane}": triangles}
    return faces, nodes


def filled(rim: np.ndarray, nodes: np.ndarray, normal: int, size: float) -> tuple[np.ndarray, np.ndarray]:
    """Triangles (nf, 6) between edges in a plane, and all nodes with those added.

    Their normals are against the component.

    Parameters
    ----------
    rim : (n, 3) int
        Edges around the face: their ends and mid-side nodes.
    nodes : (N, 3) array
        mm.
    normal : int
        The component across which the plane is.
    size : float
        Edge length away from the rim, mm.
    """
    axes = [(normal + 2) % 3, (normal + 1) % 3]  # ordered so that counter-clockwise triangles face the missing side
    vertices, edges = np.unique(rim[:, :2], return_inverse=True)
    edges = edges.reshape(-1, 2)
    flat, middles = nodes[vertices][:, axes], nodes[rim[:, 2]][:, axes]
    inside, triangles = triangulate(flat, edges, middles, size)
    number = np.concatenate([vertices, len(nodes) + np.arange(len(inside))])
    corners = number[triangles]

    ends = np.sort(corners[:, TRIANGLE_EDGES].reshape(-1, 2), axis=1)
    inner, inverse = np.unique(ends, axis=0, return_inverse=True)
    mids = len(nodes) + len(inside) + np.arange(len(inner))
    # Edges of the rim have their mid-side nodes already; the other edges get consecutive numbers.
    known = {(min(a, b), max(a, b)): mid for a, b, mid in rim.tolist()}
    on_rim = np.array([edge in known for edge in map(tuple, inner.tolist())])
    mids[~on_rim] = len(nodes) + len(inside) + np.arange(np.count_nonzero(~on_rim))
    mids[on_rim] = [known[edge] for edge in map(tuple, inner[on_rim].tolist())]
    added = np.tile(nodes[rim[0, 0]], (len(inside), 1))
    added[:, axes] = inside
    nodes = np.concatenate([nodes, added])
    nodes = np.concatenate([nodes, nodes[inner[~on_rim]].mean(axis=1)])
    return np.hstack([corners, mids[inverse.reshape(-1, 3)]]), nodes


def open_edges(faces: Faces) -> np.ndarray:
    """Edges (n, 3) with only one triangle: ends, in the order of the missing second triangle, and mid-side node."""
    triangles = np.concatenate(list(faces.values()))
    edges = np.concatenate([triangles[:, TRIANGLE_EDGES], triangles[:, 3:, None]], axis=2).reshape(-1, 3)
    _, first, count = np.unique(edges[:, 2], return_index=True, return_counts=True)
    return edges[first[count == 1]][:, [1, 0, 2]]


def _rims(edges: np.ndarray, nodes: np.ndarray, mirrors: tuple[str, ...]) -> dict[str, np.ndarray]:
    """The edges in each plane: those whose mid-side node is nearest to it."""
    if not mirrors:
        return {}
    away = np.abs(nodes[edges[:, 2]][:, [NORMALS[plane] for plane in mirrors]])
    nearest = away.argmin(axis=1)
    return {plane: edges[nearest == number] for number, plane in enumerate(mirrors)}


def line(ends: np.ndarray, nodes: np.ndarray, size: float, along: int) -> tuple[np.ndarray, np.ndarray]:
    """Edges (n, 3) on a line where that is in the solid, and all nodes with those added.

    Parameters
    ----------
    ends : (k,) int
        Nodes where surfaces meet the line; there it enters and leaves the solid by turns.
    nodes : (N, 3) array
        mm.
    size : float
        Edge length, mm.
    along : int
        The component along which the line is.
    """
    onwards = ends[np.argsort(nodes[ends, along])]
    edges = []
    for low, high in onwards.reshape(-1, 2).tolist():
        steps = max(1, round((nodes[high, along] - nodes[low, along]) / size))
        first = len(nodes)
        places = np.linspace(nodes[low], nodes[high], 2 * steps + 1)[1:-1]
        nodes = np.concatenate([nodes, places[1::2], places[::2]])
        corners = np.array([low, *range(first, first + steps - 1), high])
        middles = first + steps - 1 + np.arange(steps)
        edges.append(np.column_stack([corners[:-1], corners[1:], middles]))
    return np.concatenate(edges), nodes
