"""What tests of parts of a body compare."""

import numpy as np

from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import enclosed_volume
from pneumorph.mesh.tets import TET_FACES, TetMesh


def solid(body: Body) -> float:
    return enclosed_volume(body.exterior) - sum(map(enclosed_volume, body.chambers))


def boundary(mesh: TetMesh) -> set[frozenset[int]]:
    corners = np.sort(mesh.tets[:, TET_FACES].reshape(-1, 3), axis=1)
    faces, count = np.unique(corners, axis=0, return_counts=True)
    assert count.max() == 2
    return set(map(frozenset, faces[count == 1].tolist()))


def named(mesh: TetMesh) -> set[frozenset[int]]:
    return set(map(frozenset, np.concatenate(list(mesh.faces.values()))[:, :3].tolist()))
