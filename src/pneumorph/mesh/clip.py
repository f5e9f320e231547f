"""Parts of the unit triangle where linear functions are positive."""

from __future__ import annotations

import numpy as np

_CORNERS = np.array([[0.0, 0.0], [1.0, 0.0], [0.0, 1.0]])
_SMALLEST = 1e-9  # of the area of a face; smaller parts are left out


def clipped(within: np.ndarray) -> np.ndarray:
    """The part (n, 2) of the unit triangle where linear functions are positive, by their values (k, 3) at its corners.

    By Sutherland & Hodgman (1974), Commun. ACM 17(1) 32–42.
    """
    polygon = _CORNERS
    for at_corners in within:
        if at_corners.min() >= 0.0:
            continue
        value = at_corners[0] + polygon @ (at_corners[1:] - at_corners[0])
        kept = list[np.ndarray]()
        for k in range(len(polygon)):
            here, there, a, b = polygon[k - 1], polygon[k], value[k - 1], value[k]
            if (a < 0.0) != (b < 0.0):
                kept.append(here + (there - here) * a / (a - b))
            if b >= 0.0:
                kept.append(there)
        polygon = np.array(kept).reshape(-1, 2)
        if len(polygon) < 3:
            return np.zeros((0, 2))
    return polygon


def triangles_of(polygon: np.ndarray) -> list[np.ndarray]:
    """A convex polygon (n, 2) as triangles (3, 2), without those that have no area."""
    fan = [polygon[[0, k, k + 1]] for k in range(1, len(polygon) - 1)]
    return [part for part in fan if abs(np.linalg.det(part[1:] - part[0])) > _SMALLEST]
