"""Uniform B-spline bases on [0, 1] (Appendix A of the paper): periodic around a tube, clamped along it."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.interpolate import BSpline

CUBIC = 3
"""The degree of all bases; only their derivatives have lower ones."""


@dataclass(frozen=True)
class Basis:
    """The B-spline functions of one parameter direction.

    Attributes
    ----------
    degree : int
        Polynomial degree, 3 throughout this package.
    count : int
        Number of basis functions, which is the number of control points in this direction.
    periodic : bool
        Whether the functions wrap around.
    clamped : bool
        Whether the ends are clamped, for functions that do not wrap around; else the knots continue beyond them.
    """

    degree: int
    count: int
    periodic: bool
    clamped: bool = True

    @property
    def spans(self) -> int:
        """Number of knot spans in [0, 1]."""
        return self.count if self.periodic else self.count - self.degree

    @cached_property
    def breaks(self) -> NDArray[np.float64]:
        """The distinct knots in [0, 1], both ends included; shape (spans + 1,)."""
        return np.linspace(0.0, 1.0, self.spans + 1)

    @cached_property
    def knots(self) -> NDArray[np.float64]:
        """The full knot vector: repeated at clamped ends, else continued beyond [0, 1]."""
        if self.periodic or not self.clamped:
            return np.arange(-self.degree, self.spans + self.degree + 1) / self.spans
        return np.concatenate([np.zeros(self.degree), self.breaks, np.ones(self.degree)])

    @cached_property
    def greville(self) -> NDArray[np.float64]:
        """The parameter of each control point (Greville abscissa); as control values they give t, unless periodic."""
        if self.periodic:
            return np.arange(self.count) / self.count
        windows = np.lib.stride_tricks.sliding_window_view(self.knots[1:-1], self.degree)
        return windows.mean(axis=1)

    @cached_property
    def _functions(self) -> BSpline:
        if not self.periodic:
            return BSpline(self.knots, np.eye(self.count), self.degree)
        # Number 0 is the function that peaks at t = 0, so that control point i belongs to t = i / count.
        unwrapped = np.arange(self.count + self.degree)
        wrap = np.zeros((self.count + self.degree, self.count))
        wrap[unwrapped, (unwrapped - self.degree // 2) % self.count] = 1.0
        return BSpline(self.knots, wrap, self.degree)

    def matrix(self, t: ArrayLike, derivative: int = 0) -> NDArray[np.float64]:
        """Values of every basis function, or of its derivative, at the parameters t.

        Parameters
        ----------
        t : (n,) array
            Parameters: any real numbers when periodic, otherwise within [0, 1].
        derivative : int
            Order of the derivative with respect to t.

        Returns
        -------
        (n, count) array

        Raises
        ------
        ValueError
            If a parameter of a clamped basis lies outside [0, 1] by more than rounding.
        """
        t = np.atleast_1d(np.asarray(t, dtype=float))
        if self.periodic:
            t = t % 1.0
        elif t.size and (t.min() < -1e-9 or t.max() > 1.0 + 1e-9):
            raise ValueError(f"parameters of a clamped basis lie in [0, 1]; got {t.min():g} to {t.max():g}")
        else:
            t = np.clip(t, 0.0, 1.0)
        return self._functions(t, nu=derivative)


def periodic(count: int) -> Basis:
    """A periodic cubic basis of `count` functions; control point i belongs to t = i / count.

    Raises
    ------
    ValueError
        If there are no more than three.
    """
    if count <= CUBIC:
        raise ValueError(f"a periodic cubic basis needs at least four functions; got {count}")
    return Basis(CUBIC, count, periodic=True)


def uniform(spans: int) -> Basis:
    """A cubic basis on `spans` equal knot spans of which all functions are alike; some reach beyond [0, 1].

    Raises
    ------
    ValueError
        If there is no knot span.
    """
    return replace(clamped(spans), clamped=False)


def clamped(spans: int) -> Basis:
    """A cubic basis on `spans` equal knot spans; the first and last control points are the ends of the curve.

    Raises
    ------
    ValueError
        If there is no knot span.
    """
    if spans < 1:
        raise ValueError(f"a clamped basis needs at least one knot span; got {spans}")
    return Basis(CUBIC, spans + CUBIC, periodic=False)
