"""Averages along and around the control net of a tube."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import linalg

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class NetAverage:
    """Averages over the rows (n_r, n_r) and the columns (n_q, n_q) of a control net.

    It takes the coordinates of each row one after the other, so that nets are averaged as matrices.
    """

    along: Array
    around: Array

    @property
    def order(self) -> NDArray[np.int64]:
        rows, columns = len(self.along), len(self.around)
        return np.arange(3 * rows * columns).reshape(rows, columns, 3).transpose(0, 2, 1).ravel()

    def apply(self, coordinates: Array) -> Array:
        half = self.along @ coordinates.reshape(len(self.along), -1)
        return (half.reshape(-1, len(self.around)) @ self.around).ravel()


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
