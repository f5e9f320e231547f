"""Triangulation of one surface in its parameters (q, r), as a linear map from its control points to nodes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from itertools import pairwise

import numpy as np
from scipy import sparse

from pneumorph.geometry.tube.lining import Lining
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.geometry.tube.wedge import Wedge
from pneumorph.mesh.tets import TRIANGLE_EDGES
from pneumorph.mesh.tube.interfaces import Sheet, steps_through, with_interface
from pneumorph.mesh.tube.rings import SAME, Around, disc_rings, strip, tube_rings
from pneumorph.mesh.tube.slant import UPRIGHT, Slant
from pneumorph.problem.regions import REST


@dataclass(frozen=True)
class Patch:
    """One closed surface; ``part`` tells whether a triangle is on base disc (0), tube (1), or tip disc or pole (2).

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


def patch_of(
    surface: TubeSurface,
    size: float,
    turn: float,
    linings: Sequence[Lining],
    crossed: Sequence[float],
    wedges: Sequence[Wedge],
    around: Around,
    slant: Slant = UPRIGHT,
) -> Patch:
    """Place rings of vertices from the base's centre (or pole) to the tip's, and triangulate the strips between them.

    Parameters
    ----------
    surface : TubeSurface
    size : float
        Length of edges, mm.
    turn : float
        Largest angle by which the surface turns along an edge, rad.
    linings : sequence of Lining
        Where rubbers meet along the surface.
    crossed : sequence of float
        Values of r along which there are edges.
    wedges : sequence of Wedge
        Angles at whose sides there are edges.
    around : Around
        The lines along which rings are joined, with those at the sides of the wedges.
    slant : Slant
        Of lines of the grid; parameters of the patch leave it out.
    """
    bonded = [surface.bonded] if surface.bonded < 1.0 else []
    tube = tube_rings(surface, size, turn, around, linings, [*crossed, *bonded])
    # At most one layer ends in each disc.
    ending = [next((lining for lining in linings if lining.r[end] == end and not lining.ends), None) for end in (0, 1)]
    base, tip = (
        [] if pole else disc_rings(surface, ring, size, around, lining)
        for pole, ring, lining in zip(surface.poles, (tube[0], tube[-1]), ending, strict=True)
    )
    rings = [*base[::-1], *tube, *tip]
    start = np.cumsum([0] + [len(ring.q) for ring in rings])

    # Corners as (ring, number along it); the number is n where a triangle closes a ring of n vertices.
    strips = [strip(around.joints(a.q), around.joints(b.q), k) for k, (a, b) in enumerate(pairwise(rings))]
    ring = np.concatenate([k + strip[..., 0] for k, strip in enumerate(strips)])
    along = np.concatenate([strip[..., 1] for strip in strips])
    on_tube = [1 if ring.r < surface.bonded - SAME else 2 for ring in tube[:-1]]
    strip_part = np.array([*[0] * len(base), *on_tube, *[2] * len(tip)])
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


def _curved(surface: TubeSurface, sheet: Sheet, linings: Sequence[Lining], slant: Slant) -> Patch:
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
    return Patch(
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


def edges_of(surface: TubeSurface, wedges: Sequence[Wedge]) -> list[float]:
    """q of the lines at the edges of wedges."""
    parts = [wedge.parts[surface.name] for wedge in wedges if surface.name in wedge.parts]
    return [part[0] % 1.0 for part in parts if part[1] - part[0] < 1.0]
