"""Target curves: a clamped B-spline, and orientations of sections that follow it without twist."""

from __future__ import annotations

from itertools import accumulate

import numpy as np
from scipy.interpolate import BSpline

SAMPLES = 4000
"""Points along the curve; the error of directions between them is of second order in their distance."""

SHARPEST = -0.9998
"""Cosine of the sharpest allowed corner, 179°: at 180° the axis of the turn is undefined."""


def section_targets(control_points: np.ndarray, degree: int, fractions: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Target positions and rotations of sections at the given fractions (S,) of a curve's length.

    Parameters
    ----------
    control_points : (n, 3) array
        Control points in mm of the clamped B-spline of the given degree.

    Returns
    -------
    position : (S, 3) array
        Relative to the start of the curve, mm.
    rotation : (S, 3, 3) array
        From the z axis to the direction of the curve, continued along it by parallel transport.

    Raises
    ------
    ValueError
        If the curve has no direction at some point, or reverses its direction.
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
        raise ValueError("the curve has no direction where control points coincide; move one of them")
    tangent /= speed
    if np.sum(tangent[:-1] * tangent[1:], axis=1).min() < SHARPEST:
        raise ValueError("the curve reverses its direction at a point; give it a bend there")
    turns = smallest_turns(np.concatenate([[[0.0, 0.0, 1.0]], tangent[:-1]]), tangent)
    frames = np.array(list(accumulate(turns, lambda frame, turn: turn @ frame)))
    return curve(at) - curve(0.0), frames[np.searchsorted(along, at)]


def smallest_turns(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotations (m, 3, 3) by the smallest angles that take unit vectors a to b (m, 3), none to its opposite."""
    hat = np.cross(np.eye(3), np.cross(a, b)[:, None])
    return np.eye(3) + hat + hat @ hat / (1.0 + np.sum(a * b, axis=1))[:, None, None]
