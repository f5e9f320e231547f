"""Target curves: a clamped B-spline, and orientations of sections that follow it without twist."""

from __future__ import annotations

from itertools import pairwise

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
    frames = [smallest_turn(np.array([0.0, 0.0, 1.0]), tangent[0])]
    for before, after in pairwise(tangent):
        frames.append(smallest_turn(before, after) @ frames[-1])
    return curve(at) - curve(0.0), np.array(frames)[np.searchsorted(along, at)]


def smallest_turn(a: np.ndarray, b: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) by the smallest angle that takes the unit vector a to b, which must not be opposite."""
    x, y, z = np.cross(a, b)
    hat = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]])
    return np.eye(3) + hat + hat @ hat / (1.0 + a @ b)
