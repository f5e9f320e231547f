"""The surfaces of a body as closed triangles, for designs whose mesh is not stored."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.output.view import Shell

DENSITY = 3
"""Points per control point, around and along."""


def shell_of(body: Body) -> Shell:
    """A body at rest as closed triangles, with normals out of the solid."""
    points, triangles, first = [], [], 0
    for surface in body.surfaces:
        own, corners = _closed(surface)
        points.append(own)
        triangles.append(first + corners)
        first += len(own)
    return Shell(np.concatenate(points), np.concatenate(triangles))


def _closed(surface: TubeSurface) -> tuple[np.ndarray, np.ndarray]:
    """A grid of points (rows, columns) and a centre of each end, and their triangles."""
    rows, columns = (DENSITY * count for count in surface.net.shape[:2])
    q, r = np.linspace(0.0, 1.0, columns, endpoint=False), np.linspace(0.0, 1.0, rows)
    grid = surface.sample(q, r)
    if surface.ends == "pole":
        grid = grid[1:-1]
    number = np.arange(len(grid) * columns).reshape(-1, columns)
    beside = np.roll(number, -1, axis=1)
    a, b, c, d = number[:-1], beside[:-1], beside[1:], number[1:]
    base, tip = number.size, number.size + 1
    ends = [np.stack([beside[0], number[0], np.full(columns, base)], axis=1)]
    ends.append(np.stack([number[-1], beside[-1], np.full(columns, tip)], axis=1))
    sides = [np.stack(each, axis=-1).reshape(-1, 3) for each in ((a, b, c), (a, c, d))]
    return np.concatenate([grid.reshape(-1, 3), surface.end_centres]), np.concatenate([*sides, *ends])
