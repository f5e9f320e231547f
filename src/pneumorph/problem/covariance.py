"""The covariance of a material's constants: how well the tests to which they were fitted determine them.

It is that of relative errors, so that it stays the same where all moduli are scaled.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

ROUNDING = 1e-6
"""Part of the largest variance below which a negative one is a rounding error."""

DIGITS = 9
"""Written digits: constants that make up for one another have variances that are far larger than what they leave."""


def fault_of(rows: Sequence[Sequence[float]], names: Sequence[str]) -> str:
    """What is wrong with a covariance of constants with these names; empty if nothing is."""
    count = len(names)
    if len(rows) != count or any(len(row) != count for row in rows):
        return f"is not a matrix of {count} rows and columns, for {', '.join(names)}; write it as material fit does"
    matrix = np.array(rows)
    largest = float(np.abs(matrix).max())
    if not np.isfinite(largest) or np.abs(matrix - matrix.T).max() > ROUNDING * largest:
        return "is not a symmetric matrix of numbers; write it as material fit does"
    if np.linalg.eigvalsh(matrix)[0] < -ROUNDING * largest:
        return "has a negative variance, as no covariance has; write it as material fit does"
    return ""


def root_of(rows: Sequence[Sequence[float]]) -> np.ndarray:
    """Independent errors (r, c) of c constants, each of one standard deviation, that have a covariance."""
    variances, directions = np.linalg.eigh(np.array(rows))
    return (directions * np.sqrt(np.maximum(variances, 0.0))).T


def rows_of(matrix: np.ndarray) -> list[list[float]]:
    """A covariance as in a problem file."""
    return [[float(f"{value:.{DIGITS}g}") for value in row] for row in matrix]
