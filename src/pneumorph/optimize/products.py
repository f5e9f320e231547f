"""Products with the rows of limits, few of which have multipliers.

Most rows of a program are never reached, so most multipliers are zero: the transpose is applied row by row, without
those. A row without a multiplier is not looked at again before steps have moved so far that it might be exceeded.
"""

from __future__ import annotations

from typing import NamedTuple, Self, cast

import numba
import numpy as np
from scipy import sparse


class SparseRows(NamedTuple):
    """A matrix J (m, n) by rows: their first entries (m + 1,), and columns and values of all entries.

    Indices have no sign: with one, each is looked at whether it is negative, which takes as long as the product.
    """

    start: np.ndarray
    column: np.ndarray
    entry: np.ndarray
    width: int

    @classmethod
    def of(cls, matrix: sparse.csr_array) -> Self:
        """The rows of a matrix, as copies: SciPy may sort the entries of its own."""
        _, width = cast(tuple[int, int], matrix.shape)
        start, column = (index.astype(np.uint32) for index in (matrix.indptr, matrix.indices))
        return cls(start, column, matrix.data.astype(float), width)

    def moduli(self) -> Self:
        """|J|."""
        return self._replace(entry=np.abs(self.entry))

    def times(self, vector: np.ndarray) -> np.ndarray:
        """J x (m,)."""
        out = np.empty(len(self.start) - 1)
        _times(self.start, self.column, self.entry, vector, out)
        return out

    def transposed_times(self, multiplier: np.ndarray) -> np.ndarray:
        """Jᵀ λ (n,)."""
        out = np.zeros(self.width)
        _transposed_times(self.start, self.column, self.entry, multiplier, out)
        return out


@numba.njit(cache=True, nogil=True, fastmath=True)
def _times(start, column, entry, vector, out):
    for row in range(len(out)):
        total = 0.0
        for k in range(start[row], start[row + 1]):
            total += entry[k] * vector[column[k]]
        out[row] = total


@numba.njit(cache=True, nogil=True, fastmath=True)
def _transposed_times(start, column, entry, multiplier, out):
    for row in range(len(multiplier)):
        weight = multiplier[row]
        if weight != 0.0:
            for k in range(start[row], start[row + 1]):
                out[column[k]] += weight * entry[k]


@numba.njit(cache=True, nogil=True, fastmath=True)
def step_on(z, slope, fall, shrink, lower, upper, beyond, ahead):
    """Move variables z (n,) against their slope, in place; `ahead` (n,) becomes twice as far.

    Returns the farthest motion, and how far the farthest variable is from zero.
    """
    farthest, largest = 0.0, 0.0
    for i in range(len(z)):
        to = min(max(shrink[i] * (z[i] - fall[i] * slope[i]), lower[i]), upper[i])
        by = to - z[i]
        ahead[i] = to + by
        z[i] += beyond * by
        farthest, largest = max(farthest, abs(by)), max(largest, abs(to))
    return farthest, largest


@numba.njit(cache=True, nogil=True, fastmath=True)
def push_on(start, column, entry, known, point, limits, rise, bend, beyond, small, multiplier, farther, moved):
    """Change multipliers (m,) by the rows' values at a point (n,), in place. Whether one changes by more than `small`
    (m,) for it.

    The first `limits` rows are c + J x ≤ 0, whose multipliers are not negative; others are quadratic. `farther` (m, 2)
    has for each limit at which motion, summed over all iterations up to `moved`, it might be reached, and by how much
    its value changes with a motion by 1.
    """
    pushed = False
    for row in range(len(multiplier)):
        before = multiplier[row]
        if row < limits and before == 0.0 and moved < farther[row, 0]:
            continue
        value = known[row]
        for k in range(start[row], start[row + 1]):
            value += entry[k] * point[column[k]]
        aimed = before + rise * value
        if row < limits:
            aimed = max(aimed, 0.0)
            farther[row, 0] = moved - value / farther[row, 1]
            multiplier[row] = max(before + beyond * (aimed - before), 0.0)
        else:
            aimed *= bend[row - limits]
            multiplier[row] = before + beyond * (aimed - before)
        pushed = pushed or abs(aimed - before) > small[row]
    return pushed
