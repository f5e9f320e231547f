"""Tubes as clamped cubic patches that CAD programs can read: the same piecewise polynomials, cut at knots."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline

from pneumorph.geometry import Basis
from pneumorph.geometry.tube.surface import TubeSurface

Array = NDArray[np.float64]

AROUND = 2
"""Patches around a tube. STEP readers lose the seam of a periodic face; two patches are the fewest without one."""

ALONG = 8
"""Largest number of knot spans of a patch along a tube. CAD programs compute volumes by quadrature with few points per
face: for deep bellows in one piece the error is 0.8 %, in pieces of eight spans less than 0.01 %."""

SAME = 1e-9
"""Difference of parameters up to which a place is at a knot."""


@dataclass(frozen=True, eq=False)
class Patch:
    """A part of a tube between knots.

    Attributes
    ----------
    poles : (n_q, n_r, 3) array
        Control points in mm of the clamped cubic surface, q first.
    q, r : (n,) arrays
        Its distinct knots: those of the tube, and where what is bonded to the tip begins. The first and last have
        multiplicity four, the others one.
    """

    poles: Array
    q: Array
    r: Array


def patches(surface: TubeSurface) -> list[list[Patch]]:
    """The patches of a tube, in rows from base to tip, each row in the order of q; no patch is bonded in part."""
    rows = -(-surface.basis_r.spans // ALONG)
    return [
        [Patch(poles, q, r) for q, poles in _pieces(surface.basis_q, np.moveaxis(row, 1, 0), AROUND)]
        for r, row in _pieces(surface.basis_r, surface.net, rows, surface.bonded)
    ]


def _pieces(basis: Basis, values: Array, number: int, also: float = 1.0) -> list[tuple[Array, Array]]:
    """Cut a spline at equally spaced knots, and at one more place, by knot insertion.

    The knots and clamped control values (n, ...) of each piece are returned.
    """
    curve = _unwrapped(basis, values)
    cuts = basis.breaks[np.linspace(0, basis.spans, number + 1).astype(int)]
    if np.abs(basis.breaks - also).min() > SAME:
        cuts = np.sort(np.append(cuts, also))
    else:
        cuts = np.union1d(cuts, basis.breaks[np.abs(basis.breaks - also).argmin()])
    pieces = []
    for start, stop in pairwise(cuts):
        within = basis.breaks[(basis.breaks > start) & (basis.breaks < stop)]
        knots, piece = np.concatenate([[start], within, [stop]]), curve
        for knot in knots[[0, -1]]:
            # With multiplicity equal to the degree the curve passes through a control point there.
            missing = basis.degree - int(np.count_nonzero(piece.t == knot))
            piece = piece.insert_knot(knot, missing) if missing > 0 else piece
        first = np.searchsorted(piece.t, knots[0], side="right") - basis.degree - 1
        pieces.append((knots, piece.c[first : first + len(knots) - 1 + basis.degree]))
    return pieces


def _unwrapped(basis: Basis, values: Array) -> BSpline:
    """The spline with these control values; a periodic one is continued beyond [0, 1] so that no cut is at its end."""
    if not basis.periodic:
        return BSpline(basis.knots, values, basis.degree)
    index = np.arange(-basis.count, 2 * basis.count)
    reach = np.arange(index[0] - 2, index[-1] + 3)
    knots = basis.breaks[reach % basis.count] + reach // basis.count
    return BSpline(knots, values[index % basis.count], basis.degree)
