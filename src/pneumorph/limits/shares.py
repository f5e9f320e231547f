"""How much of the nearest limit every point of a body uses: what the optimiser sees at samples, as shares of limits."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d

from pneumorph.geometry import Body
from pneumorph.limits.table import KINDS, OF_SHAPE
from pneumorph.limits.tube.rows.samples import COARSE, FINE, LimitSamples, SampledBody

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

PER_SPAN = (2, 2)
"""Points per knot span in q and r at which shares are given; each has the largest share around it."""

NAMES = tuple(limit.name for limit in OF_SHAPE)


class Usage(NamedTuple):
    """Of a surface, at equal steps of r (rows, both ends included) and of q (columns, q = 1 left out).

    Attributes
    ----------
    share : (rows, columns) array
        Share of the nearest limit that is used: 1 at the limit, more where it is violated.
    limit : (rows, columns) array
        Index in `NAMES` of that limit.
    """

    share: Floats
    limit: Ints


def usage(limits: LimitSamples, body: Body) -> list[Usage]:
    """The share of the nearest limit used everywhere on each surface of a body, the exterior first."""
    at, found = SampledBody(limits, body), []
    for number, (fine, coarse) in enumerate(zip(limits.fine, limits.coarse, strict=True)):
        shares = np.zeros((len(NAMES), *_pooled(np.zeros(coarse.shape), COARSE).shape))
        for kind in KINDS:
            for name, used in kind.shares(at, number):
                shares[NAMES.index(name)] = _pooled(used, FINE if used.shape == fine.shape else COARSE)
        found.append(Usage(shares.max(axis=0), shares.argmax(axis=0)))
    return found


def _pooled(values: Floats, per_span: tuple[int, int]) -> Floats:
    """The largest of samples around each point that `PER_SPAN` says."""
    across, along = (fine // coarse for fine, coarse in zip(per_span, PER_SPAN, strict=True))
    rows = maximum_filter1d(values, 2 * (along // 2) + 1, axis=0, mode="nearest")[::along]
    return maximum_filter1d(rows, 2 * (across // 2) + 1, axis=1, mode="wrap")[:, ::across]
