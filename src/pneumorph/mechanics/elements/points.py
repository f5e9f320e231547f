"""Numba kernels: strains and stresses at the quadrature points of tetrahedra, and the nodal forces they make.

Points are the trailing axes, (…, 4, M), as the energies take them. With U = ∂u/∂ξ and A = ∂ξ/∂X, F = I + U A. Moving
the nodes changes J = ∂X/∂ξ by δJ, so δA = −A δJ A, δF = (δU − (F − I) δJ) A, and volumes change by the factor
1 + tr(A δJ).
"""

from __future__ import annotations

import numba
import numpy as np

FLAGS = {"contract", "reassoc", "nsz", "arcp"}
"""Fast arithmetic, but with NaN and infinity, which the solvers check for."""


@numba.njit(cache=True, fastmath=FLAGS)
def _gradient(nodal, derivative):
    """Σ_a v_a ⊗ ∂N_a/∂ξ of nodal vectors v (10, 3), row by row: nine numbers, which stay in registers."""
    xx, xy, xz, yx, yy, yz, zx, zy, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    for a in range(10):
        x, y, z = nodal[a, 0], nodal[a, 1], nodal[a, 2]
        dx, dy, dz = derivative[a, 0], derivative[a, 1], derivative[a, 2]
        xx, xy, xz = xx + x * dx, xy + x * dy, xz + x * dz
        yx, yy, yz = yx + y * dx, yy + y * dy, yz + y * dz
        zx, zy, zz = zx + z * dx, zy + z * dy, zz + z * dz
    return xx, xy, xz, yx, yy, yz, zx, zy, zz


@numba.njit(cache=True, fastmath=FLAGS)
def inverse(J, A):
    """Write the inverse of J (3, 3) to A, by cofactors; returns det J."""
    for i in range(3):
        i1, i2 = (i + 1) % 3, (i + 2) % 3
        for j in range(3):
            j1, j2 = (j + 1) % 3, (j + 2) % 3
            A[j, i] = J[i1, j1] * J[i2, j2] - J[i1, j2] * J[i2, j1]
    volume = J[0, 0] * A[0, 0] + J[0, 1] * A[1, 0] + J[0, 2] * A[2, 0]
    for i in range(3):
        for j in range(3):
            A[i, j] /= volume
    return volume


@numba.njit(cache=True, fastmath=FLAGS)
def _multiply(one, other, out):
    """Write the product of two matrices (3, 3) to a third."""
    for i in range(3):
        for j in range(3):
            out[i, j] = one[i, 0] * other[0, j] + one[i, 1] * other[1, j] + one[i, 2] * other[2, j]


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def strain(X, u, derivative, weight, F, A, measure):
    """F and A (3, 3, 4, M) and the volumes of the points (4, M), of tetrahedra at X (M, 10, 3) displaced by u.

    Parameters
    ----------
    X, u : (M, 10, 3) array
        Nodes and their displacements, mm.
    derivative : (4, 10, 3) array
        ∂N/∂ξ.
    weight : float
        Of a point.
    F, A : (3, 3, 4, M) array
        Filled; A = ∂ξ/∂X, 1/mm.
    measure : (4, M) array
        Filled, mm³.
    """
    for e in range(X.shape[0]):
        for q in range(4):
            # Written out and in one loop: all of it stays in registers, which takes a quarter of the time.
            xx, xy, xz, yx, yy, yz, zx, zy, zz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            uxx, uxy, uxz, uyx, uyy, uyz, uzx, uzy, uzz = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
            for a in range(10):
                dx, dy, dz = derivative[q, a, 0], derivative[q, a, 1], derivative[q, a, 2]
                x, y, z = X[e, a, 0], X[e, a, 1], X[e, a, 2]
                xx, xy, xz = xx + x * dx, xy + x * dy, xz + x * dz
                yx, yy, yz = yx + y * dx, yy + y * dy, yz + y * dz
                zx, zy, zz = zx + z * dx, zy + z * dy, zz + z * dz
                x, y, z = u[e, a, 0], u[e, a, 1], u[e, a, 2]
                uxx, uxy, uxz = uxx + x * dx, uxy + x * dy, uxz + x * dz
                uyx, uyy, uyz = uyx + y * dx, uyy + y * dy, uyz + y * dz
                uzx, uzy, uzz = uzx + z * dx, uzy + z * dy, uzz + z * dz
            first, second, third = yy * zz - yz * zy, yz * zx - yx * zz, yx * zy - yy * zx
            volume = xx * first + xy * second + xz * third
            measure[q, e], over = weight * volume, 1.0 / volume
            axx, axy, axz = over * first, over * (xz * zy - xy * zz), over * (xy * yz - xz * yy)
            ayx, ayy, ayz = over * second, over * (xx * zz - xz * zx), over * (xz * yx - xx * yz)
            azx, azy, azz = over * third, over * (xy * zx - xx * zy), over * (xx * yy - xy * yx)
            A[0, 0, q, e], A[0, 1, q, e], A[0, 2, q, e] = axx, axy, axz
            A[1, 0, q, e], A[1, 1, q, e], A[1, 2, q, e] = ayx, ayy, ayz
            A[2, 0, q, e], A[2, 1, q, e], A[2, 2, q, e] = azx, azy, azz
            F[0, 0, q, e] = 1.0 + uxx * axx + uxy * ayx + uxz * azx
            F[0, 1, q, e] = uxx * axy + uxy * ayy + uxz * azy
            F[0, 2, q, e] = uxx * axz + uxy * ayz + uxz * azz
            F[1, 0, q, e] = uyx * axx + uyy * ayx + uyz * azx
            F[1, 1, q, e] = 1.0 + uyx * axy + uyy * ayy + uyz * azy
            F[1, 2, q, e] = uyx * axz + uyy * ayz + uyz * azz
            F[2, 0, q, e] = uzx * axx + uzy * ayx + uzz * azx
            F[2, 1, q, e] = uzx * axy + uzy * ayy + uzz * azy
            F[2, 2, q, e] = 1.0 + uzx * axz + uzy * ayz + uzz * azz


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def strain_along(du, derivative, A, dF):
    """δF (3, 3, 4, M) where displacements change by du (M, 10, 3) at nodes that rest.

    Parameters
    ----------
    du : (M, 10, 3) array
        mm.
    derivative : (4, 10, 3) array
        ∂N/∂ξ.
    A : (3, 3, 4, M) array
        ∂ξ/∂X, 1/mm.
    dF : (3, 3, 4, M) array
        Filled.
    """
    for e in range(du.shape[0]):
        for q in range(4):
            dU = _gradient(du[e], derivative[q])
            for i in range(3):
                for j in range(3):
                    dF[i, j, q, e] = (
                        dU[3 * i] * A[0, j, q, e] + dU[3 * i + 1] * A[1, j, q, e] + dU[3 * i + 2] * A[2, j, q, e]
                    )


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def straining(dX, du, derivative, F, A, dF, dA, growth):
    """δF and δA (3, 3, 4, M) and tr(A δJ) (4, M) where nodes move by dX and displacements change by du (M, 10, 3).

    Parameters
    ----------
    dX, du : (M, 10, 3) array
        mm.
    derivative : (4, 10, 3) array
        ∂N/∂ξ.
    F, A : (3, 3, 4, M) array
        As `strain` has them.
    dF, dA, growth : array
        Filled.
    """
    relative = np.empty((3, 3))
    for e in range(dX.shape[0]):
        for q in range(4):
            dJ, dU = _gradient(dX[e], derivative[q]), _gradient(du[e], derivative[q])
            grown = 0.0
            for i in range(3):
                for k in range(3):
                    grown += A[k, i, q, e] * dJ[3 * i + k]
                    value = dU[3 * i + k] + dJ[3 * i + k]
                    for j in range(3):
                        value -= F[i, j, q, e] * dJ[3 * j + k]
                    relative[i, k] = value
            growth[q, e] = grown
            for i in range(3):
                for j in range(3):
                    moved, turned = 0.0, 0.0
                    for k in range(3):
                        moved += relative[i, k] * A[k, j, q, e]
                        inner = 0.0
                        for m in range(3):
                            inner += A[i, m, q, e] * dJ[3 * m + k]
                        turned -= inner * A[k, j, q, e]
                    dF[i, j, q, e] = moved
                    dA[i, j, q, e] = turned


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def stress_along(w, F, dF, dhydrostatic, stress, dstress, dslope):
    """P and δP (3, 3, 4, M), and δ∂ψ/∂π (4, M), of an energy w(I₁, I₂, J, π) of the invariants of F.

    From w's derivatives (13, 4, M): w₁, w₂, w₃ by I₁, I₂, J; w₁₁, w₁₂, w₁₃, w₂₂, w₂₃, w₃₃; w₁π, w₂π, w₃π, wππ.

    Parameters
    ----------
    w : (13, 4, M) array
    F, dF : (3, 3, 4, M) array
    dhydrostatic : (4, M) array
        δπ, MPa.
    stress, dstress : (3, 3, 4, M) array
        Filled, MPa.
    dslope : (4, M) array
        Filled.
    """
    f, df, right, dright = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    second, dsecond, third, dthird = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for e in range(F.shape[3]):
        for q in range(4):
            for i in range(3):
                for j in range(3):
                    f[i, j], df[i, j] = F[i, j, q, e], dF[i, j, q, e]
            for i in range(3):
                for j in range(3):
                    value, change = 0.0, 0.0
                    for k in range(3):
                        value += f[k, i] * f[k, j]
                        change += df[k, i] * f[k, j] + f[k, i] * df[k, j]
                    right[i, j], dright[i, j] = value, change
            first, dfirst = right[0, 0] + right[1, 1] + right[2, 2], dright[0, 0] + dright[1, 1] + dright[2, 2]
            by_second, by_third = 0.0, 0.0
            for i in range(3):
                i1, i2 = (i + 1) % 3, (i + 2) % 3
                for j in range(3):
                    j1, j2 = (j + 1) % 3, (j + 2) % 3
                    # ∂I₁ = 2 F, ∂I₂ = 2 (I₁ F − F FᵀF), ∂J = cof F, and how they change.
                    value, change = first * f[i, j], dfirst * f[i, j] + first * df[i, j]
                    for k in range(3):
                        value -= f[i, k] * right[k, j]
                        change -= df[i, k] * right[k, j] + f[i, k] * dright[k, j]
                    second[i, j], dsecond[i, j] = 2 * value, 2 * change
                    third[i, j] = f[i1, j1] * f[i2, j2] - f[i1, j2] * f[i2, j1]
                    dthird[i, j] = (
                        df[i1, j1] * f[i2, j2]
                        + f[i1, j1] * df[i2, j2]
                        - df[i1, j2] * f[i2, j1]
                        - f[i1, j2] * df[i2, j1]
                    )
                    by_second += second[i, j] * df[i, j]
                    by_third += third[i, j] * df[i, j]
            dp = dhydrostatic[q, e]
            w1, w2, w3 = w[0, q, e], w[1, q, e], w[2, q, e]
            dw1 = w[3, q, e] * dfirst + w[4, q, e] * by_second + w[5, q, e] * by_third + w[9, q, e] * dp
            dw2 = w[4, q, e] * dfirst + w[6, q, e] * by_second + w[7, q, e] * by_third + w[10, q, e] * dp
            dw3 = w[5, q, e] * dfirst + w[7, q, e] * by_second + w[8, q, e] * by_third + w[11, q, e] * dp
            dslope[q, e] = w[9, q, e] * dfirst + w[10, q, e] * by_second + w[11, q, e] * by_third + w[12, q, e] * dp
            for i in range(3):
                for j in range(3):
                    stress[i, j, q, e] = 2 * w1 * f[i, j] + w2 * second[i, j] + w3 * third[i, j]
                    dstress[i, j, q, e] = (
                        2 * (dw1 * f[i, j] + w1 * df[i, j])
                        + dw2 * second[i, j]
                        + w2 * dsecond[i, j]
                        + dw3 * third[i, j]
                        + w3 * dthird[i, j]
                    )


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def nodal_forces(stress, A, measure, derivative, forces):
    """∫ P : ∂F/∂u_a of every element, (M, 10, 3), of stresses P (3, 3, 4, M).

    Parameters
    ----------
    stress, A : (3, 3, 4, M) array
        P in MPa, ∂ξ/∂X in 1/mm.
    measure : (4, M) array
        Volumes of the points, mm³.
    derivative : (4, 10, 3) array
        ∂N/∂ξ.
    forces : (M, 10, 3) array
        Filled, N.
    """
    for e in range(forces.shape[0]):
        forces[e] = 0.0
        for q in range(4):
            # Written out, as in `strain`.
            axx, axy, axz = A[0, 0, q, e], A[0, 1, q, e], A[0, 2, q, e]
            ayx, ayy, ayz = A[1, 0, q, e], A[1, 1, q, e], A[1, 2, q, e]
            azx, azy, azz = A[2, 0, q, e], A[2, 1, q, e], A[2, 2, q, e]
            for i in range(3):
                size = measure[q, e]
                x, y, z = size * stress[i, 0, q, e], size * stress[i, 1, q, e], size * stress[i, 2, q, e]
                first = x * axx + y * axy + z * axz
                second = x * ayx + y * ayy + z * ayz
                third = x * azx + y * azy + z * azz
                for a in range(10):
                    forces[e, a, i] += (
                        first * derivative[q, a, 0] + second * derivative[q, a, 1] + third * derivative[q, a, 2]
                    )


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def shape_forces(work, stress, dstress, slope, F, A, measure, derivative, forces):
    """Derivative (M, 10, 3) of ∫ P : ∇w by the nodes X, at constant nodal u and w.

    From `work` (4, M), the integrand; P, δP along ∇w, and ∇w itself, the `slope`, (3, 3, 4, M): with δF = −(F − I) δJ A
    and δ∇w = −∇w δJ A it is ∫ (work Aᵀ − (F − I)ᵀ δP Aᵀ − ∇wᵀ P Aᵀ) : δJ.

    Parameters
    ----------
    work, measure : (4, M) array
    stress, dstress, slope, F, A : (3, 3, 4, M) array
    derivative : (4, 10, 3) array
        ∂N/∂ξ.
    forces : (M, 10, 3) array
        Filled.
    """
    inner, carried = np.empty((3, 3)), np.empty((3, 3))
    for e in range(forces.shape[0]):
        forces[e] = 0.0
        for q in range(4):
            for i in range(3):
                for j in range(3):
                    value = -dstress[i, j, q, e]
                    for k in range(3):
                        value += F[k, i, q, e] * dstress[k, j, q, e] + slope[k, i, q, e] * stress[k, j, q, e]
                    inner[i, j] = value
            for i in range(3):
                for k in range(3):
                    value = work[q, e] * A[k, i, q, e]
                    for j in range(3):
                        value -= inner[i, j] * A[k, j, q, e]
                    carried[i, k] = measure[q, e] * value
            _spread(carried, derivative[q], forces[e])


@numba.njit(cache=True, fastmath=FLAGS)
def _spread(carried, derivative, forces):
    """Add carried (3, 3) · ∂N_a/∂ξ to the forces (10, 3) of an element."""
    for a in range(10):
        for i in range(3):
            forces[a, i] += (
                carried[i, 0] * derivative[a, 0] + carried[i, 1] * derivative[a, 1] + carried[i, 2] * derivative[a, 2]
            )


@numba.njit(cache=True)
def add_rows(values, rows, out):
    """Add the vectors (E, a, 3) of elements to those of their nodes (E, a) in `out` (N, 3)."""
    for e in range(rows.shape[0]):
        for a in range(rows.shape[1]):
            for i in range(3):
                out[rows[e, a], i] += values[e, a, i]


@numba.njit(cache=True, nogil=True, fastmath=FLAGS)
def turn_on(F, dF, squarings):
    """Deformation gradients F (3, 3, 4, M) become exp(δF F⁻¹) F, in place.

    The exponential of a small A is (I − ½A)⁻¹ (I + ½A), which turns by what is antisymmetric in A without stretching;
    that of a larger one is that of A/2ⁿ, squared n times.

    Parameters
    ----------
    F : (3, 3, 4, M) array
    dF : (3, 3, 4, M) array
        δF.
    squarings : int
        n.
    """
    share = 0.5 / 2**squarings
    here, turned, one, other = np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3)), np.empty((3, 3))
    for e in range(F.shape[3]):
        for q in range(F.shape[2]):
            for i in range(3):
                for j in range(3):
                    here[i, j], one[i, j] = F[i, j, q, e], share * dF[i, j, q, e]
            inverse(here, other)
            _multiply(one, other, turned)
            for i in range(3):
                for j in range(3):
                    unit = 1.0 if i == j else 0.0
                    one[i, j], other[i, j] = unit - turned[i, j], unit + turned[i, j]
            inverse(one, turned)
            _multiply(turned, other, one)
            for _ in range(squarings):
                _multiply(one, one, other)
                one, other = other, one
            _multiply(one, here, turned)
            for i in range(3):
                for j in range(3):
                    F[i, j, q, e] = turned[i, j]
