"""Faces under a cover, with the points at which what lies there is integrated and the direction from base to tip.

Where the edge of a cover crosses a face, the covered part of the face is cut into triangles, each with its own points:
so covers are as large on every mesh, and nothing depends on whether mesh lines follow their edges. Points and
directions are constants of the mesh in its parameters; they move exactly as the surface does.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np

from pneumorph.errors import MeshError
from pneumorph.geometry.tube.cover import Cover
from pneumorph.mesh.clip import clipped, triangles_of
from pneumorph.mesh.tets import RULE, Covered, chambers_of, triangle_gradient
from pneumorph.problem.reinforcement import EXTERIOR

_OUTWARDS = [0, 2, 1, 5, 4, 3]


def covered(
    faces: Mapping[str, np.ndarray], param: Mapping[str, np.ndarray], covers: Iterable[Cover]
) -> dict[str, Covered]:
    """What is covered, by the names of the covers; of part of a body, what lies in it.

    Parameters
    ----------
    faces, param : as in `SurfaceMesh`.

    Raises
    ------
    MeshError
        If a cover is smaller than what could be found on the mesh.
    """
    by_name: dict[str, list[Covered]] = {}
    for cover in covers:
        parts = by_name.setdefault(cover.name, [])
        for face, triangles in faces.items():
            cavity = chambers_of(face)[:1] == (cover.surface,)
            if cavity or (face == cover.surface == EXTERIOR):
                parts.append(_on_surface(triangles, param[cover.surface], cover, turned=cavity))
    for name, parts in by_name.items():
        if not sum(len(part.nodes) for part in parts):
            raise MeshError(f'nothing of the meshed surfaces is under "{name}"')
    return {
        name: Covered(*(np.concatenate([getattr(part, kind) for part in parts]) for kind in ("nodes", "points")))
        for name, parts in by_name.items()
    }


def _on_surface(triangles: np.ndarray, param: np.ndarray, cover: Cover, turned: bool) -> Covered:
    """The covered parts of a tube's triangles (nf, 6), the first of a face, with their parameters (nf, 6, 2)."""
    nodes = triangles[: len(param)]
    if turned:
        nodes, param = nodes[:, _OUTWARDS], param[:, _OUTWARDS]
    corners = param[:, :3]
    chosen, parts = [], []
    for turn in (-1, 0, 1) if cover.q else (0,):
        # How far inside the cover the corners are, by its edges; a triangle crosses edges or not.
        depth = [corners[..., 1] - cover.r[0], cover.r[1] - corners[..., 1]]
        if cover.q:
            depth += [corners[..., 0] - (cover.q[0] + turn), cover.q[1] + turn - corners[..., 0]]
        within = np.stack(depth, axis=1)
        for face in np.flatnonzero((within.max(axis=2) > 0.0).all(axis=1)):
            for part in triangles_of(clipped(within[face])):
                chosen.append(face)
                parts.append(part)
    faces, corner = np.array(chosen, int), np.array(parts).reshape(-1, 3, 2)
    first, sides = corner[:, 0], corner[:, 1:] - corner[:, :1]
    places = first[:, None] + np.einsum("ga,eai->egi", RULE, sides)
    weights = np.broadcast_to(np.abs(np.linalg.det(sides))[:, None, None] / 6, (len(faces), 3, 1))
    slope = np.einsum("eai,egak->egik", param[faces], triangle_gradient(places))
    # q is constant along (−∂q/∂η, ∂q/∂ξ), and r rises along it or against it.
    along = np.stack([-slope[..., 0, 1], slope[..., 0, 0]], axis=-1)
    along *= np.sign(np.sum(along * slope[..., 1, :], axis=-1, keepdims=True))
    return Covered(nodes[faces], np.concatenate([places, weights, along], axis=-1))
