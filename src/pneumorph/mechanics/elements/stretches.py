"""Numba kernels: stress and moduli of an energy w(ln λ, J, π) of the principal stretches λ of F and of J = det F.

With eigenvectors Q_a of FᵀF, M_ab = F Q_a ⊗ Q_b and t_a = w_a/λ_a², the stress is Σ t_a M_aa + w_J cof F. In the frame
of the Q_a, what changes FᵀF changes 2 ∂w/∂FᵀF by its own derivatives on the diagonal, and by the divided differences
(t_a − t_b)/(λ_a² − λ_b²) beside it (Ogden, Non-Linear Elastic Deformations, 1984, §6.1.4).
"""

from __future__ import annotations

import numba
import numpy as np

from pneumorph.mechanics.elements.points import FLAGS
from pneumorph.mechanics.material.spectral import SMALLEST, SWEEPS

ROUNDING = 1e-17
"""Part of the trace below which elements beside the diagonal change no eigenvalue any more."""

ALIKE = 3e-6
"""Squares of stretches that differ by less than this part have the limit of the divided difference: its error is the
square of that, and that of the difference is rounding divided by it."""


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def principal(F, logs, axes, ratio):
    """ln λ (3, 4, M), eigenvectors of FᵀF as columns (3, 3, 4, M), and det F (4, M), by Jacobi's method.

    Parameters
    ----------
    F : (3, 3, 4, M) array
    logs, axes, ratio : array
        Filled.
    """
    C, Q = np.empty((3, 3)), np.empty((3, 3))
    for e in range(F.shape[3]):
        for q in range(4):
            for i in range(3):
                for j in range(3):
                    C[i, j] = (
                        F[0, i, q, e] * F[0, j, q, e] + F[1, i, q, e] * F[1, j, q, e] + F[2, i, q, e] * F[2, j, q, e]
                    )
                    Q[i, j] = 1.0 if i == j else 0.0
            for _ in range(SWEEPS):
                if abs(C[0, 1]) + abs(C[0, 2]) + abs(C[1, 2]) <= ROUNDING * (C[0, 0] + C[1, 1] + C[2, 2]):
                    break
                for turn in range(3):
                    a, b = turn, (turn + 1) % 3
                    _turn(C, Q, a, b, 3 - a - b)
            for a in range(3):
                value = C[a, a]
                # What is not a number stays so.
                logs[a, q, e] = 0.5 * np.log(SMALLEST if value < SMALLEST else value)
                for i in range(3):
                    axes[i, a, q, e] = Q[i, a]
            ratio[q, e] = (
                F[0, 0, q, e] * (F[1, 1, q, e] * F[2, 2, q, e] - F[1, 2, q, e] * F[2, 1, q, e])
                - F[0, 1, q, e] * (F[1, 0, q, e] * F[2, 2, q, e] - F[1, 2, q, e] * F[2, 0, q, e])
                + F[0, 2, q, e] * (F[1, 0, q, e] * F[2, 1, q, e] - F[1, 1, q, e] * F[2, 0, q, e])
            )


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def _turn(C, Q, a, b, c):
    """Turn the axes a and b of C and Q (3, 3) so that C's element between them vanishes; c is the third."""
    off = 2.0 * C[a, b]
    if off == 0.0:
        return
    gap = C[b, b] - C[a, a]
    tangent = off / (gap + np.copysign(np.sqrt(gap * gap + off * off), gap))
    cosine = 1.0 / np.sqrt(1.0 + tangent * tangent)
    sine = tangent * cosine
    C[a, a] -= 0.5 * tangent * off
    C[b, b] += 0.5 * tangent * off
    C[a, b] = C[b, a] = 0.0
    one, other = C[a, c], C[b, c]
    C[a, c] = C[c, a] = cosine * one - sine * other
    C[b, c] = C[c, b] = sine * one + cosine * other
    for i in range(3):
        one, other = Q[i, a], Q[i, b]
        Q[i, a] = cosine * one - sine * other
        Q[i, b] = sine * one + cosine * other


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def stress_by_stretches(w, logs, axes, F, stress):
    """P = Σ w_a/λ_a² M_aa + w_J cof F (3, 3, 4, M), of w's derivatives by ln λ and J, or of what they change by.

    Parameters
    ----------
    w : (4 or more, 4, M) array
        w₁, w₂, w₃, w_J.
    logs, axes, F : array
        See `principal`.
    stress : (3, 3, 4, M) array
        Filled.
    """
    inner = np.empty((3, 3))
    for e in range(F.shape[3]):
        for q in range(4):
            _in_axes(w[:, q, e], logs[:, q, e], axes[:, :, q, e], inner)
            for i in range(3):
                i1, i2 = (i + 1) % 3, (i + 2) % 3
                for j in range(3):
                    j1, j2 = (j + 1) % 3, (j + 2) % 3
                    cofactor = F[i1, j1, q, e] * F[i2, j2, q, e] - F[i1, j2, q, e] * F[i2, j1, q, e]
                    value = w[3, q, e] * cofactor
                    for k in range(3):
                        value += F[i, k, q, e] * inner[k, j]
                    stress[i, j, q, e] = value


@numba.njit(cache=True, fastmath=FLAGS)
def _in_axes(w, logs, axes, inner):
    """Σ w_a/λ_a² Q_a ⊗ Q_a, into `inner` (3, 3)."""
    inner[:, :] = 0.0
    for a in range(3):
        share = w[a] * np.exp(-2.0 * logs[a])
        for i in range(3):
            for j in range(3):
                inner[i, j] += share * axes[i, a] * axes[j, a]


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def moduli_by_stretches(w, second, logs, axes, F, moduli):
    """∂²w/∂F∂F (9, 9, 4, M), of w's first and second derivatives by ln λ, J and π.

    Parameters
    ----------
    w : (5, 4, M) array
    second : (5, 5, 4, M) array
    logs, axes, F : array
        See `principal`.
    moduli : (9, 9, 4, M) array
        Filled.
    """
    f, inner, slope, square = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty(3)
    # M₁₁, M₂₂, M₃₃, cof F, and M_ab + M_ba; and among the first four the second derivatives.
    vectors, among, A = np.empty((7, 9)), np.empty((4, 4)), np.empty((9, 9))
    for e in range(F.shape[3]):
        for q in range(4):
            for a in range(3):
                square[a] = np.exp(2.0 * logs[a, q, e])
                for i in range(3):
                    f[i, a] = 0.0
                    for k in range(3):
                        f[i, a] += F[i, k, q, e] * axes[k, a, q, e]
            for i in range(3):
                i1, i2 = (i + 1) % 3, (i + 2) % 3
                for j in range(3):
                    j1, j2 = (j + 1) % 3, (j + 2) % 3
                    m = 3 * i + j
                    vectors[3, m] = F[i1, j1, q, e] * F[i2, j2, q, e] - F[i1, j2, q, e] * F[i2, j1, q, e]
                    for a in range(3):
                        b = (a + 1) % 3
                        vectors[a, m] = f[i, a] * axes[j, a, q, e]
                        vectors[4 + a, m] = f[i, a] * axes[j, b, q, e] + f[i, b] * axes[j, a, q, e]
            for a in range(3):
                for b in range(3):
                    # ∂t_a/∂λ_b².
                    slope[a, b] = 0.5 * second[a, b, q, e] / (square[a] * square[b])
                slope[a, a] -= w[a, q, e] / square[a] ** 2
            for a in range(3):
                for b in range(3):
                    among[a, b] = 2.0 * slope[a, b]
                among[a, 3] = among[3, a] = second[a, 3, q, e] / square[a]
            among[3, 3] = second[3, 3, q, e]
            A[:, :] = 0.0
            for a in range(4):
                for n in range(9):
                    value = 0.0
                    for b in range(4):
                        value += among[a, b] * vectors[b, n]
                    for m in range(9):
                        A[m, n] += vectors[a, m] * value
            for a in range(3):
                b = (a + 1) % 3
                gap = square[a] - square[b]
                if abs(gap) > ALIKE * (square[a] + square[b]):
                    difference = (w[a, q, e] / square[a] - w[b, q, e] / square[b]) / gap
                else:
                    difference = 0.5 * (slope[a, a] + slope[b, b] - slope[a, b] - slope[b, a])
                for n in range(9):
                    value = difference * vectors[4 + a, n]
                    for m in range(9):
                        A[m, n] += vectors[4 + a, m] * value
            _in_axes(w[:, q, e], logs[:, q, e], axes[:, :, q, e], inner)
            for i in range(3):
                i1, i2 = (i + 1) % 3, (i + 2) % 3
                for j in range(3):
                    j1, j2 = (j + 1) % 3, (j + 2) % 3
                    for k in range(3):
                        A[3 * i + j, 3 * i + k] += inner[j, k]
                    # w_J ∂²J: the cofactor's own derivative, with the signs of the even and odd permutations.
                    A[3 * i + j, 3 * i1 + j1] += w[3, q, e] * F[i2, j2, q, e]
                    A[3 * i + j, 3 * i2 + j2] += w[3, q, e] * F[i1, j1, q, e]
                    A[3 * i + j, 3 * i1 + j2] -= w[3, q, e] * F[i2, j1, q, e]
                    A[3 * i + j, 3 * i2 + j1] -= w[3, q, e] * F[i1, j2, q, e]
            for m in range(9):
                for n in range(9):
                    moduli[m, n, q, e] = A[m, n]
