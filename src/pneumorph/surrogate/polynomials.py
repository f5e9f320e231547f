"""Chebyshev polynomials of several variables, fitted by least squares to values and derivatives (Hermite data).

Which polynomials are used, of total degree or of a hyperbolic cross (Temlyakov 1993), is decided by cross-validation.
With x = cos θ, the derivative of T_n by θ has the size n. So derivatives by x have the weight sin θ/d beside values, d
being the highest degree, and at least 1/d².
"""

from __future__ import annotations

from collections.abc import Iterator
from math import comb

import numpy as np

FOLDS = 5
"""Parts of the samples, each predicted from the others in turn."""

PLENTY = 1.3
"""Equations for every coefficient at least."""

HIGHEST = 12


def families(variables: int, most: float = np.inf) -> Iterator[np.ndarray]:
    """Sets of at most so many polynomials: the degrees (t, C) of each in the variables, from few to many."""
    for degree in range(1, HIGHEST + 1):
        if comb(variables + degree, degree) <= most:
            yield np.array(list(_below(variables, degree)))
        if variables > 2 and degree > 2:
            cross = np.array(list(_crossed(variables, degree + 1)))
            if len(cross) > most:
                return
            yield cross


def _below(variables: int, degree: int) -> Iterator[tuple[int, ...]]:
    """Degrees whose sum is no larger."""
    if variables == 0:
        yield ()
        return
    for first in range(degree + 1):
        for rest in _below(variables - 1, degree - first):
            yield (first, *rest)


def _crossed(variables: int, size: int) -> Iterator[tuple[int, ...]]:
    """Degrees for which the product of all of them, each plus one, is no larger."""
    if variables == 0:
        yield ()
        return
    for first in range(size):
        for rest in _crossed(variables - 1, size // (first + 1)):
            yield (first, *rest)


def values_of(x: np.ndarray, index: np.ndarray) -> np.ndarray:
    """The polynomials (n, t) at points x (n, C) in [-1, 1]."""
    return _table(x, index)[..., index, np.arange(x.shape[1])].prod(axis=-1)


def slopes_of(x: np.ndarray, index: np.ndarray) -> np.ndarray:
    """Their derivatives (n, C, t) by x."""
    n, variables = x.shape
    values, found = _table(x, index), np.zeros((n, variables, len(index)))
    # T_n' = n U_{n-1}, by U_k = 2x U_{k-1} − U_{k-2}.
    slope = np.zeros_like(values)
    second = [np.ones_like(x), 2 * x]
    for k in range(1, values.shape[1]):
        slope[:, k] = k * second[0]
        second = [second[1], 2 * x * second[1] - second[0]]
    columns = np.arange(variables)
    for c in columns:
        factors = values[:, index, columns]
        factors[..., c] = slope[:, index[:, c], c]
        found[:, c] = factors.prod(axis=-1)
    return found


def _table(x: np.ndarray, index: np.ndarray) -> np.ndarray:
    """T_k (n, d + 1, C)."""
    return np.cos(np.arange(index.max() + 1)[:, None] * np.arccos(np.clip(x, -1.0, 1.0))[:, None])


def fitted(x: np.ndarray, values: np.ndarray, slopes: np.ndarray | None, index: np.ndarray) -> np.ndarray:
    """Coefficients (t, m) of the polynomials that fit values and slopes best.

    Parameters
    ----------
    x : (n, C)
        Points in [-1, 1].
    values : (n, m)
    slopes : (n, C, m) or None
        Derivatives by x, if known.
    index : (t, C)
        The polynomials.
    """
    matrix, rhs = values_of(x, index), values
    if slopes is not None:
        degree = max(int(index.max()), 1)
        weight = np.maximum(np.sqrt(np.clip(1 - x**2, 0.0, 1.0)), 1.0 / degree) / degree
        matrix = np.vstack([matrix, (weight[..., None] * slopes_of(x, index)).reshape(-1, len(index))])
        rhs = np.vstack([rhs, (weight[..., None] * slopes).reshape(-1, values.shape[1])])
    return np.linalg.lstsq(matrix, rhs, rcond=1e-12)[0]


def chosen(x: np.ndarray, values: np.ndarray, slopes: np.ndarray | None) -> np.ndarray:
    """The set of polynomials that predicts left-out values best; the values are scaled so that all count alike.

    Parameters
    ----------
    x, values, slopes
        As for `fitted`.
    """
    count, variables = x.shape
    per_sample = 1 if slopes is None else 1 + variables
    fold = np.random.default_rng(0).permutation(count) % FOLDS
    best, least = next(families(variables)), np.inf
    known = per_sample * int(np.min([np.sum(fold != k) for k in range(FOLDS)]))
    for index in families(variables, known / PLENTY):
        worst = 0.0
        for k in range(min(FOLDS, count)):
            own, rest = fold == k, fold != k
            found = fitted(x[rest], values[rest], None if slopes is None else slopes[rest], index)
            worst += float(np.sum((values_of(x[own], index) @ found - values[own]) ** 2))
        if worst < least:
            best, least = index, worst
    return best
