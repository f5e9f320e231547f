"""A rotation by a rotation vector with its first and second derivatives, in closed form.

jax, by which `plate.rotation` could be differentiated, needs longer to load these derivatives than all of them take in
a run.
"""

from __future__ import annotations

import math

import numpy as np

_ONE = np.eye(3)
_ABOUT = np.array([[np.cross(axis, column) for column in _ONE] for axis in _ONE]).transpose(2, 1, 0)
"""θ̂ = _ABOUT θ."""
_PAIRS = np.einsum("ik,jl->ijkl", _ONE, _ONE)
_SQUARES = _PAIRS + _PAIRS.swapaxes(2, 3) - 2.0 * np.einsum("ij,kl->ijkl", _ONE, _ONE)
"""θθᵀ − t² I = ½ θ · _SQUARES θ, with t the length of θ."""

_TERMS = np.arange(12)
_SERIES = np.array([[(-1.0) ** n / math.factorial(2 * n + k) for n in _TERMS] for k in (1, 2)])
"""Coefficients of sin t/t and (1 − cos t)/t² in powers of t²."""


def turns(theta: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """R − I of a rotation vector (3,) in rad, and its first and second derivatives by it, whose axes come last."""
    around, square = _ABOUT @ theta, float(theta @ theta)
    parts = (
        (around, _ABOUT, np.zeros((3, 3, 3, 3))),
        (np.outer(theta, theta) - square * _ONE, _SQUARES @ theta, _SQUARES),
    )
    turn, first, second = np.zeros((3, 3)), np.zeros((3, 3, 3)), np.zeros((3, 3, 3, 3))
    for (factor, slope, bend), (M, M_k, M_kl) in zip(_factors(square), parts, strict=True):
        mixed = M_k[..., None] * theta
        turn += factor * M
        first += factor * M_k + slope * M[..., None] * theta
        second += factor * M_kl + slope * (mixed + mixed.swapaxes(2, 3))
        second += M[..., None, None] * (slope * _ONE + bend * np.outer(theta, theta))
    return turn, first, second


def _factors(square: float) -> np.ndarray:
    """sin t/t and (1 − cos t)/t², each with its first two derivatives by (1/t) d/dt, at t²: (2, 3)."""
    if square < 1.0:
        # The differences below cancel near 0; the series are exact to 1e-17.
        orders = np.stack([np.ones(len(_TERMS)), 2.0 * _TERMS, 4.0 * _TERMS * (_TERMS - 1)])
        return _SERIES @ (orders * square ** np.maximum(_TERMS - np.arange(3)[:, None], 0)).T
    if not math.isfinite(square):
        return np.full((2, 3), np.nan)
    angle = math.sqrt(square)
    sine, cosine = math.sin(angle) / angle, (1.0 - math.cos(angle)) / square
    by_sine, by_cosine = (math.cos(angle) - sine) / square, (sine - 2.0 * cosine) / square
    return np.array(
        [
            [sine, by_sine, -(sine + 3.0 * by_sine) / square],
            [cosine, by_cosine, (by_sine - 4.0 * by_cosine) / square],
        ]
    )
