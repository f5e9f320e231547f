"""Sheets and fibres in pictures: sheets as what they cover, fibres as strokes along them."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.lines import Line2D
from matplotlib.patches import Patch

from pneumorph.mesh import Covered, TetMesh
from pneumorph.mesh.tets import RULE, triangle_gradient, triangle_shape
from pneumorph.output.view import COVERING, Covering
from pneumorph.problem import FibresSpec, Problem, reinforcements

_FOUR = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""A triangle with its mid-side nodes as four."""

LENGTH = 0.8
"""Length of a stroke, relative to the root of the area of what is around it."""


def coverings_of(problem: Problem, mesh: TetMesh, u: np.ndarray) -> tuple[Covering, ...]:
    """The reinforcements of a problem on a mesh at rest with the displacements u (N, 3) of its nodes in mm."""
    coverings = []
    for spec in reinforcements(problem):
        if (own := mesh.covers.get(spec.name)) is not None:
            local, cells = _strokes(spec, own, mesh.points) if isinstance(spec, FibresSpec) else _patches(own)
            shape = triangle_shape(local)
            rest, moved = (np.einsum("eka,eai->eki", shape, places[own.nodes]) for places in (mesh.points, u))
            cells = cells + local.shape[1] * np.arange(len(local))[:, None, None]
            places = rest.reshape(-1, 3), (rest + moved).reshape(-1, 3)
            coverings.append(Covering(*places, cells.reshape(-1, cells.shape[-1])))
    return tuple(coverings)


def covering_handles(coverings: Sequence[Covering]) -> list[Line2D | Patch]:
    """What a legend has for them."""
    handles: list[Line2D | Patch] = []
    if any(each.cells.shape[1] == 3 for each in coverings):
        handles.append(Patch(label="sheet", facecolor=COVERING, alpha=0.35))
    if any(each.cells.shape[1] == 2 for each in coverings):
        handles.append(Line2D([], [], color=COVERING, linewidth=1.5, label="fibres"))
    return handles


def _corners(own: Covered) -> np.ndarray:
    """Corners (E, 3, 2) of the covered parts of faces, in the coordinates of the faces."""
    barycentric = np.column_stack([1.0 - RULE.sum(axis=1), RULE])
    return np.einsum("cg,egk->eck", np.linalg.inv(barycentric), own.points[..., :2])


def _patches(own: Covered) -> tuple[np.ndarray, np.ndarray]:
    """Six points (E, 6, 2) of every part, and four triangles between them."""
    corners = _corners(own)
    return np.concatenate([corners, (corners + np.roll(corners, -1, axis=1)) / 2], axis=1), _FOUR


def _strokes(spec: FibresSpec, own: Covered, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Ends (E, 2 or 4, 2) of a stroke for each family in the middle of every part."""
    middle, nodes = _corners(own).mean(axis=1), points[own.nodes]
    tangents = np.einsum("eai,eak->eki", nodes, triangle_gradient(middle))
    normal = np.cross(tangents[:, 0], tangents[:, 1])
    area = np.einsum("eg,e->e", own.points[..., 2], np.linalg.norm(normal, axis=1))
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    along = np.einsum("ek,eki->ei", own.points[..., 3:].mean(axis=1), tangents)
    along /= np.linalg.norm(along, axis=1)[:, None]
    across, ends = np.cross(along, normal), []
    for hand in (1, -1)[: spec.families]:
        direction = np.cos(spec.winding.start) * along + hand * np.sin(spec.winding.start) * across
        # In the coordinates of the faces.
        local = np.einsum("eik,ei->ek", np.linalg.pinv(tangents), direction) * (LENGTH / 2 * np.sqrt(area))[:, None]
        ends += [middle - local, middle + local]
    return np.stack(ends, axis=1), np.arange(len(ends)).reshape(-1, 2)
