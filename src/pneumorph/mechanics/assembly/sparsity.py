"""The fixed sparsity pattern of the tangent.

Unknowns are numbered: three per node that is not on the tip, in node order, then in mixed elements one pressure per
corner node, then the six of the plate. Only the upper triangle is stored (the tangent has a potential, so it is
symmetric). Supported unknowns stay in the pattern as rows of the identity.
"""

from __future__ import annotations

from dataclasses import dataclass

import numba
import numpy as np
from scipy import sparse


@dataclass(frozen=True)
class Pattern:
    """Where every element block goes in the upper triangle (CSR) of the tangent.

    Attributes
    ----------
    number : (N,) int
        Rank of each node among those not on the tip; −1 on the tip.
    size : int
        Number of unknowns, 3·(nodes off the tip) + corners + 6.
    indptr, indices : CSR arrays of the upper triangle, columns ascending.
    visits, visit_start : (10·M,), (n + 1,) int
        For every node off the tip, the (element·10 + local node) pairs that touch it.
    slot : (M, 10, 10) int
        Rank of node b in the block row of node a, or −1 where the block is below the diagonal or touches the tip.
    beside_tip : (k,) int
        Nodes off the tip that share an element with it.
    corners : (n_π,) int
        Nodes with a pressure; none where elements are not mixed.
    corners_beside_tip : (k_π,) int
        Ranks in `corners` of those that share an element with the tip.
    coupling_places : (M·10·4·3,) int
        Place in the values of ∂²/∂u∂π for every element, node, corner and component; −1 on the tip.
    compression_places : (M·4·4,) int
        Place in the values of ∂²/∂π∂π for every element and pair of corners; −1 below the diagonal.
    """

    number: np.ndarray
    size: int
    indptr: np.ndarray
    indices: np.ndarray
    visits: np.ndarray
    visit_start: np.ndarray
    slot: np.ndarray
    beside_tip: np.ndarray
    corners: np.ndarray
    corners_beside_tip: np.ndarray
    coupling_places: np.ndarray
    compression_places: np.ndarray


def pattern(tets: np.ndarray, count: int, on_tip: np.ndarray, mixed: bool = False) -> Pattern:
    """Build the pattern for tetrahedra (M, 10) over `count` nodes, `on_tip` (count,) bool."""
    number = np.full(count, -1)
    number[~on_tip] = np.arange(np.count_nonzero(~on_tip))
    n = int(number.max()) + 1
    local = number[tets]

    a, b = local[:, :, None], local[:, None, :]
    blocks, slot = _couples(a, b, (a >= 0) & (b >= a), n, n)

    corners = np.unique(tets[:, :4]) if mixed else np.zeros(0, int)
    rank = np.full(count, -1)
    rank[corners] = np.arange(len(corners))
    at_corner = rank[tets[:, :4]] if mixed else np.zeros((0, 4), int)
    moved = local if mixed else np.zeros((0, 10), int)
    c, d = at_corner[:, :, None], at_corner[:, None, :]
    coupling, coupling_slot = _couples(moved[:, :, None], d, moved[:, :, None] >= 0, n, len(corners), diagonal=False)
    compression, compression_slot = _couples(c, d, d >= c, len(corners), len(corners))

    near = tets[on_tip[tets].any(axis=1)]
    beside = np.unique(near)
    beside = beside[~on_tip[beside]]
    with_plate = np.zeros(n, bool)
    with_plate[number[beside]] = True
    corners_beside = np.unique(rank[near[:, :4]]) if mixed else corners
    corner_with_plate = np.zeros(len(corners), bool)
    corner_with_plate[corners_beside] = True
    indptr, indices = _expand(
        (blocks.indptr.astype(np.int64), blocks.indices.astype(np.int64)),
        (coupling.indptr.astype(np.int64), coupling.indices.astype(np.int64)),
        (compression.indptr.astype(np.int64), compression.indices.astype(np.int64)),
        (with_plate, corner_with_plate),
    )

    # In a row of u the pressures follow the blocks of u; in a row of π they come first.
    row = 3 * moved[:, :, None] + np.arange(3)
    first = indptr[row] + 3 * np.diff(blocks.indptr)[moved][:, :, None] - np.arange(3)
    coupling_places = first[:, :, None, :] + coupling_slot[:, :, :, None]
    coupling_places[coupling_slot < 0] = -1
    compression_places = indptr[3 * n + c] + compression_slot
    compression_places[compression_slot < 0] = -1

    touches = local.ravel()
    order = np.argsort(touches, kind="stable")
    order = order[touches[order] >= 0]
    start = np.searchsorted(touches[order], np.arange(n + 1))
    return Pattern(
        number=number,
        size=len(indptr) - 1,
        indptr=indptr,
        indices=indices,
        visits=order,
        visit_start=start,
        slot=slot,
        beside_tip=beside,
        corners=corners,
        corners_beside_tip=corners_beside,
        coupling_places=coupling_places.ravel(),
        compression_places=compression_places.ravel(),
    )


def _couples(a, b, used, rows: int, columns: int, diagonal: bool = True) -> tuple[sparse.csr_array, np.ndarray]:
    """The pattern (CSR) of all used pairs (a, b), and of every pair its rank in its row; −1 where it is not used."""
    i, j, used = np.broadcast_arrays(a, b, used)
    i, j = i[used], j[used]
    # Every unknown has its diagonal entry, also one that no element touches.
    extra = np.arange(rows) if diagonal else np.zeros(0, int)
    pairs = np.concatenate([i, extra]), np.concatenate([j, extra])
    couples = sparse.csr_array((np.ones(len(pairs[0]), np.int8), pairs), shape=(rows, columns))
    couples.sum_duplicates()
    couples.sort_indices()
    keys = np.repeat(np.arange(rows), np.diff(couples.indptr)) * columns + couples.indices
    slot = np.full(used.shape, -1, dtype=np.int32)
    slot[used] = np.searchsorted(keys, i.astype(np.int64) * columns + j) - couples.indptr[i]
    return couples, slot


@numba.njit(cache=True)
def _expand(blocks, coupling, compression, with_plate):
    """Scalar CSR (upper triangle) of 3×3 blocks of u, rows of u with π, rows of π; six plate columns where asked."""
    block_start, block_columns = blocks
    coupling_start, coupling_columns = coupling
    compression_start, compression_columns = compression
    plate_u, plate_p = with_plate
    n, m = len(block_start) - 1, len(compression_start) - 1
    indptr = np.zeros(3 * n + m + 7, np.int32)
    for row in range(n):
        width = 3 * (block_start[row + 1] - block_start[row]) + coupling_start[row + 1] - coupling_start[row]
        if plate_u[row]:
            width += 6
        for i in range(3):
            indptr[3 * row + i + 1] = indptr[3 * row + i] + width - i
    for row in range(m):
        width = compression_start[row + 1] - compression_start[row] + (6 if plate_p[row] else 0)
        indptr[3 * n + row + 1] = indptr[3 * n + row] + width
    for i in range(6):
        indptr[3 * n + m + i + 1] = indptr[3 * n + m + i] + 6 - i
    indices = np.empty(indptr[-1], np.int32)
    for row in range(n):
        for i in range(3):
            at = indptr[3 * row + i]
            for block in range(block_start[row], block_start[row + 1]):
                first = i if block == block_start[row] else 0
                for k in range(first, 3):
                    indices[at] = 3 * block_columns[block] + k
                    at += 1
            for entry in range(coupling_start[row], coupling_start[row + 1]):
                indices[at] = 3 * n + coupling_columns[entry]
                at += 1
            if plate_u[row]:
                for k in range(6):
                    indices[at + k] = 3 * n + m + k
    for row in range(m):
        at = indptr[3 * n + row]
        for entry in range(compression_start[row], compression_start[row + 1]):
            indices[at] = 3 * n + compression_columns[entry]
            at += 1
        if plate_p[row]:
            for k in range(6):
                indices[at + k] = 3 * n + m + k
    for i in range(6):
        for k in range(i, 6):
            indices[indptr[3 * n + m + i] + k - i] = 3 * n + m + k
    return indptr, indices
