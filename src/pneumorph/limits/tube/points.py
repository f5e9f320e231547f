"""Points of tubes and their end discs as sums of control points."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.tube.local import point_weights
from pneumorph.limits.rows.sampled import Sums

Floats = NDArray[np.float64]


def point_sums(body: Body, number: int, q: Floats, r: Floats, s: Floats | None = None) -> Sums:
    """Points (q, r), (m,) each; with s for (1 - s)·centre + s·point, where the centre is the mean of the end row.

    Parameters
    ----------
    body : Body
    number : int
        Index of the surface.
    q, r : (m,) arrays
    s : (m,) array, optional
    """
    surface, first = body.surfaces[number], body.slices[number].start
    numbers, weights = point_weights(surface, q, r)
    if s is None:
        return Sums(first + numbers, weights)
    rows, columns = surface.net.shape[:2]
    end_row = np.where(r > 0.5, rows - 1, 0)[:, None] * columns + np.arange(columns)
    centre = np.repeat((1.0 - s)[:, None] / columns, columns, axis=1)
    return Sums(
        first + np.concatenate([numbers, end_row], axis=1), np.concatenate([s[:, None] * weights, centre], axis=1)
    )


def on_tube(q: Floats, r: Floats) -> Floats:
    """Points (q, r) on the tube itself as `places.Points` has them, (m, 3)."""
    return np.stack([q, r, np.ones(len(q))], axis=1)


def sums_at(body: Body, number: int, at: Floats) -> Sums:
    """The same for points (m, 3) given by q, r and s, of which few are on end discs."""
    q, r, s = at.T
    return point_sums(body, number, q, r, None if (s == 1.0).all() else s)


def positions_at(body: Body, number: int, at: Floats) -> Floats:
    """Positions (m, 3) in mm of points given by q, r and s."""
    sums = sums_at(body, number, at)
    return np.einsum("mk,mkc->mc", sums.weight, body.control_points()[sums.number])
