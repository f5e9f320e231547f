"""Tangents that stay finite up to the poles.

At a pole the derivative r_q vanishes although the surface has a tangent plane there. Let S(r) be the circumference of
the starting capsule relative to τ_q. Since S has the same simple zero, U = r_q / S does not vanish, and all limited
quantities are written in U and r_r. The row of control points next to a pole is at the pole's height along the
direction of that end (see `DesignSpace`), so the tangent plane is across it, and the part of U, U_q and r_r along it
has another factor S. It is divided out as well, because the coefficient L of the second fundamental form needs it. So
the net is first turned: z is here along the direction of the pole by which a place is measured, the nearer one. None of
the limited quantities depends on how the surface is turned.

On the knot span at a pole, S and the basis functions are polynomials with a zero at the pole. There the zeros are
divided out before anything is evaluated, so nothing is lost by cancellation, however near the pole.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numba.extending import register_jitable
from numpy.typing import ArrayLike, NDArray

from pneumorph.geometry.tube.local import pieces
from pneumorph.geometry.tube.surface import TubeSurface, turn_to

Floats = NDArray[np.float64]


class Frame(NamedTuple):
    """Functions of r by which tangents are computed from a net's columns; lengths in mm of the starting tube.

    Attributes
    ----------
    across, along, across_r, along_r : (3, rows, n_r) arrays
        For U, r_r, U_r and r_rr, one matrix per component. The z of U and of r_r is divided by S.
    shrink, slope : (rows, 1) arrays
        S and dS/dr; 1 and 0 without poles.
    turns : (2, 3, 3) array
        See `Meridian`.
    side : (rows,) int array
        Which of the turns is that of a row: 0 or 1.
    """

    across: Floats
    along: Floats
    across_r: Floats
    along_r: Floats
    shrink: Floats
    slope: Floats
    turns: Floats
    side: NDArray[np.integer]


class Meridian(NamedTuple):
    """What `local_frame` needs of a surface.

    Attributes
    ----------
    pieces : (spans, 4, 4) array
        Coefficients of the basis functions in r, see `geometry.tube.local.pieces`.
    parallels : (n_r,) array
        Control values of S.
    base, tip : bool
        Whether these are poles.
    length : float
        mm.
    turns : (2, 3, 3) array
        Rotations from z to the directions at base and tip where these are poles: the columns are the axes of the frame
        of places that are measured by that pole.
    """

    pieces: Floats
    parallels: Floats
    base: bool
    tip: bool
    length: float
    turns: Floats


def meridian(surface: TubeSurface) -> Meridian:
    """The functions of r of a surface."""
    turns = [
        turn_to(direction) if pole else np.eye(3)
        for pole, direction in zip(surface.poles, surface.directions, strict=True)
    ]
    return Meridian(pieces(surface.basis_r), surface.parallels, *surface.poles, surface.size[1], np.stack(turns))


@register_jitable
def side_of(base, tip, r):
    """By which end a place at r is measured, given which ends are poles: 0 for the base, 1 for the tip."""
    return 1 if tip and (r > 0.5 or not base) else 0


def frame(surface: TubeSurface, r: ArrayLike) -> Frame:
    """The frame at parameters r (rows,), which may include the poles."""
    r = np.atleast_1d(np.asarray(r, dtype=float))
    functions = np.zeros((4, 3, len(r), surface.basis_r.count))
    shrink, slope = np.empty((len(r), 1)), np.empty((len(r), 1))
    around, local = meridian(surface), np.empty((4, 3, 4))
    for row, place in enumerate(r):
        first, shrink[row], slope[row] = local_frame(around, place, local)
        functions[:, :, row, first : first + 4] = local
    across, along, across_r, along_r = functions
    side = np.array([side_of(around.base, around.tip, place) for place in r])
    return Frame(across, along, across_r, along_r, shrink, slope, around.turns, side)


@register_jitable(error_model="numpy")
def local_frame(meridian, r, functions):
    """Write the parts (4, 3, 4) of the frame at r that are nonzero; returns their first row of the net, S and dS/dr.

    `functions` has, for U, r_r, U_r and r_rr and each component, the factors of four successive rows of the turned net.
    """
    spans, r = len(meridian.pieces), min(max(r, 0.0), 1.0)
    span = min(int(r * spans), spans - 1)
    rate = spans / meridian.length
    if meridian.base or meridian.tip:
        tip = side_of(meridian.base, meridian.tip, r) == 1
        nearer = spans - 1 - span if tip else span
        return _polar(meridian, nearer, (1.0 - r if tip else r) * spans - nearer, rate, tip, functions)
    u = r * spans - span
    for i in range(4):
        a = meridian.pieces[span, i]
        B = a[0] + u * (a[1] + u * (a[2] + u * a[3]))
        B_r = rate * (a[1] + u * (2.0 * a[2] + u * 3.0 * a[3]))
        B_rr = rate * rate * (2.0 * a[2] + u * 6.0 * a[3])
        for c in range(3):
            functions[0, c, i], functions[1, c, i], functions[2, c, i], functions[3, c, i] = B, B_r, B_r, B_rr
    return span, 1.0, 0.0


@register_jitable(error_model="numpy")
def _polar(meridian, span, u, rate, flipped, functions):
    """The same with poles, at the place u (0 to 1) on a span.

    Spans and rows of the net are numbered from the nearer pole, which is the tip if `flipped`. Basis functions are
    symmetric about the middle.
    """
    count, way = len(meridian.parallels), -1.0 if flipped else 1.0
    # Rows from here on, numbered from the nearer pole, are beyond the net, or belong to the other pole.
    end = count - 1 if meridian.base and meridian.tip else count + 1
    s0, s1, s2, s3 = 0.0, 0.0, 0.0, 0.0
    for i in range(4):
        j, a = span + i, meridian.pieces[span, i]
        weight = meridian.parallels[count - 1 - j if flipped else j]
        s0, s1, s2, s3 = s0 + weight * a[0], s1 + weight * a[1], s2 + weight * a[2], s3 + weight * a[3]
    S, S_u = s0 + u * (s1 + u * (s2 + u * s3)), s1 + u * (2.0 * s2 + u * 3.0 * s3)
    # On the first span everything divided by S has a zero too: S = u T. Otherwise S = T.
    polar = span == 0
    T, T_u = (s1 + u * (s2 + u * s3), s2 + u * 2.0 * s3) if polar else (S, S_u)

    for i in range(4):
        j, a = span + i, meridian.pieces[span, i]
        B = a[0] + u * (a[1] + u * (a[2] + u * a[3]))
        B_u, B_uu = a[1] + u * (2.0 * a[2] + u * 3.0 * a[3]), 2.0 * a[2] + u * 6.0 * a[3]
        across, across_u, level, rise = 0.0, 0.0, 0.0, 0.0
        # The row of the pole itself does not depend on q.
        if 0 < j < end:
            P, P_u = (a[1] + u * (a[2] + u * a[3]), a[2] + u * 2.0 * a[3]) if polar else (B, B_u)
            across = P / T
            across_u = (P_u - across * T_u) / T
            # Pole and ring (the row next to it) have the same z, so the sum of their functions counts, which has a
            # double zero that neither has alone. It is assigned to the ring.
            a1, a2, a3 = a[1], a[2], a[3]
            for ring, pole in ((1, i - 1), (end - 1, i + 1)):
                if j == ring and 0 <= pole < 4:
                    a1 += meridian.pieces[span, pole, 1]
                    a2 += meridian.pieces[span, pole, 2]
                    a3 += meridian.pieces[span, pole, 3]
            rise = (2.0 * a2 + u * 3.0 * a3 if polar else a1 + u * (2.0 * a2 + u * 3.0 * a3)) / T
            if 1 < j < end - 1:
                level = (a[2] + u * a[3] if polar else B) / (T * T)
        at = 3 - i if flipped else i
        for c in range(3):
            functions[0, c, at] = across
            functions[1, c, at] = way * rate * B_u
            functions[2, c, at] = way * rate * across_u
            functions[3, c, at] = rate * rate * B_uu
        functions[0, 2, at], functions[1, 2, at] = level, way * rate * rise
        if not 1 < j < end - 1:
            functions[2, 2, at] = 0.0
    return count - 4 - span if flipped else span, S, way * rate * S_u
