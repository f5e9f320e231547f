"""How much of the nearest limit every point of a body uses: what the optimiser sees at samples, as shares of limits."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumorph.limits.kinds.kind import Kind, Sampled
from pneumorph.limits.table import OF_SHAPE

NAMES = tuple(limit.name for limit in OF_SHAPE)


class Usage(NamedTuple):
    """Of a surface, at the points where it is drawn: (rows, columns) of a tube at equal steps of r, both ends included,
    and of q, where q = 1 is left out.

    Attributes
    ----------
    share : (...) array
        Share of the nearest limit that is used: 1 at the limit, more where it is violated.
    limit : (...) array
        Index in `NAMES` of that limit.
    """

    share: NDArray[np.float64]
    limit: NDArray[np.integer]


def usage(kinds: Sequence[Kind[Sampled, Any, Any]], at: Sampled) -> list[Usage]:
    """The share of the nearest limit used everywhere on each surface of a body, the exterior first."""
    usages = []
    for number in range(len(at.body.surfaces)):
        used = {name: at.pooled(number, share) for kind in kinds for name, share in kind.shares(at, number)}
        none = np.zeros_like(next(iter(used.values())))
        shares = np.stack([used.get(name, none) for name in NAMES])
        usages.append(Usage(shares.max(axis=0), shares.argmax(axis=0)))
    return usages
