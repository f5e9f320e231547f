"""Numba kernels: the stiffness of rubber tetrahedra, and the assembly of blocks in the tangent's values."""

from __future__ import annotations

import numba
import numpy as np

from pneumorph.threads import each

ROWS = 2000
"""Block rows that a thread takes at once."""


@numba.njit(cache=True, nogil=True, fastmath=True)
def element_blocks(moduli, inverse_jacobian, derivative, blocks):
    """Stiffness Σ_q Gᵀ A G of every element, as blocks (M, 55, 9) of node pairs a ≤ b.

    From the moduli A (9, 9, 4, M), ∂ξ/∂X (3, 3, 4, M) and ∂N/∂ξ (4, 10, 3).

    Parameters
    ----------
    moduli : (9, 9, 4, M) array
        ∂²ψ/∂F∂F times the volumes of the points, N·mm.
    inverse_jacobian : (3, 3, 4, M) array
        ∂ξ/∂X, 1/mm.
    derivative : (4, 10, 3) array
        ∂N/∂ξ.
    blocks : (M, 55, 9) array
        Filled, N/mm.
    """
    half, A, G = np.empty((3, 3, 3)), np.empty((9, 9)), np.empty((10, 3))
    for e in range(blocks.shape[0]):
        local = blocks[e]
        local[:, :] = 0.0
        for point in range(4):
            for i in range(9):
                for j in range(9):
                    A[i, j] = moduli[i, j, point, e]
            _gradients(derivative[point], inverse_jacobian[:, :, point, e], G)
            _add(A, G, half, local)


@numba.njit(cache=True, nogil=True, fastmath=True)
def invariant_blocks(derivatives, F, inverse_jacobian, derivative, blocks):
    """The stiffness for an energy w(I₁, I₂, J) of the invariants of F (3, 3, 4, M).

    From w's `derivatives` (9, 4, M): w₁, w₂, w₃ by I₁, I₂, J, and w₁₁, w₁₂, w₁₃, w₂₂, w₂₃, w₃₃.

    Parameters
    ----------
    derivatives : (9, 4, M) array
        Of w, times the volumes of the points, N·mm.
    F : (3, 3, 4, M) array
    inverse_jacobian : (3, 3, 4, M) array
        ∂ξ/∂X, 1/mm.
    derivative : (4, 10, 3) array
        ∂N/∂ξ.
    blocks : (M, 55, 9) array
        Filled, N/mm.
    """
    half, A, G, slopes = np.empty((3, 3, 3)), np.empty((9, 9)), np.empty((10, 3)), np.empty((3, 9))
    for e in range(blocks.shape[0]):
        local = blocks[e]
        local[:, :] = 0.0
        for point in range(4):
            moduli_by_invariants(derivatives[:, point, e], F[:, :, point, e], slopes, A)
            _gradients(derivative[point], inverse_jacobian[:, :, point, e], G)
            _add(A, G, half, local)


@numba.njit(cache=True, nogil=True, fastmath=True)
def moduli_of_invariants(derivatives, F, moduli):
    """∂²w/∂F∂F of an energy w(I₁, I₂, J), into moduli (9, 9, 4, M).

    Parameters
    ----------
    derivatives : (9 or more, 4, M) array
        Of w, as for `invariant_blocks`, but not times volumes.
    F : (3, 3, 4, M) array
    moduli : (9, 9, 4, M) array
        Filled.
    """
    A, slopes = np.empty((9, 9)), np.empty((3, 9))
    for e in range(F.shape[3]):
        for point in range(4):
            moduli_by_invariants(derivatives[:, point, e], F[:, :, point, e], slopes, A)
            for i in range(9):
                for j in range(9):
                    moduli[i, j, point, e] = A[i, j]


@numba.njit(cache=True, nogil=True, fastmath=True)
def node_blocks(moduli, inverse_jacobian, derivative, blocks):
    """The blocks (M, 10, 9) of `element_blocks` of every node with itself.

    Parameters
    ----------
    moduli, inverse_jacobian, derivative : arrays
        As `element_blocks` has them.
    blocks : (M, 10, 9) array
        Filled, N/mm.
    """
    A, G = np.empty((9, 9)), np.empty((10, 3))
    for e in range(blocks.shape[0]):
        local = blocks[e]
        local[:, :] = 0.0
        for point in range(4):
            for i in range(9):
                for j in range(9):
                    A[i, j] = moduli[i, j, point, e]
            _gradients(derivative[point], inverse_jacobian[:, :, point, e], G)
            _add_nodes(A, G, local)


@numba.njit(cache=True, nogil=True, fastmath=True)
def invariant_node_blocks(derivatives, F, inverse_jacobian, derivative, blocks):
    """The blocks (M, 10, 9) of `invariant_blocks` of every node with itself.

    Parameters
    ----------
    derivatives, F, inverse_jacobian, derivative : arrays
        As `invariant_blocks` has them.
    blocks : (M, 10, 9) array
        Filled, N/mm.
    """
    A, G, slopes = np.empty((9, 9)), np.empty((10, 3)), np.empty((3, 9))
    for e in range(blocks.shape[0]):
        local = blocks[e]
        local[:, :] = 0.0
        for point in range(4):
            moduli_by_invariants(derivatives[:, point, e], F[:, :, point, e], slopes, A)
            _gradients(derivative[point], inverse_jacobian[:, :, point, e], G)
            _add_nodes(A, G, local)


@numba.njit(cache=True, fastmath=True)
def _add_nodes(A, G, local):
    """Add Gᵀ A G of one point to the blocks (10, 9) of an element's nodes with themselves."""
    for a in range(10):
        for i in range(3):
            for k in range(3):
                value = 0.0
                for j in range(3):
                    for n in range(3):
                        value += G[a, j] * A[3 * i + j, 3 * k + n] * G[a, n]
                local[a, 3 * i + k] += value


@numba.njit(cache=True, fastmath=True)
def moduli_by_invariants(w, F, slopes, A):
    """∂²w/∂F∂F = Σ w_a ∂²I_a + Σ w_ab ∂I_a ⊗ ∂I_b at one point, into A (9, 9).

    Parameters
    ----------
    w : (9,) array
        Derivatives of the energy, see `invariant_blocks`.
    F : (3, 3) array
    slopes : (3, 9) array
        Overwritten: ∂I₁, ∂I₂, ∂J.
    A : (9, 9) array
        Filled.
    """
    # ∂I₁ = 2 F, ∂I₂ = 2 (I₁ F − F FᵀF), ∂J = cof F.
    left, right = np.zeros((3, 3)), np.zeros((3, 3))
    first = 0.0
    for i in range(3):
        for j in range(3):
            first += F[i, j] * F[i, j]
            for k in range(3):
                left[i, j] += F[i, k] * F[j, k]
                right[i, j] += F[k, i] * F[k, j]
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            strained = F[i, 0] * right[0, j] + F[i, 1] * right[1, j] + F[i, 2] * right[2, j]
            slopes[0, 3 * i + j] = 2 * F[i, j]
            slopes[1, 3 * i + j] = 2 * (first * F[i, j] - strained)
            slopes[2, 3 * i + j] = F[i1, j1] * F[i2, j2] - F[i1, j2] * F[i2, j1]
    for m in range(9):
        a, b, c = slopes[0, m], slopes[1, m], slopes[2, m]
        by_first = w[3] * a + w[4] * b + w[5] * c
        by_second = w[4] * a + w[6] * b + w[7] * c
        by_ratio = w[5] * a + w[7] * b + w[8] * c
        for n in range(9):
            A[m, n] = by_first * slopes[0, n] + by_second * slopes[1, n] + by_ratio * slopes[2, n]
    for m in range(9):
        A[m, m] += 2 * (w[0] + first * w[1])
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            # ∂²J: the cofactor's own derivative, with the signs of the even and odd permutations.
            A[3 * i + j, 3 * i1 + j1] += w[2] * F[i2, j2]
            A[3 * i + j, 3 * i2 + j2] += w[2] * F[i1, j1]
            A[3 * i + j, 3 * i1 + j2] -= w[2] * F[i2, j1]
            A[3 * i + j, 3 * i2 + j1] -= w[2] * F[i1, j2]
    if w[1] != 0.0:
        for i in range(3):
            for j in range(3):
                for k in range(3):
                    A[3 * i + j, 3 * i + k] -= 2 * w[1] * right[j, k]
                    A[3 * i + j, 3 * k + j] -= 2 * w[1] * left[i, k]
                    for n in range(3):
                        A[3 * i + j, 3 * k + n] += w[1] * (4 * F[i, j] * F[k, n] - 2 * F[i, n] * F[k, j])


@numba.njit(cache=True, fastmath=True)
def _gradients(derivative, inverse_jacobian, G):
    """∂N/∂X at one point, into G (10, 3)."""
    for a in range(10):
        for j in range(3):
            G[a, j] = (
                derivative[a, 0] * inverse_jacobian[0, j]
                + derivative[a, 1] * inverse_jacobian[1, j]
                + derivative[a, 2] * inverse_jacobian[2, j]
            )


@numba.njit(cache=True, fastmath=True)
def _add(A, G, half, local):
    """Add Gᵀ A G of one point to the blocks (55, 9) of its element; `half` (3, 3, 3) is work space."""
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
                    local[row, 3 * i + k] += G[a, 0] * half[0, i, k] + G[a, 1] * half[1, i, k] + G[a, 2] * half[2, i, k]


def gather(
    blocks: np.ndarray,
    visits: np.ndarray,
    visit_start: np.ndarray,
    slot: np.ndarray,
    indptr: np.ndarray,
    data: np.ndarray,
) -> None:
    """Add blocks (E, pairs of nodes a ≤ b, 9) to the CSR values `data`; each block row is filled by one thread.

    Parameters
    ----------
    blocks : (E, a(a + 1)/2, 9) array
        N/mm.
    visits, visit_start, slot : int arrays
        Where they go, see `BlockPlaces`.
    indptr : (n + 1,) int
        Starts of the rows.
    data : (nnz,) array
        Values of the tangent, changed in place.
    """

    def work(rows: range) -> None:
        _gather(blocks, visits, visit_start, slot, indptr, data, rows.start, rows.stop)

    count = len(visit_start) - 1
    each(work, [range(first, min(first + ROWS, count)) for first in range(0, count, ROWS)])


@numba.njit(cache=True, nogil=True)
def _gather(blocks, visits, visit_start, slot, indptr, data, first, last):
    """Add what belongs to some block rows."""
    count = slot.shape[1]
    for row in range(first, last):
        for visit in range(visit_start[row], visit_start[row + 1]):
            e, a = visits[visit] // count, visits[visit] % count
            for b in range(count):
                m = slot[e, a, b]
                if m < 0:
                    continue
                lower, higher = min(a, b), max(a, b)
                block = blocks[e, higher * (higher + 1) // 2 + lower]
                for i in range(3):
                    base = indptr[3 * row + i] + 3 * m - i
                    for k in range(i if m == 0 else 0, 3):
                        data[base + k] += block[3 * i + k] if a <= b else block[3 * k + i]


@numba.njit(cache=True, nogil=True, fastmath=True)
def coupling_blocks(slopes, inverse_jacobian, derivative, corner_shape, blocks):
    """Σ_q Gᵀ ∂²ψ/∂F∂π N of every element, (M, 10, 4, 3): by node, corner and component.

    From the slopes (9, 4, M), ∂ξ/∂X (3, 3, 4, M), ∂N/∂ξ (4, 10, 3) and the corners' linear shape functions (4, 4).

    Parameters
    ----------
    slopes : (9, 4, M) array
        ∂²ψ/∂F∂π times the volumes of the points, mm³.
    inverse_jacobian : (3, 3, 4, M) array
        ∂ξ/∂X, 1/mm.
    derivative : (4, 10, 3) array
        ∂N/∂ξ.
    corner_shape : (4, 4) array
        Linear shape functions at the points.
    blocks : (M, 10, 4, 3) array
        Filled, mm².
    """
    for e in range(blocks.shape[0]):
        local = blocks[e]
        local[:, :, :] = 0.0
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


def scatter(values: np.ndarray, places: np.ndarray, data: np.ndarray) -> None:
    """Add values to `data` at the given places; negative places are skipped."""
    used = places >= 0
    np.add.at(data, places[used], values[used])
