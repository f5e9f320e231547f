"""Quadratic tetrahedra with named faces, which are all that the mechanics needs of a mesh."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from pneumorph.symmetry.part import Part

TET_EDGES = np.array([[0, 1], [1, 2], [0, 2], [0, 3], [1, 3], [2, 3]])
"""Corner pairs whose mid-side nodes are columns 4…9 of a tetrahedron (VTK order)."""

TRIANGLE_EDGES = np.array([[0, 1], [1, 2], [2, 0]])
"""Corner pairs whose mid-side nodes are columns 3…5 of a six-node triangle."""

TURNED = [0, 2, 1, 5, 4, 3]
"""The nodes of a six-node triangle seen from its other side."""

TET_FACES = np.array([[0, 2, 1], [0, 1, 3], [1, 2, 3], [0, 3, 2]])
"""Corners of the four faces of a positively oriented tetrahedron, seen counter-clockwise from outside."""

TET_RULE = np.array(
    [
        [0.1381966011250105, 0.1381966011250105, 0.1381966011250105],
        [0.5854101966249685, 0.1381966011250105, 0.1381966011250105],
        [0.1381966011250105, 0.5854101966249685, 0.1381966011250105],
        [0.1381966011250105, 0.1381966011250105, 0.5854101966249685],
    ]
)
"""The four points of the rule of degree 2 on the unit tetrahedron; every weight is 1/24."""

TRIANGLE_RULE = (
    np.array(
        [
            [0.445948490915965, 0.445948490915965],
            [0.108103018168070, 0.445948490915965],
            [0.445948490915965, 0.108103018168070],
            [0.091576213509771, 0.091576213509771],
            [0.816847572980459, 0.091576213509771],
            [0.091576213509771, 0.816847572980459],
        ]
    ),
    0.5 * np.repeat([0.223381589678011, 0.109951743655322], 3),
)
"""Points and weights of the six-point rule of degree 4 on the unit triangle (Dunavant 1985)."""

RULE = np.array([[1 / 6, 1 / 6], [2 / 3, 1 / 6], [1 / 6, 2 / 3]])
"""The three points of the rule of degree 2 on the unit triangle, each of weight 1/6.

They have fewer conditions than a sheet that hardly stretches has with more points, which could not bend with its face.
"""


def tet_shape(xi: np.ndarray) -> np.ndarray:
    """Quadratic shape functions at local points ``xi`` (..., 3); returns (..., 10)."""
    x, y, z = np.moveaxis(xi, -1, 0)
    w = 1 - x - y - z
    corners = [w * (2 * w - 1), x * (2 * x - 1), y * (2 * y - 1), z * (2 * z - 1)]
    edges = [4 * w * x, 4 * x * y, 4 * w * y, 4 * w * z, 4 * x * z, 4 * y * z]
    return np.stack([*corners, *edges], axis=-1)


def tet_gradient(xi: np.ndarray) -> np.ndarray:
    """Derivatives of the quadratic shape functions with respect to the local coordinates; returns (..., 10, 3)."""
    barycentric = np.concatenate([1 - xi.sum(-1, keepdims=True), xi], axis=-1)
    slope = np.array([[-1.0, -1, -1], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
    corner = (4 * barycentric - 1)[..., None] * slope
    i, j = TET_EDGES.T
    edge = 4 * (barycentric[..., i, None] * slope[j] + barycentric[..., j, None] * slope[i])
    return np.concatenate([corner, edge], axis=-2)


def triangle_shape(xi: np.ndarray) -> np.ndarray:
    """Quadratic shape functions of the six-node triangle at ``xi`` (..., 2); returns (..., 6)."""
    x, y = np.moveaxis(xi, -1, 0)
    w = 1 - x - y
    return np.stack([w * (2 * w - 1), x * (2 * x - 1), y * (2 * y - 1), 4 * w * x, 4 * x * y, 4 * w * y], axis=-1)


def triangle_gradient(xi: np.ndarray) -> np.ndarray:
    """Derivatives of the triangle's shape functions with respect to the local coordinates; returns (..., 6, 2)."""
    barycentric = np.concatenate([1 - xi.sum(-1, keepdims=True), xi], axis=-1)
    slope = np.array([[-1.0, -1], [1, 0], [0, 1]])
    corner = (4 * barycentric - 1)[..., None] * slope
    i, j = TRIANGLE_EDGES.T
    edge = 4 * (barycentric[..., i, None] * slope[j] + barycentric[..., j, None] * slope[i])
    return np.concatenate([corner, edge], axis=-2)


@dataclass(frozen=True, eq=False)
class Covered:
    """Faces, or parts of faces, on which something thin lies; see `cover.covered`.

    Attributes
    ----------
    nodes : (E, 6) int
        The nodes of a face, so ordered that its normal points away from the axis of its surface. In images by a mirror
        the order is that of the original, so that what is right-handed becomes left-handed.
    points : (E, 3, 5) float
        Of three points of each: position in the face's own coordinates, weight, and the direction from base to tip,
        along which q is constant, in these coordinates.
    """

    nodes: np.ndarray
    points: np.ndarray


@dataclass(frozen=True)
class TetMesh:
    """Ten-node tetrahedra with named six-node boundary faces.

    Attributes
    ----------
    points : (N, 3) float
        Node positions in mm.
    tets : (M, 10) int
        Corners, then mid-side nodes of the edges 01, 12, 02, 03, 13, 23 (VTK order); det(dX/dξ) > 0.
    faces : dict of (nf, 6) int
        Corners, then mid-side nodes of the edges 01, 12, 20; normals point from solid to void. Names: ``"base"``
        (z = 0), ``"tip"``, ``"exterior"`` (the tube between them) and one ``"chamber <name>"`` per chamber, with its
        tube and both ends. Half a body also has ``"mirror xz"`` or ``"mirror yz"``, the cut face, and a quarter has
        both; chambers cut by a plane are open there. A chamber that also represents mirror images is called
        ``"chamber <name> <name of the image> …"``: of four, the second is its image in xz, and the others are the
        images of these two in yz. One of n sectors has ``"sector <n>"`` and ``"sector <n> image"``, the faces of its
        two cuts: triangles and nodes of the second are the images of the first's, in the same order, seen from the
        other side. Its chambers are named in the order of the turns.
    regions : dict of (m,) int
        Indices of the tetrahedra made of each rubber, without overlap; empty if the whole body is of one rubber.
    covers : dict of Covered
        Where sheets and fibres lie, by their names.
    caps : dict of (c, 4) int
        What closes the ports of chambers, by their names as in `faces`, for volume and pressure alone: the nodes of
        six-node triangles whose edges are straight but for the one from the second to the third, whose mid-side node
        is the fourth. Normals point into the chamber.
    halved : (M,) float or None
        How often every element was halved in size after the body was meshed, see `bisect.py`: a third of how often it
        was in volume. None if none was.
    """

    points: np.ndarray
    tets: np.ndarray
    faces: dict[str, np.ndarray]
    regions: dict[str, np.ndarray] = field(default_factory=dict)
    covers: dict[str, Covered] = field(default_factory=dict)
    caps: dict[str, np.ndarray] = field(default_factory=dict)
    halved: np.ndarray | None = None

    def at(self, points: np.ndarray) -> TetMesh:
        """The same mesh with other node positions (N, 3) in mm."""
        return replace(self, points=points)

    @property
    def mirrors(self) -> tuple[str, ...]:
        """The mirror planes in which the body continues, of "xz" and "yz" in this order; none for a whole body."""
        return tuple(sorted(name.removeprefix("mirror ") for name in self.faces if name.startswith("mirror ")))

    @property
    def part(self) -> Part:
        """The part of the whole body that is meshed."""
        return self.mirrors or tuple(
            name for name in self.faces if name.startswith("sector ") and not name.endswith(" image")
        )

    @property
    def tied(self) -> tuple[np.ndarray, np.ndarray]:
        """Nodes (n,) in the second cut of a sector, and those (n,) in the first whose images they are."""
        cuts = [(self.faces[name], self.faces[f"{name} image"]) for name in self.part if name not in self.mirrors]
        if not cuts:
            return np.zeros(0, int), np.zeros(0, int)
        ((first, second),) = cuts
        nodes, places = np.unique(second, return_index=True)
        sources = first[:, TURNED].ravel()[places]
        # Nodes on the axis are in both.
        off = nodes != sources
        return nodes[off], sources[off]

    @property
    def axis(self) -> np.ndarray:
        """Sorted indices of the nodes of a sector that are on the axis."""
        names = [name for name in self.part if name not in self.mirrors]
        shared = [np.intersect1d(self.faces[name], self.faces[f"{name} image"]) for name in names]
        return np.concatenate([np.zeros(0, int), *shared])

    def mirror_nodes(self, plane: str) -> np.ndarray:
        """Sorted indices of the nodes in one of its mirror planes."""
        return np.unique(self.faces[f"mirror {plane}"])

    def volume(self) -> float:
        """Volume of the meshed solid in mm³."""
        # On a quadratic element det J is cubic in ξ; the boundary integral of degree 4 is exact and cheaper.
        return sum(area_and_volume(self.points, faces)[1] for faces in self.faces.values())


def is_cut(face: str) -> bool:
    """Whether a face of a part of a body is one where the body goes on."""
    return face.startswith(("mirror ", "sector "))


def chambers_of(face: str) -> tuple[str, ...]:
    """Names of the chambers that a face bounds: one, also the images that it represents, or none."""
    return tuple(face.split()[1:]) if face.startswith("chamber ") else ()


def area_vectors(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Quadrature of curved triangles: points (nf, 6, 3) in mm and weighted normals n dA (nf, 6, 3) in mm²."""
    rule, weights = TRIANGLE_RULE
    nodes = points[faces]
    places = np.einsum("gi,fid->fgd", triangle_shape(rule), nodes)
    tangents = np.einsum("gik,fid->fgkd", triangle_gradient(rule), nodes)
    return places, weights[:, None] * np.cross(tangents[:, :, 0], tangents[:, :, 1])


def area_and_volume(points: np.ndarray, faces: np.ndarray) -> tuple[np.ndarray, float]:
    """∮n dA (3,) and ⅓∮x·n dA of curved triangles; for a closed surface these are 0 and the enclosed volume."""
    places, normals = area_vectors(points, faces)
    return normals.sum((0, 1)), float(np.einsum("fgd,fgd->", places, normals)) / 3
