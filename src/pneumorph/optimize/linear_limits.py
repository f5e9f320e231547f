"""Linearised limits in terms of the design variables, with the margin that accepted designs keep."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pneumorph.geometry.design_space import DesignSpace
from pneumorph.limits.certify.places import Places, Points
from pneumorph.limits.linearised import Rows
from pneumorph.limits.of_shape import ShapeLimits
from pneumorph.limits.table import BY_NAME, ROWS

MARGIN = np.array([BY_NAME[name].aim for name in ROWS])
"""How far within their bounds limits are brought, by kind. Programs keep the same margin: repairing one that they had
left out would cost half of their gain."""


@dataclass(frozen=True, eq=False)
class LinearLimits:
    """c + J dΦ ≤ 0 near a design: the rows, and J (m, n) by the design variables; pressures have no derivatives.

    Rows that the variables hardly change are left out, such as those of faces that stay at the side of the envelope:
    no motion brings them within their margins. Whether such a limit is satisfied is decided by certificates alone.
    """

    rows: Rows
    jacobian: sparse.csr_array

    def moved(self, change: np.ndarray) -> LinearLimits:
        """As they are expected to be after a change (n,) of the variables."""
        value = self.rows.value + self.jacobian @ change
        return LinearLimits(self.rows._replace(value=value), self.jacobian)

    def with_others(self, others: LinearLimits) -> LinearLimits:
        """Together with other limits on the same variables."""
        pairs = {
            name: np.concatenate([getattr(self.rows, name), getattr(others.rows, name)])
            for name in ("kind", "cell", "value")
        }
        stacked = sparse.csr_array(sparse.vstack([self.rows.jacobian, others.rows.jacobian]))
        rows = Rows(**pairs, jacobian=stacked, places={**self.rows.places, **others.rows.places})
        return LinearLimits(rows, sparse.csr_array(sparse.vstack([self.jacobian, others.jacobian])))

    def excess(self, margins: np.ndarray = MARGIN) -> np.ndarray:
        """c (m,) with the margins (kinds,) that are to be kept."""
        return self.rows.value + margins[self.rows.kind]


def linear_limits(
    space: DesignSpace,
    limits: ShapeLimits,
    phi: np.ndarray,
    reach: float,
    least: float,
    places: Mapping[str, Points] | None = None,
    violated: Places | None = None,
) -> LinearLimits:
    """The limits linearised at the variables Φ (n,); see `limits.linearised` for the other parameters.

    Parameters
    ----------
    space : DesignSpace
    limits : ShapeLimits
    phi : (n,) array
        mm.
    reach : float
        Distances within their bounds by up to this much get rows, mm.
    least, places, violated
        See `limits.linearised`.
    """
    rows = limits.rows(space.body(phi), reach, least, places, violated)
    by_shape = sparse.csr_array(rows.jacobian @ space.L)
    # Others change by less than their margin where all variables change by 1 mm.
    some = np.flatnonzero(abs(by_shape).sum(axis=1) > MARGIN[rows.kind])
    rows = rows._replace(**{name: getattr(rows, name)[some] for name in ("kind", "cell", "value", "jacobian")})
    by_shape = by_shape[some]
    # Products with a matrix take a fifth less time with short indices.
    parts = by_shape.data, by_shape.indices.astype(np.int32), by_shape.indptr.astype(np.int32)
    return LinearLimits(rows, sparse.csr_array(parts, shape=(len(rows.value), space.n)))
