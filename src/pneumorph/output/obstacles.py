"""Rigid obstacles in pictures: their triangles, as far as they are near the body."""

from __future__ import annotations

import numpy as np

from pneumorph.mechanics.setup import placed, shape_of
from pneumorph.output.view import Shell
from pneumorph.problem import PlaneSpec, Problem, Task, TriangulatedSpec

SAG = 0.02
"""How far the triangles of round obstacles are from them, as a fraction of the body's radius."""

MARGIN = 0.25
"""How far a plane is drawn beyond the body, as a fraction of the body's length."""


def obstacles_of(problem: Problem, points: np.ndarray, task: Task | None = None) -> tuple[Shell, ...]:
    """The obstacles of a problem as triangles, in their places or where a task moves them.

    Of planes there is the part beside a body with these points (N, 3) mm.
    """
    moved = displacements_of(problem, task)
    return tuple(
        Shell(shell.points + moved[name], shell.triangles) for name, shell in shells_of(problem, points).items()
    )


def displacements_of(problem: Problem, task: Task | None = None) -> dict[str, np.ndarray]:
    """How far (3,) mm a task moves each obstacle; not at all without one."""
    moves = task.moves if task else {}
    return {spec.name: np.array(moves.get(spec.name, (0.0, 0.0, 0.0))) for spec in problem.obstacle}


def shells_of(problem: Problem, points: np.ndarray) -> dict[str, Shell]:
    """The obstacles of a problem as triangles in their places, by name; see `obstacles_of`."""
    found = dict[str, Shell]()
    for spec in problem.obstacle:
        if isinstance(spec, PlaneSpec):
            found[spec.name] = _part(spec, points, MARGIN * problem.body.length)
            continue
        mesh = placed(spec) if isinstance(spec, TriangulatedSpec) else shape_of(spec).mesh(SAG * problem.body.radius)
        if mesh is not None:
            found[spec.name] = Shell(mesh.points, mesh.triangles)
    return found


def _part(plane: PlaneSpec, points: np.ndarray, margin: float) -> Shell:
    """A rectangle of a plane beside a body."""
    normal = np.asarray(plane.normal)
    across = np.linalg.svd(normal[None])[2][1:]
    along = (points - plane.point) @ across.T
    low, high = along.min(axis=0) - margin, along.max(axis=0) + margin
    corners = np.array([low, [high[0], low[1]], high, [low[0], high[1]]])
    return Shell(np.asarray(plane.point) + corners @ across, np.array([[0, 1, 2], [0, 2, 3]]))
