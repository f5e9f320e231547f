"""Periodic splines for the outlines of sections, nowhere bent more than these are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.bspline import Basis
from pneumorph.problem.outline import Outline

Array = NDArray[np.float64]

FITTED = 16
"""Samples per control point at which outlines are fitted, and curvature is measured."""

WEIGHTS = 10.0 ** np.arange(-1.0, 4.1, 0.5)
"""Of the squared excess of curvature, relative to the outline's, against the squared distance in mm: the last one
leaves an excess of about 0.01 %."""

ALLOWED = 1.03
"""Curvature relative to the outline's: splines with few control points are so much sharper in places than a circle."""

STEPS = 4
"""Gauss-Newton steps with each weight."""

HALVINGS = 8
"""Parts of a step that are tried: all of it, half of it, and so on."""


def fitted(outline: Outline, basis: Basis) -> Array:
    """Control points (n, 2) of the spline nearest to an outline of those that are bent no more than it is.

    The spline nearest to it overshoots where arcs go over into straight sides, by up to half of their curvature and
    more. From there the excess is penalised more and more; what this takes is about as small as the first deviation.
    """
    share = np.arange(FITTED * basis.count) / (FITTED * basis.count)
    values, first, second = (basis.matrix(share, order) for order in range(3))
    nearest = np.array(np.linalg.lstsq(values, outline.at(share), rcond=None)[0].T.ravel(), float)
    away = np.kron(np.eye(2), values.T @ values / len(share))
    most, points = ALLOWED * outline.curvature, nearest
    for pull in WEIGHTS * outline.length / len(share):

        def cost(at: Array, pull: float = pull) -> float:
            excess, _ = _excess(first, second, at, most)
            return float((at - nearest) @ away @ (at - nearest) + pull * excess @ excess)

        for _ in range(STEPS):
            excess, change = _excess(first, second, points, most)
            gradient = away @ (points - nearest) + pull * change.T @ excess
            step = np.linalg.solve(away + pull * change.T @ change, gradient)
            shares = (part for part in 0.5 ** np.arange(HALVINGS) if cost(points - part * step) < cost(points))
            points = np.array(points - next(shares, 0.0) * step, float)
    return points.reshape(2, -1).T


def _excess(first: Array, second: Array, points: Array, most: float) -> tuple[Array, Array]:
    """By how much the curvature is above the largest, relative to it, where it is (k,), and its derivatives (k, 2n).

    Parameters
    ----------
    first, second : (m, n) array
        Derivatives of the basis at samples.
    points : (2n,) array
        x of all control points, then y, mm.
    most : float
        1/mm.
    """
    x, y = points.reshape(2, -1)
    along, bent = np.stack([first @ x, first @ y]), np.stack([second @ x, second @ y])
    speed = np.hypot(*along)
    signed = (along[0] * bent[1] - along[1] * bent[0]) / speed**3
    above = np.abs(signed) > most
    (u, v), (a, b), speed, signed = along[:, above], bent[:, above], speed[above], signed[above]
    cube, fall = speed**3, 3.0 * signed / speed**2
    by_x = (b / cube - fall * u)[:, None] * first[above] - (v / cube)[:, None] * second[above]
    by_y = (u / cube)[:, None] * second[above] - (a / cube + fall * v)[:, None] * first[above]
    change = np.sign(signed)[:, None] * np.hstack([by_x, by_y]) / most
    return np.abs(signed) / most - 1.0, change
