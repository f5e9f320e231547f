"""Tangents that stay finite up to the poles.

Around a pole the derivative r_q vanishes although the surface has a tangent plane there. With S(r), the starting
capsule's circumference relative to τ_q, the vector U = r_q / S does not, and nor does any limited quantity written in
U and r_r: S has the same simple zero. The ring beside a pole shares the pole's z (see `DesignSpace`), so the tangent
plane is horizontal, and the z of U, of U_q and of r_r has a factor S once more. It is divided out here too, by the
limits of the basis functions on the pole itself, since the second fundamental form's L asks for it.
"""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneumorph.geometry import TubeSurface

Floats = NDArray[np.float64]


class Frame(NamedTuple):
    """Functions of r that turn a net's columns into tangents; lengths in mm of the starting tube.

    Attributes
    ----------
    across, along, across_r, along_r : (3, rows, n_r) arrays
        Of U, r_r, U_r and r_rr, a matrix to each component. The z of U and of r_r is divided by S.
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
    """The functions at parameters r (rows,), poles included."""
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
    # The pole's own row does not depend on q.
    across[:, [0, -1]] = across_r[:, [0, -1]] = 0.0
    level, level_r = limit(B / away**2, 0.5 * B_rr / steep**2), across_r.copy()
    level[:, [0, 1, -2, -1]] = level_r[:, [0, 1, -2, -1]] = 0.0
    rise = limit(B_r / away, B_rr / steep)
    # Pole and ring share their z, so their functions act as one, which has the double zero that each of them lacks. It
    # is the ring's, which is alive on the second span too.
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
