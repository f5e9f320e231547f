"""Triangles from OBJ files."""

from __future__ import annotations

from itertools import pairwise

import numpy as np

from pneumorph.cad.stl import Surface


def read_obj(data: bytes, most: int) -> Surface:
    """The points and triangles in the bytes of an OBJ file; polygons are divided from their first corner.

    Raises
    ------
    ValueError
        If it is none, or has more than `most` triangles; says why and how to repair it.
    """
    points: list[list[float]] = []
    triangles: list[tuple[int, int, int]] = []
    for line in data.decode("utf-8", errors="replace").splitlines():
        word, *rest = line.split("#")[0].split() or [""]
        try:
            if word == "v":
                points.append([float(part) for part in rest[:3]])
            elif word == "f":
                numbers = [int(part.split("/")[0]) for part in rest]
                corners = [number - 1 if number > 0 else len(points) + number for number in numbers]
                triangles += [(corners[0], a, b) for a, b in pairwise(corners[1:])]
        except ValueError:
            raise ValueError("has a corner or face that cannot be read; export it again") from None
        if len(triangles) > most:
            raise ValueError(f"has more than {most} triangles; make it coarser in a mesh program")
    found = np.array(triangles, int).reshape(-1, 3)
    if not len(found) or any(len(point) != 3 for point in points):
        raise ValueError("has no faces; export it again as OBJ with faces")
    if found.min() < 0 or found.max() >= len(points):
        raise ValueError("has faces between corners that it does not have; export it again")
    return Surface(np.array(points, float), found)
