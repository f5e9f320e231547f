"""Rows of limits on how far points are beyond a region."""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np

from pneumorph.limits.rows.sampled import Floats, Placed, RowBlock, SampledBody


class Outward(Protocol):
    """Where its boundary is, see `geometry.regions.Region`."""

    def beyond(self, x: Any) -> Any: ...
    def outward(self, x: Any) -> Any: ...


def rows_beyond(at: SampledBody, points: Placed, region: Outward, clearance: Floats | float, scale: float) -> RowBlock:
    """Rows of how far points are beyond a region, and of the clearance that they must keep from its boundary.

    Parameters
    ----------
    at : SampledBody
    points : Placed
        m of them.
    region : Outward
    clearance : (m,) array or float
        mm.
    scale : float
        What distances are divided by, mm.
    """
    numbers, weights = at.sums(points)
    x = np.einsum("mk,mkc->mc", weights, at.body.control_points()[numbers])
    slope = region.outward(x) / scale
    # Coordinates along which the region has no boundary are left out.
    some = np.flatnonzero(slope.any(axis=0))
    wide = numbers.shape[1] * len(some)
    return RowBlock(
        np.zeros(len(x), dtype=np.int64),
        points.cell,
        (region.beyond(x) + clearance) / scale,
        (3 * numbers[..., None] + some).reshape(len(x), wide),
        (weights[..., None] * slope[:, None, some]).reshape(len(x), wide),
    )
