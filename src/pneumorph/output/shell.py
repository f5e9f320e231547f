"""The surfaces of a body as closed triangles, for designs whose mesh is not stored."""

from __future__ import annotations

import numpy as np

from pneumorph.geometry import Body
from pneumorph.output.view import Shell


def shell_of(body: Body) -> Shell:
    """A body at rest as closed triangles, with normals out of the solid."""
    points, triangles, first = [], [], 0
    for surface in body.surfaces:
        own, corners = surface.shell()
        points.append(own)
        triangles.append(first + corners)
        first += len(own)
    return Shell(np.concatenate(points), np.concatenate(triangles))
