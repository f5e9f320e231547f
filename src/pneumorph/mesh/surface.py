"""Triangulation of a body's surfaces in their parameters (q, r), as a linear map from control points to nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from itertools import pairwise

import numpy as np
from scipy import sparse
from scipy.spatial import KDTree

from pneumorph.errors import MeshError
from pneumorph.geometry import Body, Level, Lining, TubeSurface, Wedge
from pneumorph.mesh.interfaces import Sheet, steps_through, with_interface
from pneumorph.mesh.rings import Around, disc_rings, strip, tube_rings
from pneumorph.mesh.slant import UPRIGHT, Slant, slant_of
from pneumorph.mesh.tets import TRIANGLE_EDGES, TURNED
from pneumorph.problem.regions import REST
from pneumorph.problem.symmetry import MIRRORS, NORMALS, Part, beginning_of, turned, turns_of

UNLIKE = "the surfaces are not the same after a turn by one sector"
_SHIFTS = (0.0, 0.5, 0.25)  # where a sector begins that may do so anywhere, as far as tried
_SYMMETRIC = 1e-4  # mm; images on surfaces that are symmetric but for rounding are nearer
_IN_PLANE = 1e-6  # mm; a surface whose middle is nearer to a mirror plane is cut by it
_SEAMS = {("xz",): (0.0, 0.5), ("yz",): (0.75, 0.75), ("xz", "yz"): (0.0, 0.75)}
"""q at which the kept part begins, on the exterior and on a chamber, by the planes that cut the surface."""


@dataclass(frozen=True)
class SurfaceMesh:
    """Six-node triangles on the exact surfaces.

    Attributes
    ----------
    B : (n_nodes, n_points) sparse
        Nodes are ``B @ P + offset``; a row has at most 16 entries on a tube, and those of a whole end row on a disc.
    offset : (n_nodes, 3) float
        Zero on the surfaces; from there to the nodes where two rubbers meet, mm.
    faces : dict of (nf, 6) int
        Triangles by name (see `TetMesh.faces`), normals from solid to void; for a chamber its tube, then its discs.
    param : dict of (nf, 6, 2) float
        (q, r) of the nodes of the tubes' triangles, by surface name ("exterior" or a chamber's), in the order of
        ``faces``; q exceeds 1 where a triangle crosses the seam.
    solids : dict of (n, 6) int
        The triangles that bound each region, normals outwards; those between two regions belong to both. A body of a
        single rubber is one region ""; of wedges, each has its number as its name, and is open in half-planes.
    seam : (n, 2) int
        Of a sector, the nodes of the surfaces where it begins, each with its image, where it ends.
    """

    B: sparse.csr_array
    offset: np.ndarray
    faces: dict[str, np.ndarray]
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
        _kept(surface, side, turn, part, begin, body.exterior, lined, crossed, wedges)
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


@dataclass(frozen=True)
class _Patch:
    """One closed surface; ``part`` tells whether a triangle is on base disc (0), tube (1) or tip disc (2).

    Where rubbers meet along the surface there are more triangles (`interfaces.INTERFACE`). Behind and ahead of every
    triangle, as its normal points, is a region by name, or void: "".
    """

    B: sparse.csr_array
    offset: np.ndarray
    n_vertices: int
    triangles: np.ndarray
    part: np.ndarray
    param: np.ndarray
    behind: np.ndarray
    ahead: np.ndarray
    seam: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), int))

    @property
    def n_mids(self) -> int:
        return len(self.B.indptr) - 1 - self.n_vertices


def _edges(surface: TubeSurface, wedges: Sequence[Wedge]) -> list[float]:
    """q of the lines at the edges of wedges."""
    parts = [wedge.parts[surface.name] for wedge in wedges if surface.name in wedge.parts]
    return [part[0] % 1.0 for part in parts if part[1] - part[0] < 1.0]


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
) -> _Patch:
    """The part of a surface that is meshed: all of it, what is on the kept side of the cuts, or nothing."""
    middle, turns = _middle(surface), turns_of(part)
    across = {plane: middle[NORMALS[plane]] for plane in part if plane in MIRRORS}
    if turns > 1 and _on_axis(surface):
        # Chambers have q clockwise.
        seam = (-begin - 1.0 / turns) % 1.0 if surface.cavity else begin
        slant = slant_of(surface, exterior, begin, seam + 1.0 / turns) if surface.cavity else UPRIGHT
        whole = _patch(surface, size, turn, linings, crossed, wedges, seam, turns=turns, slant=slant)
        patch = _with_seam(_before(whole, seam + 1.0 / turns), surface, seam, turns)
        q, r = patch.param[..., 0], patch.param[..., 1]
        return replace(patch, param=np.stack([q + slant.at(r), r], axis=-1))
    beyond = turns > 1 and (np.arctan2(middle[1], middle[0]) / (2.0 * np.pi) - begin) % 1.0 >= 1.0 / turns
    if beyond or any(place < -_IN_PLANE for place in across.values()):
        columns = surface.net.shape[0] * surface.net.shape[1]
        nothing, none = np.zeros((0, 6), int), np.zeros(0, "<U1")
        B = sparse.csr_array((0, columns))
        return _Patch(B, np.zeros((0, 3)), 0, nothing, nothing[:, 0], np.zeros((0, 6, 2)), none, none)
    cutting = tuple(plane for plane, place in across.items() if place <= _IN_PLANE)
    if not cutting:
        edges = _edges(surface, wedges)
        return _patch(surface, size, turn, linings, crossed, wedges, edges[0] if edges else 0.0)
    seam, parts = _SEAMS[cutting][int(surface.cavity)], 2 ** len(cutting)
    return _before(_patch(surface, size, turn, linings, crossed, wedges, seam, parts), seam + 1 / parts)


def _before(whole: _Patch, q: float) -> _Patch:
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


def _with_seam(patch: _Patch, surface: TubeSurface, seam: float, turns: int) -> _Patch:
    """The patch of a sector that begins at q = seam, with the nodes at its edges.

    Raises
    ------
    MeshError
        If the surface is not symmetric.
    """
    q, places = patch.param[..., 0], patch.B @ surface.net.reshape(-1, 3)
    ends = [np.unique(patch.triangles[np.abs(q - line) < 1e-9]) for line in (seam, seam + 1.0 / turns)]
    first, last = ends[::-1] if surface.cavity else ends
    away, nearest = KDTree(places[last]).query(places[first] @ turned(turns)[1].T)
    if len(first) != len(last) or len(np.unique(nearest)) < len(last) or away.max() > _SYMMETRIC:
        raise MeshError(UNLIKE)
    return replace(patch, seam=np.column_stack([first, last[nearest]]))


def _patch(
    surface: TubeSurface,
    size: float,
    turn: float,
    linings: Sequence[Lining],
    crossed: Sequence[float],
    wedges: Sequence[Wedge],
    seam: float,
    parts: int = 1,
    turns: int = 1,
    slant: Slant = UPRIGHT,
) -> _Patch:
    """Place rings of vertices from the base's centre (or pole) to the tip's, and triangulate the strips between them.

    q starts at the `seam`. Of 2 or 4 `parts` that are mirror images, each begins and ends with edges in mirror planes.
    Of a number of `turns`, each is the image of the one before. Lines of the grid have the `slant`, which parameters of
    the patch leave out. There are edges along the rings r = `crossed`, and along the lines at the edges of wedges.
    """
    around = Around(seam, parts, _edges(surface, wedges), turns)
    tube = tube_rings(surface, size, turn, around, linings, crossed)
    # At most one layer ends in each disc.
    ending = [next((lining for lining in linings if lining.r[end] == end and not lining.ends), None) for end in (0, 1)]
    base, tip = (
        disc_rings(surface, ring, size, around, lining) if surface.ends == "flat" else []
        for ring, lining in zip((tube[0], tube[-1]), ending, strict=True)
    )
    rings = [*base[::-1], *tube, *tip]
    start = np.cumsum([0] + [len(ring.q) for ring in rings])

    # Corners as (ring, number along it); the number is n where a triangle closes a ring of n vertices.
    strips = [strip(around.joints(a.q), around.joints(b.q), k) for k, (a, b) in enumerate(pairwise(rings))]
    ring = np.concatenate([k + strip[..., 0] for k, strip in enumerate(strips)])
    along = np.concatenate([strip[..., 1] for strip in strips])
    strip_part = np.repeat([0, 1, 2], [len(base), len(tube) - 1, len(tip)])
    part = np.repeat(strip_part, [len(strip) for strip in strips])

    count = np.array([len(ring.q) for ring in rings])
    vertex = start[ring] + along % count[ring]
    vertex_q = np.concatenate([ring.q for ring in rings])
    q = vertex_q[vertex] + along // count[ring]
    r = np.array([ring.r for ring in rings])[ring]
    # The single vertex of a pole or a centre gets its q from the other two vertices of each triangle.
    single = count[ring] == 1
    q = np.where(single, np.where(single, 0.0, q).sum(axis=1, keepdims=True) / 2, q)

    row_r, row_s, depth = (np.repeat([getattr(ring, name) for ring in rings], count) for name in ("r", "s", "depth"))
    in_layer = np.full(len(vertex_q), -1)
    for lining, discs in zip(
        ending, (slice(0, start[len(base)]), slice(start[len(rings) - len(tip)], None)), strict=True
    ):
        in_layer[discs] = -1 if lining is None else linings.index(lining)
    rest, void = np.full(len(vertex), REST, object), np.full(len(vertex), "", object)
    for number, wedge in enumerate(wedges):
        rest[wedge.covers(surface.name, q.mean(axis=1))] = str(number)
    sheet = Sheet(vertex_q, row_r, row_s, depth, in_layer, vertex, q, r, part, single, rest, void)
    for number, lining in enumerate(linings):
        chains = np.full((len(sheet.q), steps_through(lining, size) + 1), -1)
        if not lining.ends:
            # In the discs, the way through the layer goes along the rings next to the rim.
            for end, inwards, rim in ((0, -1, len(base)), (1, 1, len(base) + len(tube) - 1)):
                if ending[end] is lining:
                    first = start[rim + inwards * np.arange(chains.shape[1])]
                    chains[start[rim] + np.arange(count[rim])] = first + np.arange(count[rim])[:, None]
        sheet = with_interface(sheet, lining, number, chains)
    return _curved(surface, sheet, linings, slant)


def _curved(surface: TubeSurface, sheet: Sheet, linings: Sequence[Lining], slant: Slant) -> _Patch:
    """The patch of a sheet: rows of B and offsets of its vertices, then those of the mid-side nodes of its edges."""
    vertex, q, r, single = sheet.vertex, sheet.corner_q, sheet.corner_r, sheet.single
    vertex_q, row_r, row_s = sheet.q, sheet.r, sheet.s
    # A mid-side node is shared by two triangles: number the edges, and take the parameters from one of the triangles.
    ends = vertex[:, TRIANGLE_EDGES]
    ends = np.sort(ends.reshape(-1, 2), axis=1)
    edges, first, inverse = np.unique(ends, axis=0, return_index=True, return_inverse=True)
    pole_end = single[:, TRIANGLE_EDGES]
    edge_q, edge_r = q[:, TRIANGLE_EDGES], r[:, TRIANGLE_EDGES]
    other = edge_q[..., ::-1]
    edge_q = np.where(pole_end, other, edge_q)  # an edge to a pole follows a meridian
    mid_q, mid_r = edge_q.mean(-1), edge_r.mean(-1)
    param = np.stack([np.hstack([q, mid_q]), np.hstack([r, mid_r])], axis=-1)

    vertices = _rows(surface, vertex_q + slant.at(row_r), row_r, row_s)
    on_tube = (row_s[edges] == 1.0).all(axis=1)
    curved_q, curved_r = mid_q.ravel()[first], mid_r.ravel()[first]
    curved = _rows(surface, curved_q + slant.at(curved_r), curved_r, np.ones(len(edges)))
    # Edges inside a disc are straight: their mid-side nodes are the means of their ends.
    pick = np.repeat(np.arange(len(edges)), 2)
    mean = sparse.csr_array((np.full(len(pick), 0.5), (pick, edges.ravel())), (len(edges), len(vertex_q)))
    chosen = sparse.diags_array(on_tube.astype(float))
    straight = sparse.diags_array((~on_tube).astype(float))
    mids = chosen @ curved + straight @ mean @ vertices
    triangles = np.hstack([vertex, len(vertex_q) + inverse.reshape(-1, 3)])
    B = sparse.csr_array(sparse.vstack([vertices, mids]))
    B.eliminate_zeros()
    offset = np.zeros((len(vertex_q), 3))
    mid_offset = np.zeros((len(edges), 3))
    for number, lining in enumerate(linings):
        moved = lining.offset.reshape(-1, 3)
        depth = np.where(sheet.lining == number, sheet.depth, 0.0)
        offset += depth[:, None] * (vertices @ moved)
        mid_offset += depth[edges].mean(axis=1)[:, None] * (curved @ moved)
    mid_offset = np.where(on_tube[:, None], mid_offset, offset[edges].mean(axis=1))
    return _Patch(
        B,
        np.concatenate([offset, mid_offset]),
        len(vertex_q),
        triangles,
        sheet.part,
        param,
        sheet.behind,
        sheet.ahead,
    )


def _rows(surface: TubeSurface, q: np.ndarray, r: np.ndarray, s: np.ndarray) -> sparse.csr_array:
    """Rows of B for the points s·x(q, r) + (1 - s)·centre, with the centre the mean of the end row."""
    n_r, n_q = surface.net.shape[:2]
    value_q = s[:, None] * surface.basis_q.matrix(q) + (1 - s[:, None]) / n_q
    value_r = surface.basis_r.matrix(r)
    row_r, col_r = np.nonzero(value_r)
    # Every nonzero value in r is multiplied by those in q: at most 4 × 4 on the tube.
    pairs = sparse.csr_array((value_r[row_r, col_r], (np.arange(len(row_r)), row_r)), (len(row_r), len(q)))
    blocks = sparse.coo_array(pairs @ sparse.csr_array(value_q))
    rows, cols = row_r[blocks.row], col_r[blocks.row] * n_q + blocks.col
    return sparse.csr_array((blocks.data, (rows, cols)), (len(q), n_r * n_q))
