"""Triangulation of a body's surfaces in their parameters (q, r), as a linear map from control points to nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse
from scipy.spatial import KDTree

from pneumorph.errors import MeshError
from pneumorph.geometry import Body, Triangulation
from pneumorph.geometry.tube.level import Level
from pneumorph.geometry.tube.lining import Lining
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.geometry.tube.wedge import Wedge
from pneumorph.mesh.tets import TURNED
from pneumorph.mesh.tube.disc import with_sound_discs
from pneumorph.mesh.tube.patch import Patch, edges_of, patch_of
from pneumorph.mesh.tube.rings import Around
from pneumorph.mesh.tube.slant import UPRIGHT, slant_of
from pneumorph.problem.regions import REST
from pneumorph.symmetry.operations import MIRRORS, NORMALS, turned
from pneumorph.symmetry.part import Part, beginning_of, onwards, turns_of

UNLIKE = "the surfaces are not the same after a turn by one sector"
_SHIFTS = (0.0, 0.5, 0.25)  # where a sector begins that may do so anywhere, as far as tried
_SYMMETRIC = 1e-4  # mm; images on surfaces that are symmetric but for rounding are nearer
_IN_PLANE = 1e-6  # mm; a surface whose middle is nearer to a mirror plane is cut by it
_SEAMS = {("xz",): (0.0, 0.5), ("yz",): (0.75, 0.75), ("xz", "yz"): (0.0, 0.75)}
"""q at which the kept part begins, on the exterior and on a chamber, by the planes that cut the surface."""


@dataclass(frozen=True, eq=False)
class SurfaceMesh(Triangulation):
    """The triangles of all tubes of a body.

    A row of B has at most 16 entries on a tube, and those of a whole end row on a disc. The offset is zero on the
    surfaces, and leads from there to the nodes where two rubbers meet. Faces of chambers are the tube, then its discs.

    Attributes
    ----------
    param : dict of (nf, 6, 2) float
        (q, r) of the nodes of the tubes' triangles, by surface name ("exterior" or a chamber's), in the order of
        ``faces``; q exceeds 1 where a triangle crosses the seam.
    solids : dict of (n, 6) int
        The triangles that bound each region, normals outwards; those between two regions belong to both. A body of a
        single rubber is one region ""; of wedges, each has its number as its name, and is open in half-planes.
    seam : (n, 2) int
        Of a sector, the nodes of the surfaces where it begins, each with its image, where it ends.
    """

    param: dict[str, np.ndarray]
    solids: dict[str, np.ndarray]
    seam: np.ndarray

    @property
    def triangles(self) -> np.ndarray:
        """All triangles, (nt, 6)."""
        return np.concatenate(list(self.faces.values()))


def surface_mesh(
    body: Body,
    size: float,
    turn: float = np.pi / 4,
    part: Part = (),
    linings: Sequence[Lining] = (),
    levels: Sequence[Level] = (),
    wedges: Sequence[Wedge] = (),
    begin: float = 0.0,
) -> SurfaceMesh:
    """Triangulate all surfaces of a body, or of its part: that at y ≥ 0 (mirror xz) and x ≥ 0 (mirror yz), or a sector.

    A sector is between two lines on each surface around the axis, of constant q on the exterior.

    Parameters
    ----------
    body : Body
    size : float
        Desired edge length, mm: the geometric mean of a grid cell's side and diagonal.
    turn : float
        Largest rotation of a surface line's tangent along one edge, rad.
    part : Part
        Surfaces that are cut are left open there. A sector has no layers.
    linings : sequence of Lining
        Layers of other rubbers, whose inner sides are triangulated like the surfaces along which they lie.
    levels : sequence of Level
        Planes along whose rings there are edges.
    wedges : sequence of Wedge
        Parts between half-planes, along whose lines there are edges, across the end discs too.
    begin : float
        Where a sector begins, in turns about z, see `beginnings`.

    Raises
    ------
    MeshError
        If two edges of layers are nearer to each other than grid lines.
    """
    side = size / 2**0.25
    regions = list(dict.fromkeys([REST, *(lining.region for lining in linings)]))
    regions = [str(number) for number in range(len(wedges))] or regions
    own = [[lining for lining in linings if lining.surface == surface.name] for surface in body.surfaces]
    rings = [[level.rings[each.name] for level in levels if each.name in level.rings] for each in body.surfaces]
    patches = [
        with_sound_discs(_kept(surface, side, turn, part, begin, body.exterior, lined, crossed, wedges), surface, size)
        for surface, lined, crossed in zip(body.surfaces, own, rings, strict=True)
    ]
    n_vertices = sum(patch.n_vertices for patch in patches)
    # The vertices of all surfaces come first, then all mid-side nodes.
    first_vertex = np.cumsum([0] + [patch.n_vertices for patch in patches])
    first_mid = n_vertices + np.cumsum([0] + [patch.n_mids for patch in patches])
    faces, param, seam = {}, {}, [np.zeros((0, 2), int)]
    solids: dict[str, list[np.ndarray]] = {region: [] for region in regions}
    for surface, patch, v, m in zip(body.surfaces, patches, first_vertex, first_mid, strict=False):
        if not len(patch.triangles):
            continue
        number = np.concatenate([v + np.arange(patch.n_vertices), m + np.arange(patch.n_mids)])
        seam.append(number[patch.seam])
        base, tube, tip = (number[patch.triangles[patch.part == k]] for k in range(3))
        if surface.cavity:
            names = " ".join(chamber.name for chamber in _with_images(body, surface, part))
            faces[f"chamber {names}"] = np.concatenate([tube, base, tip])
        else:
            faces |= {"base": base, "tip": tip, "exterior": tube}
        param[surface.name] = patch.param[patch.part == 1]
        for region, parts in solids.items():
            parts += [number[patch.triangles[patch.behind == region]]]
            parts += [number[patch.triangles[patch.ahead == region]][:, TURNED]]
    corners = sparse.block_diag([patch.B[: patch.n_vertices] for patch in patches])
    mids = sparse.block_diag([patch.B[patch.n_vertices :] for patch in patches])
    offset = [patch.offset[: patch.n_vertices] for patch in patches], [p.offset[p.n_vertices :] for p in patches]
    return SurfaceMesh(
        sparse.csr_array(sparse.vstack([corners, mids])),
        np.concatenate([*offset[0], *offset[1]]),
        faces,
        param,
        {region: np.concatenate(parts) for region, parts in solids.items()}
        if linings or wedges
        else {"": np.concatenate(list(faces.values()))},
        np.concatenate(seam),
    )


def beginnings(body: Body, part: Part) -> Sequence[float]:
    """Where a sector may begin: anywhere, or where its cuts are farthest from the chambers beside the axis."""
    turns = turns_of(part)
    middles = np.array([_middle(chamber)[:2] for chamber in body.chambers if not _on_axis(chamber)]).reshape(-1, 2)
    if turns == 1 or len(middles):
        return (beginning_of(middles, turns),)
    return tuple(shift / turns for shift in _SHIFTS)


def _on_axis(surface: TubeSurface) -> bool:
    return bool(np.hypot(*_middle(surface)[:2]) <= _IN_PLANE)


def _with_images(body: Body, surface: TubeSurface, part: Part) -> list[TubeSurface]:
    """The surface and its images, as far as they are other surfaces, in the order of `TetMesh.faces`."""
    places = [_middle(surface)]
    if not _on_axis(surface):
        places = list(turned(turns_of(part)) @ places[0])
    for plane in part:
        if plane in MIRRORS and abs(places[0][NORMALS[plane]]) > _IN_PLANE:
            places += [place * MIRRORS[plane] for place in places]
    return [min(body.chambers, key=lambda each: float(np.abs(_middle(each) - place).max())) for place in places]


def _middle(surface: TubeSurface) -> np.ndarray:
    return surface.net.mean(axis=(0, 1))


def _kept(
    surface: TubeSurface,
    size: float,
    turn: float,
    part: Part,
    begin: float,
    exterior: TubeSurface,
    linings: Sequence[Lining],
    crossed: Sequence[float],
    wedges: Sequence[Wedge],
) -> Patch:
    """The part of a surface that is meshed: all of it, what is on the kept side of the cuts, or nothing."""
    middle, turns, edges = _middle(surface), turns_of(part), edges_of(surface, wedges)
    across = {plane: middle[NORMALS[plane]] for plane in part if plane in MIRRORS}
    if turns > 1 and _on_axis(surface):
        # Chambers have q clockwise.
        seam = (-begin - 1.0 / turns) % 1.0 if surface.cavity else begin
        slant = slant_of(surface, exterior, begin, seam + 1.0 / turns) if surface.cavity else UPRIGHT
        whole = patch_of(surface, size, turn, linings, crossed, wedges, Around(seam, 1, edges, turns), slant)
        patch = _with_seam(_before(whole, seam + 1.0 / turns), surface, seam, turns)
        q, r = patch.param[..., 0], patch.param[..., 1]
        return replace(patch, param=np.stack([q + slant.at(r), r], axis=-1))
    beyond = turns > 1 and (np.arctan2(middle[1], middle[0]) / (2.0 * np.pi) - begin) % 1.0 >= 1.0 / turns
    if beyond or any(place < -_IN_PLANE for place in across.values()):
        columns = surface.net.shape[0] * surface.net.shape[1]
        nothing, none = np.zeros((0, 6), int), np.zeros(0, "<U1")
        B = sparse.csr_array((0, columns))
        return Patch(B, np.zeros((0, 3)), 0, nothing, nothing[:, 0], np.zeros((0, 6, 2)), none, none)
    cutting = tuple(plane for plane, place in across.items() if place <= _IN_PLANE)
    if not cutting:
        around = Around(edges[0] if edges else 0.0, 1, edges, 1)
        return patch_of(surface, size, turn, linings, crossed, wedges, around)
    seam, parts = _SEAMS[cutting][int(surface.cavity)], 2 ** len(cutting)
    around = Around(seam, parts, edges, 1)
    return _before(patch_of(surface, size, turn, linings, crossed, wedges, around), seam + 1 / parts)


def _before(whole: Patch, q: float) -> Patch:
    """The triangles of a patch before a line of its grid."""
    part = whole.param[:, :3, 0].mean(axis=1) < q
    used, triangles = np.unique(whole.triangles[part], return_inverse=True)
    n_vertices = int(np.searchsorted(used, whole.n_vertices))
    return replace(
        whole,
        B=whole.B[used],
        offset=whole.offset[used],
        n_vertices=n_vertices,
        triangles=triangles.reshape(-1, 6),
        **{name: getattr(whole, name)[part] for name in ("part", "param", "behind", "ahead")},
    )


def _with_seam(patch: Patch, surface: TubeSurface, seam: float, turns: int) -> Patch:
    """The patch of a sector that begins at q = seam, with the nodes at its edges.

    Raises
    ------
    MeshError
        If the surface is not symmetric.
    """
    q, places = patch.param[..., 0], patch.B @ surface.net.reshape(-1, 3)
    ends = [np.unique(patch.triangles[np.abs(q - line) < 1e-9]) for line in (seam, seam + 1.0 / turns)]
    first, last = ends[::-1] if surface.cavity else ends
    away, nearest = KDTree(places[last]).query(places[first] @ onwards(turns).T)
    if len(first) != len(last) or len(np.unique(nearest)) < len(last) or away.max() > _SYMMETRIC:
        raise MeshError(UNLIKE)
    return replace(patch, seam=np.column_stack([first, last[nearest]]))
