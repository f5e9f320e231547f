"""Which solids of a file are which regions of a body."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumorph.cad.faces import Faces, compact
from pneumorph.cad.shells import place, quarters, winds_around
from pneumorph.errors import MeshError


def solids_at(faces: Faces, inside: Mapping[str, np.ndarray]) -> dict[str, int]:
    """The number of the solid around each point (3,), by the names of the points.

    Raises
    ------
    MeshError
        If there is none, or two points are in one; a sentence whose subject is the file.
    """
    numbers = range(int(faces.solid.max()) + 1)
    found: dict[str, int] = {}
    for name, point in inside.items():
        around = [each for each in numbers if winds_around(faces.points, quarters(faces.around(each)), point)]
        if not around:
            raise MeshError(f'has no solid around {place(point)}, region "{name}"; give a point in its rubber')
        if around[0] in found.values():
            raise MeshError(f'has the points of two regions in one solid; leave "{name}" out')
        found[name] = around[0]
    return found


def groups_of(faces: Faces, inside: Mapping[str, np.ndarray]) -> np.ndarray:
    """The region (s,) of each solid: 0 for none, then those of the points (3,).

    Raises
    ------
    MeshError
        See `solids_at`.
    """
    group = np.zeros(int(faces.solid.max()) + 1, int)
    for number, solid in enumerate(solids_at(faces, inside).values(), 1):
        group[solid] = number
    return group


def grouped(faces: Faces, group: np.ndarray) -> Faces:
    """The same faces where the solids of a group (s,) count as one; outer triangles stay in their order."""
    sides = group[faces.sides]
    kept = sides[:, 0] != sides[:, 1]
    outside = np.stack([group[faces.solid], np.full(len(faces.solid), -1)], axis=1)
    return compact(
        faces.points,
        np.concatenate([faces.triangles, faces.between[kept]]),
        np.concatenate([faces.face, np.full(kept.sum(), -1)]),
        faces.names,
        np.concatenate([outside, sides[kept]]),
    )
