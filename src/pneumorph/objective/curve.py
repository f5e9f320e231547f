"""Target curves: a clamped B-spline, and the orientations of sections that follow it without twist."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
from scipy.interpolate import BSpline

SAMPLES = 4000
"""Points along the curve; directions between them are off by the square of their distance."""

SHARPEST = -0.9998
"""Cosine of the sharpest corner, 179°: that of a half turn has no axis."""


def section_targets(control_points: np.ndarray, degree: int, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Where sections at these fractions (S,) of a curve's length should be, and how they should have turned.

    Parameters
    ----------
    control_points : (n, 3) array
        In mm, of the clamped B-spline of the given degree.

    Returns
    -------
    position : (S, 3) array
        From the curve's beginning, mm.
    rotation : (S, 3, 3) array
        From the z axis to the curve's direction, carried along it by the smallest turns (parallel transport).

    Raises
    ------
    ValueError
        Where the curve has no direction, or turns right round.
    """
    points = np.asarray(control_points, float)
    inner = np.linspace(0.0, 1.0, len(points) - degree + 1)
    curve = BSpline(np.r_[[0.0] * degree, inner, [1.0] * degree], points, degree)
    t = np.linspace(0.0, 1.0, SAMPLES + 1)
    length = np.r_[0.0, np.cumsum(np.linalg.norm(np.diff(curve(t), axis=0), axis=1))]
    at = np.interp(np.asarray(fractions) * length[-1], length, t)
    along = np.union1d(t, at)
    tangent = curve(along, 1)
    speed = np.linalg.norm(tangent, axis=1, keepdims=True)
    if speed.min() < 1e-9 * speed.max():
        raise ValueError("the curve stops on its way, where control points are in one place; part them")
    tangent /= speed
    if np.sum(tangent[:-1] * tangent[1:], axis=1).min() < SHARPEST:
        raise ValueError("the curve turns back on itself at a point; lead it round")
    frames = [smallest_turn(np.array([0.0, 0.0, 1.0]), tangent[0])]
    for before, after in pairwise(tangent):
        frames.append(smallest_turn(before, after) @ frames[-1])
    return curve(at) - curve(0.0), np.array(frames)[np.searchsorted(along, at)]


def smallest_turn(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) by the smallest angle that carries the unit vector a to b; they are not opposite."""
    x, y, z = np.cross(a, b)
    hat = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + hat + hat @ hat / (1.0 + a @ b)
