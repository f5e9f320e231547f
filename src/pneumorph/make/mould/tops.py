"""High points of the rubber in the mould, where air is trapped unless a vent lets it out."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pneumorph.make.mould.samples import Samples

Array = NDArray[np.float64]

_HEIGHT = 0.3
"""Least height in mm of a high point above the pass to a higher one; less air dissolves, or leaves by tilting."""

_UP = 0.3
"""Least vertical component of the normal at a high point: the rubber is below its surface there."""


def tops(surface: Samples) -> Array:
    """The high points (n, 3) of the rubber below a tube: local maxima of the height of its samples.

    Samples are added from the highest down. A sample that joins two connected parts is the pass between them: the
    height of the lower part's top above its surroundings is that above this pass.
    """
    rows, columns = surface.x.shape[:2]
    height = surface.x[..., 2].ravel()
    parent = np.full(len(height), -1)
    top: dict[int, int] = {}
    candidates = []

    def root(i: int) -> int:
        while parent[i] != i:
            parent[i] = parent[parent[i]]
            i = int(parent[i])
        return i

    for i in np.argsort(-height, kind="stable").tolist():
        parent[i] = i
        top[i] = i
        row, column = divmod(i, columns)
        beside = [row * columns + (column + side) % columns for side in (-1, 1)]
        beside += [i - columns] if row else []
        beside += [i + columns] if row < rows - 1 else []
        for j in beside:
            if parent[j] < 0:
                continue
            one, other = root(i), root(j)
            if one == other:
                continue
            if height[top[one]] > height[top[other]]:
                one, other = other, one
            if height[top[one]] - height[i] >= _HEIGHT:
                candidates.append(top[one])
            parent[one] = other
    highest = top[root(0)]
    normal = surface.normal.reshape(-1, 3)
    kept = [i for i in candidates if i != highest and normal[i, 2] > _UP]
    return surface.points[kept].reshape(-1, 3)
