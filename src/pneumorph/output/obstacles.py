"""Rigid obstacles in pictures: their triangles, as far as they are near the body."""

from __future__ import annotations

import numpy as np

from pneumorph.analysis import TaskResult
from pneumorph.mechanics.assembly.pose import View, pose_of
from pneumorph.mechanics.setup import center_of, placed, shape_of
from pneumorph.output.view import Shell
from pneumorph.problem import PlaneSpec, Problem, Task, TriangulatedSpec

SAG = 0.02
"""How far the triangles of round obstacles are from them, as a fraction of the body's radius."""

MARGIN = 0.25
"""How far a plane is drawn beyond the body, as a fraction of the body's length."""


def obstacles_of(
    problem: Problem, points: np.ndarray, task: Task | None = None, result: TaskResult | None = None
) -> tuple[Shell, ...]:
    """The obstacles of a problem as triangles, in their places or where a task moves and turns them.

    Free ones are where they are in its result.
    Of planes there is the part beside a body with these points (N, 3) mm.
    """
    found = list[Shell]()
    for spec in problem.obstacle:
        pose = pose_of((task.poses if task else {}).get(spec.name, ()))
        if result is not None and spec.name in result.pose_translations:
            pose = np.array([*result.pose_translations[spec.name], *result.pose_rotations[spec.name]])
        view = View(center_of(spec), pose)
        if isinstance(spec, PlaneSpec):
            part = _part(spec, view.seen(points), MARGIN * problem.body.length)
            found.append(Shell(view.placed(part.points), part.triangles))
            continue
        mesh = placed(spec) if isinstance(spec, TriangulatedSpec) else shape_of(spec).mesh(SAG * problem.body.radius)
        if mesh is not None:
            found.append(Shell(view.placed(mesh.points), mesh.triangles))
    return tuple(found)


def _part(plane: PlaneSpec, points: np.ndarray, margin: float) -> Shell:
    """A rectangle of a plane beside a body."""
    normal = np.asarray(plane.normal)
    across = np.linalg.svd(normal[None])[2][1:]
    along = (points - plane.point) @ across.T
    low, high = along.min(axis=0) - margin, along.max(axis=0) + margin
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    return Shell(np.asarray(plane.point) + corners @ across, np.array([[0, 1, 2], [0, 2, 3]]))
