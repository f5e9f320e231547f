"""Cubic B-splines through curves and surfaces that are given as functions, refined where they are not near enough."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.interpolate import BSpline
from scipy.sparse.linalg import splu

Array = NDArray[np.float64]
Grid = Callable[..., tuple[Array, NDArray[np.bool_]]]
"""Of one or two axes (n,), (m,): points (n, m, 3) in mm, and where a spline has to be near them (n, m)."""

DEGREE = 3

MOST = 250
"""Most knot spans along an axis; what is not near enough then is told as a deviation."""

_PER_SPAN = 4
"""Points per knot span at which a spline is compared: its error between sites has at most one extremum on each side."""


@dataclass(frozen=True, eq=False)
class Spline:
    """A clamped cubic spline of one or two variables.

    Attributes
    ----------
    knots : sequence of (k,) float
        With multiplicities, along each axis.
    poles : (n, 3) or (n, m, 3) float
        Control points, mm.
    deviation : float
        Its largest distance from what it is to be at the points compared, mm.
    """

    knots: tuple[Array, ...]
    poles: Array
    deviation: float


def clamped(inner: Array) -> Array:
    """The knots of a cubic spline with these, from its start to its end."""
    return np.concatenate([[inner[0]] * DEGREE, inner, [inner[-1]] * DEGREE])


def fitted(value: Grid, starts: Sequence[Array], tolerance: float) -> Spline:
    """The spline that interpolates a function at the Greville abscissae, with as many knots as it needs.

    Parameters
    ----------
    value : function
    starts : sequence of (k,) array
        Knots along each axis to begin with, from start to end, both once; repeated where the function is less smooth.
    tolerance : float
        Distance from the function that is near enough, mm.
    """
    inner = [np.asarray(each, float) for each in starts]
    while True:
        knots = tuple(map(clamped, inner))
        sites = [_sites(each) for each in knots]
        poles = _through(value(*sites)[0], knots, sites)
        finer = []
        for axis, each in enumerate(inner):
            # Where the other axis has its sites, the error is that of this axis alone.
            at = [_between(one) if k == axis else sites[k] for k, one in enumerate(inner)]
            away = _away(value, poles, knots, at)
            worst = away.max(axis=tuple(k for k in range(len(inner)) if k != axis))
            span = np.repeat(np.arange(len(np.unique(each)) - 1), _PER_SPAN)
            wrong = np.unique(span[worst > tolerance / len(inner)])
            ends = np.unique(each)
            middles = (ends[wrong] + ends[wrong + 1]) / 2.0
            finer.append(np.sort(np.concatenate([each, middles if len(ends) + len(middles) <= MOST else []])))
        if all(len(new) == len(old) for new, old in zip(finer, inner, strict=True)):
            at = [_between(each) for each in inner]
            return Spline(knots, poles, float(_away(value, poles, knots, at).max()))
        inner = finer


def evaluated(poles: Array, knots: Sequence[Array], at: Sequence[Array]) -> Array:
    """A spline on the grid of places along its axes."""
    for axis, (each, places) in enumerate(zip(knots, at, strict=True)):
        along = BSpline.design_matrix(places, each, DEGREE)
        poles = _along(lambda columns, along=along: along @ columns, poles, axis)
    return poles


def _sites(knots: Array) -> Array:
    """The Greville abscissae."""
    sites = np.lib.stride_tricks.sliding_window_view(knots[1:-1], DEGREE).mean(axis=1)
    return np.clip(sites, knots[0], knots[-1])


def _between(inner: Array) -> Array:
    ends = np.unique(inner)
    shares = (np.arange(_PER_SPAN) + 0.5) / _PER_SPAN
    return (ends[:-1, None] + np.diff(ends)[:, None] * shares).ravel()


def _through(values: Array, knots: Sequence[Array], sites: Sequence[Array]) -> Array:
    for axis, (each, places) in enumerate(zip(knots, sites, strict=True)):
        solved = splu(BSpline.design_matrix(places, each, DEGREE).tocsc())
        values = _along(solved.solve, values, axis)
    return values


def _along(function: Callable[[Array], Array], values: Array, axis: int) -> Array:
    """A linear map of columns, applied along an axis."""
    moved = np.moveaxis(values, axis, 0)
    mapped = function(np.ascontiguousarray(moved.reshape(len(moved), -1)))
    return np.moveaxis(mapped.reshape(len(mapped), *moved.shape[1:]), 0, axis)


def _away(value: Grid, poles: Array, knots: Sequence[Array], at: Sequence[Array]) -> Array:
    wanted, matters = value(*at)
    return np.where(matters, np.linalg.norm(wanted - evaluated(poles, knots, at), axis=-1), 0.0)
