"""Several adjoints at once: the derivatives of `points.shape_forces` for them, from moduli at the points.

`TOGETHER` adjoints are the last axis, where a processor works on several numbers at once.
"""

from __future__ import annotations

from collections.abc import Sequence

import numba
import numpy as np

from pneumorph.mechanics.elements.element import TET_DN
from pneumorph.mechanics.elements.points import FLAGS

TOGETHER = 8
"""Adjoints for which the kernel works at once."""


TET_SLOPES = np.moveaxis(TET_DN, 1, 2)
"""∂N_a/∂ξ_k at [point, k, a]."""


def side_by_side(each: Sequence[np.ndarray]) -> np.ndarray:
    """At most `TOGETHER` arrays as one, of which they are the last axis; the rest of it is zero."""
    together = np.zeros((*each[0].shape, TOGETHER))
    for number, own in enumerate(each):
        together[..., number] = own
    return together


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def shape_forces_of_several(slopes, dhydrostatic, stress, dilation, moduli, coupling, F, A, measure):
    """Derivatives of ∫ P : ∇w + (∂ψ/∂π) δπ by J = ∂X/∂ξ, at constant nodal u and w, in place of ∂w/∂ξ.

    Parameters
    ----------
    slopes : (4, 3, M, 3, TOGETHER) array
        ∂w_i/∂ξ_k at [point, k, element, i]; overwritten with the derivatives by J_ik.
    dhydrostatic : (4, M, TOGETHER) array
        δπ, the adjoints' own π.
    stress, F, A : (3, 3, 4, M) array
        P, F, and ∂ξ/∂X in 1/mm.
    dilation, measure : (4, M) array
        ∂ψ/∂π, and the volumes of the points in mm³.
    moduli : (9, 9, 4, M) array
        ∂²ψ/∂F∂F.
    coupling : (9, 4, M) array
        ∂²ψ/∂F∂π.
    """
    work, inner = np.empty(TOGETHER), np.empty((3, 3, TOGETHER))
    slope, dstress = np.empty((9, TOGETHER)), np.empty((9, TOGETHER))
    for e in range(F.shape[3]):
        for q in range(4):
            for i in range(3):
                for j in range(3):
                    a0, a1, a2 = A[0, j, q, e], A[1, j, q, e], A[2, j, q, e]
                    for n in range(TOGETHER):
                        slope[3 * i + j, n] = (
                            slopes[q, 0, e, i, n] * a0 + slopes[q, 1, e, i, n] * a1 + slopes[q, 2, e, i, n] * a2
                        )
            for n in range(TOGETHER):
                work[n] = dilation[q, e] * dhydrostatic[q, e, n]
            for i in range(9):
                p, c = stress[i // 3, i % 3, q, e], coupling[i, q, e]
                for n in range(TOGETHER):
                    work[n] += p * slope[i, n]
                    dstress[i, n] = c * dhydrostatic[q, e, n]
                for j in range(9):
                    modulus = moduli[i, j, q, e]
                    for n in range(TOGETHER):
                        dstress[i, n] += modulus * slope[j, n]
            # With F − I and ∇w changing by −(F − I) δJ A and −∇w δJ A, as in `points.shape_forces`.
            for i in range(3):
                for j in range(3):
                    for n in range(TOGETHER):
                        inner[i, j, n] = -dstress[3 * i + j, n]
                    for k in range(3):
                        f, p = F[k, i, q, e], stress[k, j, q, e]
                        for n in range(TOGETHER):
                            inner[i, j, n] += f * dstress[3 * k + j, n] + slope[3 * k + i, n] * p
            for i in range(3):
                for k in range(3):
                    own, a0, a1, a2 = A[k, i, q, e], A[k, 0, q, e], A[k, 1, q, e], A[k, 2, q, e]
                    for n in range(TOGETHER):
                        value = inner[i, 0, n] * a0 + inner[i, 1, n] * a1 + inner[i, 2, n] * a2
                        slopes[q, k, e, i, n] = measure[q, e] * (own * work[n] - value)


@numba.njit(cache=True)
def add_side_by_side(values, rows, out):
    """Add vectors (a, M, 3, TOGETHER) of elements to those of their nodes (a, M) in `out` (N, 3, TOGETHER)."""
    for a in range(rows.shape[0]):
        for e in range(rows.shape[1]):
            for i in range(3):
                for n in range(TOGETHER):
                    out[rows[a, e], i, n] += values[a, e, i, n]
