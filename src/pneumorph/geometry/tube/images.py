"""Images of control points under the symmetry of a body."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pneumorph.geometry.body import Body
from pneumorph.geometry.tube.surface import TubeSurface

_SAME = 1e-6  # mm; control points closer than this are considered identical


def images(body: Body[TubeSurface], operation: NDArray[np.float64], length: float) -> NDArray[np.int64]:
    """For each control point, the index (n_points,) of the one to which an operation about (0, 0, length/2) maps it.

    Raises
    ------
    ValueError
        If the body is not symmetric under the operation.
    """
    centre = np.array([0.0, 0.0, length / 2.0])
    moved = [(surface.net - centre) @ operation.T + centre for surface in body.surfaces]
    answer = np.empty(body.n_points, dtype=np.int64)
    for net, where in zip(moved, body.slices, strict=True):
        rows, columns = net.shape[:2]
        # One row is enough, and it is an inner one: at poles and end rows many control points may coincide.
        row = rows // 3
        there = rows - 1 - row if operation[2, 2] < 0 else row
        for other, start in zip(body.surfaces, (part.start for part in body.slices), strict=True):
            if other.net.shape != net.shape:
                continue
            distance, column = KDTree(other.net[there]).query(net[row])
            if distance.max() < _SAME and len(np.unique(column)) == columns:
                order = np.arange(rows)[:: -1 if operation[2, 2] < 0 else 1]
                answer[where] = (start + order[:, None] * columns + column).ravel()
                break
        else:
            raise ValueError("a surface of the body has no image under one of its symmetries")
    return answer
