"""Tangents that stay finite up to the poles.

At a pole the derivative r_q vanishes although the surface has a tangent plane there. Let S(r) be the circumference of
the starting capsule relative to τ_q. Since S has the same simple zero, U = r_q / S does not vanish, and all limited
quantities are written in U and r_r. The row of control points next to a pole has the pole's z (see `DesignSpace`), so
the tangent plane is horizontal, and the z of U, U_q and r_r has another factor S. It is divided out as well, with the
limits of the basis functions at the pole itself, because the coefficient L of the second fundamental form needs it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneumorph.geometry import TubeSurface

Floats = NDArray[np.float64]


class Frame(NamedTuple):
    """Functions of r by which tangents are computed from a net's columns; lengths in mm of the starting tube.

    Attributes
    ----------
    across, along, across_r, along_r : (3, rows, n_r) arrays
        For U, r_r, U_r and r_rr, one matrix per component. The z of U and of r_r is divided by S.
    shrink, slope : (rows, 1) arrays
        S and dS/dr; 1 and 0 without poles.
    """

    across: Floats
    along: Floats
    across_r: Floats
    along_r: Floats
    shrink: Floats
    slope: Floats


def frame(surface: TubeSurface, r: ArrayLike) -> Frame:
    """The frame at parameters r (rows,), which may include the poles."""
    r = np.atleast_1d(np.asarray(r, dtype=float))
    B, B_r, B_rr = (surface.basis_r.matrix(r, order) / surface.size[1] ** order for order in range(3))
    if surface.ends == "flat":
        one = np.ones((len(r), 1))
        across, along, along_r = (np.stack([part] * 3) for part in (B, B_r, B_rr))
        return Frame(across, along, along, along_r, one, 0.0 * one)

    S, S_r, S_rr = (part @ surface.parallels[:, None] for part in (B, B_r, B_rr))
    pole = (r[:, None] == 0.0) | (r[:, None] == 1.0)
    S = np.where(pole, 0.0, S)
    away, steep = np.where(pole, 1.0, S), np.where(pole, S_r, 1.0)

    def limit(regular: Floats, at_pole: Floats) -> Floats:
        return np.where(pole, at_pole, regular)

    across = limit(B / away, B_r / steep)
    across_r = limit((B_r - across * S_r) / away, 0.5 * (B_rr - across * S_rr) / steep)
    # The row of the pole itself does not depend on q.
    across[:, [0, -1]] = across_r[:, [0, -1]] = 0.0
    level, level_r = limit(B / away**2, 0.5 * B_rr / steep**2), across_r.copy()
    level[:, [0, 1, -2, -1]] = level_r[:, [0, 1, -2, -1]] = 0.0
    rise = limit(B_r / away, B_rr / steep)
    # Pole and ring (the row next to it) have the same z, so the sum of their functions counts, which has a double zero
    # that neither has alone. It is assigned to the ring, whose function is nonzero on the second span too.
    for end, ring in ((0, 1), (-1, -2)):
        together = B_r[:, [end]] + B_r[:, [ring]]
        rise[:, [ring]] = limit(together / away, (B_rr[:, [end]] + B_rr[:, [ring]]) / steep)
        rise[:, end] = 0.0
    return Frame(
        across=np.stack([across, across, level]),
        along=np.stack([B_r, B_r, rise]),
        across_r=np.stack([across_r, across_r, level_r]),
        along_r=np.stack([B_rr, B_rr, B_rr]),
        shrink=S,
        slope=S_r,
    )
