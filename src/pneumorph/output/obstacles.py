"""Rigid obstacles in pictures: their triangles, as far as they are near the body."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumorph.mechanics.contact.pose import View, pose_of
from pneumorph.mechanics.setup import rigid_body_of
from pneumorph.output.view import Shell
from pneumorph.problem import Problem, Task
from pneumorph.results import SweepStep, TaskResult

SAG = 0.02
"""How far the triangles of round obstacles are from them, as a fraction of the body's radius."""

MARGIN = 0.25
"""How far a plane is drawn beyond the body, as a fraction of the body's length."""


def obstacles_of(
    problem: Problem, points: np.ndarray, task: Task | None = None, result: TaskResult | None = None
) -> tuple[Shell, ...]:
    """The obstacles of a problem as triangles, in their places or at the poses of a task.

    Parameters
    ----------
    problem : Problem
    points : (N, 3) array
        Of the body, mm: of planes there is the part beside it.
    task : Task, optional
        Whose poses obstacles have.
    result : TaskResult, optional
        Of the task, with the poses of free obstacles.
    """
    views = views_of(problem, task, result)
    shells = shells_of(problem, {name: view.in_frame(points) for name, view in views.items()})
    return tuple(Shell(views[name].placed(shell.points), shell.triangles) for name, shell in shells.items())


def views_of(
    problem: Problem, task: Task | None = None, result: TaskResult | SweepStep | None = None, part: float = 1.0
) -> dict[str, View]:
    """Where the obstacles of a problem are, by their names.

    Parameters
    ----------
    problem : Problem
    task : Task, optional
        Whose poses obstacles have.
    result : TaskResult or SweepStep, optional
        With poses in their place.
    part : float
        How much of the task's poses is gone, from 0 to 1.
    """
    views = {}
    for spec in problem.obstacle:
        pose = part * pose_of((task.poses if task else {}).get(spec.name, ()))
        if result is not None and spec.name in result.pose_translations:
            pose = np.array([*result.pose_translations[spec.name], *result.pose_rotations[spec.name]])
        views[spec.name] = View(rigid_body_of(spec).center, pose)
    return views


def shells_of(problem: Problem, points: Mapping[str, np.ndarray]) -> dict[str, Shell]:
    """The obstacles of a problem as triangles in their places, by name.

    Of planes there is the part beside a body with points (N, 3) mm, as each obstacle sees them.
    """
    shells = {}
    for spec in problem.obstacle:
        margin, sag = MARGIN * problem.body.length, SAG * problem.body.radius
        mesh = rigid_body_of(spec).beside(points[spec.name], margin, sag)
        shells[spec.name] = Shell(mesh.points, mesh.triangles)
    return shells
