"""Averages along and around the control net of a tube."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from pneumorph.geometry.surface import Map

Array = NDArray[np.float64]

_SAME = 1e-12
"""To which images move as their symmetry says, relative to the motion."""


@dataclass(frozen=True, eq=False)
class NetAverage:
    """Averages over the rows (n_r, n_r) and the columns (n_q, n_q) of a control net."""

    along: Array
    around: Array

    def within(self, L: sparse.csr_array) -> tuple[sparse.csr_array, Map]:
        """See `Average`: nets are averaged as matrices, of whose columns those suffice that are no images of others."""
        rows, columns = len(self.along), len(self.around)
        # The coordinates of each row one after the other: x of all its points, then y, then z.
        order = np.arange(3 * rows * columns).reshape(rows, columns, 3).transpose(0, 2, 1).ravel()
        whole = sparse.csr_array(L[order])
        found = _images(whole, rows)
        if found is None:
            return whole, lambda coordinates: self._apply(coordinates, self.around)
        own, images = found
        around = images.T @ np.kron(np.eye(3), self.around) @ images
        picked = (np.arange(rows)[:, None] * 3 * columns + own).ravel()
        return whole[picked], lambda coordinates: self._apply(coordinates, around)

    def _apply(self, coordinates: Array, around: Array) -> Array:
        """Averages of rows of coordinates, of which every `len(around)` are averaged by themselves."""
        half = self.along @ coordinates.reshape(len(self.along), -1)
        return (half.reshape(-1, len(around)) @ around).ravel()


def _images(whole: sparse.csr_array, rows: int) -> tuple[NDArray[np.int64], Array] | None:
    """Coordinates `own` (k,) in a row of a net of which all others in every row are combinations, by a matrix (w, k).

    None where there are no such. `whole` (rows·w, n) is the motion of all of them by the variables.
    """
    width = (len(whole.indptr) - 1) // rows
    # No row that a half-turn maps to itself, as it does the middle one, nor one near an end.
    chosen = rows // 3
    part = sparse.csc_array(whole[chosen * width : (chosen + 1) * width])
    images = part[:, np.flatnonzero(np.diff(part.indptr))].toarray()
    # A variable's own coordinate is one that no other variable moves.
    alone = (images != 0.0) & (np.count_nonzero(images, axis=1) == 1)[:, None]
    if images.shape[1] == width or not alone.any(axis=0).all():
        return None
    own = alone.argmax(axis=0)
    images = images / images[own, np.arange(len(own))]
    picked = (np.arange(rows)[:, None] * width + own).ravel()
    differs = abs(sparse.kron(sparse.eye_array(rows), images) @ whole[picked] - whole).max() > _SAME
    return None if differs else (own, images)


def net_average(rows: int, columns: int, strength: float) -> NetAverage:
    """(I + α DᵀD)^(−1/2) along each direction of a net, which is closed around; `strength` is α."""
    return NetAverage(_average(rows, False, strength), _average(columns, True, strength))


def _average(count: int, periodic: bool, strength: float) -> Array:
    difference = np.diff(np.eye(count), axis=0)
    if periodic:
        closing = np.zeros(count)
        closing[[0, -1]] = 1.0, -1.0
        difference = np.vstack([difference, closing])
    values, vectors = linalg.eigh(np.eye(count) + strength * difference.T @ difference)
    return (vectors / np.sqrt(values)) @ vectors.T
