"""Points of a surface as combinations of the sixteen control points on which they depend."""

from __future__ import annotations

from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike, NDArray

from pneumorph.geometry.bspline import Basis
from pneumorph.geometry.tube.surface import TubeSurface

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]


@lru_cache(maxsize=64)
def pieces(basis: Basis) -> Floats:
    """Coefficients (spans, 4, 4) of the four nonzero functions on each span, in powers of a parameter from 0 to 1."""
    places = np.array([0.05, 0.35, 0.65, 0.95])
    powers = np.linalg.inv(np.vander(places, 4, increasing=True))
    values = basis.matrix(((np.arange(basis.spans)[:, None] + places) / basis.spans).ravel())
    values = values.reshape(basis.spans, 4, basis.count)
    nonzero = np.take_along_axis(values, _nonzero(basis, np.arange(basis.spans))[:, None], axis=2)
    # Those of cubic functions on equal spans are multiples of 1/12, so rounding errors can be removed.
    coefficients = np.round(12.0 * np.einsum("kp,spi->sik", powers, nonzero)) / 12.0
    coefficients.setflags(write=False)
    return coefficients


def _nonzero(basis: Basis, span: Ints) -> Ints:
    """Indices (n, 4) of the functions that are nonzero on each span."""
    number = span[:, None] + np.arange(4)
    return (number - 1) % basis.count if basis.periodic else number


def nonzero_functions(basis: Basis, t: ArrayLike) -> tuple[Ints, Floats]:
    """The four basis functions nonzero at each parameter t (n,): indices and values, each (n, 4)."""
    t = np.asarray(t, dtype=float)
    t = t % 1.0 if basis.periodic else np.clip(t, 0.0, 1.0)
    span = np.minimum((t * basis.spans).astype(np.int64), basis.spans - 1)
    u = t * basis.spans - span
    powers = np.stack([u**k for k in range(4)], axis=1)
    return _nonzero(basis, span), np.einsum("nik,nk->ni", pieces(basis)[span], powers)


def point_weights(surface: TubeSurface, q: ArrayLike, r: ArrayLike) -> tuple[Ints, Floats]:
    """Indices (n, 16) of the control points in the net on which the points at (q, r) depend, and their weights."""
    (around, by_q), (along, by_r) = nonzero_functions(surface.basis_q, q), nonzero_functions(surface.basis_r, r)
    numbers = along[:, :, None] * surface.basis_q.count + around[:, None]
    return numbers.reshape(-1, 16), (by_r[:, :, None] * by_q[:, None]).reshape(-1, 16)
