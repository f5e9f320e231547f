"""The fixed sparsity pattern of the tangent, and the kernels that fill it.

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


@numba.njit(cache=True, parallel=True, fastmath=True)
def element_blocks(moduli, inverse_jacobian, derivative, blocks):
    """Stiffness of every element, Σ_q Gᵀ A G, as its blocks (M, 55, 9) of nodes a ≤ b.

    From the moduli (9, 9, 4, M), ∂ξ/∂X (3, 3, 4, M) and ∂N/∂ξ (4, 10, 3).
    """
    for e in numba.prange(blocks.shape[0]):
        local = np.zeros((55, 9))
        half = np.empty((3, 3, 3))
        A, G = np.empty((9, 9)), np.empty((10, 3))
        for point in range(4):
            for i in range(9):
                for j in range(9):
                    A[i, j] = moduli[i, j, point, e]
            for a in range(10):
                for j in range(3):
                    G[a, j] = (
                        derivative[point, a, 0] * inverse_jacobian[0, j, point, e]
                        + derivative[point, a, 1] * inverse_jacobian[1, j, point, e]
                        + derivative[point, a, 2] * inverse_jacobian[2, j, point, e]
                    )
            for b in range(10):
                for i in range(3):
                    for j in range(3):
                        for k in range(3):
                            half[j, i, k] = (
                                A[3 * i + j, 3 * k] * G[b, 0]
                                + A[3 * i + j, 3 * k + 1] * G[b, 1]
                                + A[3 * i + j, 3 * k + 2] * G[b, 2]
                            )
                for a in range(b + 1):
                    row = b * (b + 1) // 2 + a
                    for i in range(3):
                        for k in range(3):
                            local[row, 3 * i + k] += (
                                G[a, 0] * half[0, i, k] + G[a, 1] * half[1, i, k] + G[a, 2] * half[2, i, k]
                            )
        blocks[e] = local


@numba.njit(cache=True, parallel=True)
def gather(blocks, visits, visit_start, slot, indptr, data):
    """Sum element blocks (M, 55, 9) into the CSR values `data`; every block row is filled by one thread."""
    for row in numba.prange(len(visit_start) - 1):
        for i in range(3):
            for at in range(indptr[3 * row + i], indptr[3 * row + i + 1]):
                data[at] = 0.0
        for visit in range(visit_start[row], visit_start[row + 1]):
            e, a = visits[visit] // 10, visits[visit] % 10
            for b in range(10):
                m = slot[e, a, b]
                if m < 0:
                    continue
                lower, higher = min(a, b), max(a, b)
                block = blocks[e, higher * (higher + 1) // 2 + lower]
                for i in range(3):
                    base = indptr[3 * row + i] + 3 * m - i
                    for k in range(i if m == 0 else 0, 3):
                        data[base + k] += block[3 * i + k] if a <= b else block[3 * k + i]


@numba.njit(cache=True, parallel=True, fastmath=True)
def coupling_blocks(slopes, inverse_jacobian, derivative, corner_shape, blocks):
    """Σ_q Gᵀ ∂²ψ/∂F∂π N of every element, (M, 10, 4, 3): by node, corner and component.

    From the slopes (9, 4, M), ∂ξ/∂X (3, 3, 4, M), ∂N/∂ξ (4, 10, 3) and the corners' linear shape functions (4, 4).
    """
    for e in numba.prange(blocks.shape[0]):
        local = np.zeros((10, 4, 3))
        for point in range(4):
            for a in range(10):
                for i in range(3):
                    value = 0.0
                    for j in range(3):
                        gradient = (
                            derivative[point, a, 0] * inverse_jacobian[0, j, point, e]
                            + derivative[point, a, 1] * inverse_jacobian[1, j, point, e]
                            + derivative[point, a, 2] * inverse_jacobian[2, j, point, e]
                        )
                        value += gradient * slopes[3 * i + j, point, e]
                    for c in range(4):
                        local[a, c, i] += value * corner_shape[point, c]
        blocks[e] = local


@numba.njit(cache=True)
def scatter(values, places, data):
    """Add values to their places in `data`; those with a negative place are left out."""
    for k in range(len(places)):
        if places[k] >= 0:
            data[places[k]] += values[k]
