"""Exact derivatives of the limited quantities with respect to the tangents, by the chain rule in reverse."""

from __future__ import annotations

import numba
import numpy as np

from pneumorph.limits.tube.measures.formulas import FLOOR, SMOOTHING, forms, quantities

FLAGS = {"contract", "reassoc"}
"""Fast arithmetic, but with NaN and infinity."""


@numba.njit(cache=True, nogil=True, fastmath=FLAGS, error_model="numpy")
def forms_of(tangents, S, S_r):
    """The forms from U, r_r, U_q, U_r and r_rr (5, 3), see `forms`."""
    across, along = (tangents[0, 0], tangents[0, 1], tangents[0, 2]), (tangents[1, 0], tangents[1, 1], tangents[1, 2])
    across_q = (tangents[2, 0], tangents[2, 1], tangents[2, 2])
    across_r = (tangents[3, 0], tangents[3, 1], tangents[3, 2])
    along_r = (tangents[4, 0], tangents[4, 1], tangents[4, 2])
    return forms(across, along, across_q, across_r, along_r, S, S_r)


@numba.njit(cache=True, nogil=True, fastmath=FLAGS, error_model="numpy")
def measures_of(f, aspect, per_mm):
    """Curvature, skew, stretch and area from the forms at a point, as `formulas.pointwise` has them."""
    over_area2, over_E, over_G = 1.0 / max(f.area2, FLOOR**2), 1.0 / max(f.E, FLOOR**2), 1.0 / max(f.G, FLOOR**2)
    curvature, skew, stretch = quantities(f, aspect, per_mm, over_area2, over_E, over_G)
    return curvature, skew, stretch, np.sqrt(f.area2 + SMOOTHING**2)


@numba.njit(cache=True, nogil=True, fastmath=FLAGS, error_model="numpy")
def differentiate(kind, tangents, S, S_r, aspect, per_mm, slopes):
    """One of the measures at a point, and its derivatives (5, 3) with respect to the tangents into `slopes`.

    kind is 0 to 3 for curvature, skew, stretch and area. A name with `d_` is the derivative of the measure with respect
    to what follows.

    Parameters
    ----------
    kind : int
    tangents : (5, 3) array
        U, r_r, U_q, U_r and r_rr.
    S, S_r : float
        See `Frame`; 1/mm for the latter.
    aspect : float
        Length over circumference of the starting tube.
    per_mm : bool
        The form of the stretch, see `measures`.
    slopes : (5, 3) array
        Overwritten.
    """
    f = forms_of(tangents, S, S_r)
    over_area2, over_E, over_G = 1.0 / max(f.area2, FLOOR**2), 1.0 / max(f.E, FLOOR**2), 1.0 / max(f.G, FLOOR**2)
    d_E, d_F, d_G, d_area2, d_twice_H, d_gauss = 0.0, 0.0, 0.0, 0.0, 0.0, 0.0
    d_E_q, d_E_r, d_G_q, d_G_r = 0.0, 0.0, 0.0, 0.0
    if kind == 0:
        bend = f.twice_H * over_area2
        d_twice_H = bend * over_area2 * over_area2
        d_gauss = -over_area2 * over_area2
        d_area2 = over_area2 * over_area2 * (2.0 * f.gauss * over_area2 - 1.5 * bend * bend)
    elif kind == 1:
        lean = f.F * over_E * over_G
        d_F, d_E, d_G = 2.0 * lean, -lean * f.F * over_E, -lean * f.F * over_G
    elif kind == 2:
        E_q, E_r, G_q, G_r = f.E_q * over_E, f.E_r * over_E, f.G_q * over_G, f.G_r * over_G
        if not per_mm:
            first, second = E_q + E_r * aspect, G_q / aspect + G_r
            E_q, E_r, G_q, G_r = first, first * aspect, second / aspect, second
        d_E_q, d_E_r, d_G_q, d_G_r = 2.0 * E_q * over_E, 2.0 * E_r * over_E, 2.0 * G_q * over_G, 2.0 * G_r * over_G
        d_E = -(d_E_q * f.E_q + d_E_r * f.E_r) * over_E
        d_G = -(d_G_q * f.G_q + d_G_r * f.G_r) * over_G
    else:
        d_area2 = 0.5 / np.sqrt(f.area2 + SMOOTHING**2)
    # Denominators on their floor are constant.
    if kind == 0 and f.area2 <= FLOOR**2:
        d_area2 = 0.0
    if f.E <= FLOOR**2:
        d_E = 0.0
    if f.G <= FLOOR**2:
        d_G = 0.0

    # The same quantities as in `forms`, then from its end to its start.
    ux, uy, V = tangents[0, 0], tangents[0, 1], tangents[0, 2]
    rx, ry, W = tangents[1, 0], tangents[1, 1], tangents[1, 2]
    uqx, uqy, V_q = tangents[2, 0], tangents[2, 1], tangents[2, 2]
    ax, ay, az = tangents[3, 0], tangents[3, 1], tangents[3, 2]
    bx, by, bz = tangents[4, 0], tangents[4, 1], tangents[4, 2]
    mx, my, nz = uy * W - V * ry, V * rx - ux * W, ux * ry - uy * rx
    nx, ny, uz, rz, uqz = S * mx, S * my, S * V, S * W, S * V_q
    L, M, N = uqx * mx + uqy * my + V_q * nz, ax * nx + ay * ny + az * nz, bx * nx + by * ny + bz * nz

    d_E += d_twice_H * N
    d_G += d_twice_H * L
    d_F += d_G_q * S_r - 2.0 * d_twice_H * M
    d_L = d_twice_H * f.G + d_gauss * N
    d_M = -2.0 * (d_twice_H * f.F + d_gauss * M)
    d_N = d_twice_H * f.E + d_gauss * L
    d_nx = 2.0 * d_area2 * nx + d_M * ax + d_N * bx
    d_ny = 2.0 * d_area2 * ny + d_M * ay + d_N * by
    d_nz = 2.0 * d_area2 * nz + d_M * az + d_N * bz + d_L * V_q
    d_mx, d_my = S * d_nx + d_L * uqx, S * d_ny + d_L * uqy
    d_uz = 2.0 * d_E * uz + d_F * rz + d_E_q * uqz + d_E_r * az
    d_rz = 2.0 * d_G * rz + d_F * uz + S * d_G_q * az + d_G_r * bz
    slopes[0, 0] = 2.0 * d_E * ux + d_F * rx + d_E_q * uqx + d_E_r * ax - d_my * W + d_nz * ry
    slopes[0, 1] = 2.0 * d_E * uy + d_F * ry + d_E_q * uqy + d_E_r * ay + d_mx * W - d_nz * rx
    slopes[0, 2] = S * d_uz - d_mx * ry + d_my * rx
    slopes[1, 0] = 2.0 * d_G * rx + d_F * ux + S * d_G_q * ax + d_G_r * bx + d_my * V - d_nz * uy
    slopes[1, 1] = 2.0 * d_G * ry + d_F * uy + S * d_G_q * ay + d_G_r * by - d_mx * V + d_nz * ux
    slopes[1, 2] = S * d_rz + d_mx * uy - d_my * ux
    slopes[2, 0], slopes[2, 1], slopes[2, 2] = d_L * mx + d_E_q * ux, d_L * my + d_E_q * uy, d_L * nz + S * d_E_q * uz
    slopes[3, 0] = d_M * nx + d_E_r * ux + S * d_G_q * rx
    slopes[3, 1] = d_M * ny + d_E_r * uy + S * d_G_q * ry
    slopes[3, 2] = d_M * nz + d_E_r * uz + S * d_G_q * rz
    slopes[4, 0], slopes[4, 1], slopes[4, 2] = d_N * nx + d_G_r * rx, d_N * ny + d_G_r * ry, d_N * nz + d_G_r * rz
    return measures_of(f, aspect, per_mm)[kind]
