"""The fixed sparsity pattern of the tangent, and the kernels that fill it.

Unknowns are numbered: three per node that is not on the tip, in node order, then the six of the plate. Only the upper
triangle is stored (the tangent has a potential, so it is symmetric). Supported unknowns stay in the pattern as rows of
the identity.
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
        Number of unknowns, 3·(nodes off the tip) + 6.
    indptr, indices : CSR arrays of the upper triangle, columns ascending.
    visits, visit_start : (10·M,), (n + 1,) int
        For every node off the tip, the (element·10 + local node) pairs that touch it.
    slot : (M, 10, 10) int
        Rank of node b in the block row of node a, or −1 where the block is below the diagonal or touches the tip.
    beside_tip : (k,) int
        Nodes off the tip that share an element with it.
    """

    number: np.ndarray
    size: int
    indptr: np.ndarray
    indices: np.ndarray
    visits: np.ndarray
    visit_start: np.ndarray
    slot: np.ndarray
    beside_tip: np.ndarray


def pattern(tets: np.ndarray, count: int, on_tip: np.ndarray) -> Pattern:
    """Build the pattern for tetrahedra (M, 10) over `count` nodes, `on_tip` (count,) bool."""
    number = np.full(count, -1)
    number[~on_tip] = np.arange(np.count_nonzero(~on_tip))
    n = int(number.max()) + 1
    local = number[tets]

    a, b = local[:, :, None], local[:, None, :]
    upper = (a >= 0) & (b >= a)
    rows, columns = np.broadcast_to(a, upper.shape)[upper], np.broadcast_to(b, upper.shape)[upper]
    # Every node has its diagonal block, also one that no element touches.
    pairs = np.concatenate([rows, np.arange(n)]), np.concatenate([columns, np.arange(n)])
    blocks = sparse.csr_array((np.ones(len(pairs[0]), np.int8), pairs), shape=(n, n))
    blocks.sum_duplicates()
    blocks.sort_indices()
    keys = np.repeat(np.arange(n), np.diff(blocks.indptr)) * n + blocks.indices
    slot = np.full(upper.shape, -1, dtype=np.int32)
    slot[upper] = np.searchsorted(keys, rows.astype(np.int64) * n + columns) - blocks.indptr[rows]

    beside = np.unique(tets[on_tip[tets].any(axis=1)])
    beside = beside[~on_tip[beside]]
    with_plate = np.zeros(n, bool)
    with_plate[number[beside]] = True
    indptr, indices = _expand(n, blocks.indptr.astype(np.int64), blocks.indices.astype(np.int64), with_plate)

    touches = local.ravel()
    order = np.argsort(touches, kind="stable")
    order = order[touches[order] >= 0]
    start = np.searchsorted(touches[order], np.arange(n + 1))
    return Pattern(number, 3 * n + 6, indptr, indices, order, start, slot, beside)


@numba.njit(cache=True)
def _expand(n, block_start, block_columns, with_plate):
    """Scalar CSR (upper triangle) of a block pattern of 3×3 blocks, with six plate columns where asked."""
    indptr = np.zeros(3 * n + 7, np.int32)
    for row in range(n):
        width = 3 * (block_start[row + 1] - block_start[row]) + (6 if with_plate[row] else 0)
        for i in range(3):
            indptr[3 * row + i + 1] = indptr[3 * row + i] + width - i
    for i in range(6):
        indptr[3 * n + i + 1] = indptr[3 * n + i] + 6 - i
    indices = np.empty(indptr[-1], np.int32)
    for row in range(n):
        for i in range(3):
            at = indptr[3 * row + i]
            for block in range(block_start[row], block_start[row + 1]):
                first = i if block == block_start[row] else 0
                for k in range(first, 3):
                    indices[at] = 3 * block_columns[block] + k
                    at += 1
            if with_plate[row]:
                for k in range(6):
                    indices[at + k] = 3 * n + k
    for i in range(6):
        for k in range(i, 6):
            indices[indptr[3 * n + i] + k - i] = 3 * n + k
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
