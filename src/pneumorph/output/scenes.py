"""What is drawn of a design: at rest, under its loads alone, and inflated for every task."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace

import numpy as np

from pneumorph.output.cuts import task_view, view_of
from pneumorph.output.format import format_pressures
from pneumorph.output.marks import Marks, clamp_of, loads_at, task_marks
from pneumorph.output.obstacles import obstacles_of
from pneumorph.output.reinforcements import coverings_of
from pneumorph.output.view import Covering, Shape, Shell, View
from pneumorph.problem import Problem, Task
from pneumorph.problem.acting import acting
from pneumorph.results import Fields, TaskResult

MOST = 0.998
"""Quantile of the stretch at which the colour scale ends, so that one sharp corner does not stretch it."""


AROUND = 0.15
"""How much of obstacles is seen around the body, as a fraction of its length."""


@dataclass(frozen=True, eq=False)
class Scene:
    """A body with its title, the view of it, its marks, the direction (3,) of gravity, rigid obstacles, and what is
    along it.
    """

    title: str
    shape: Shape | Shell
    view: View
    marks: Marks = field(default_factory=Marks)
    gravity: np.ndarray | None = None
    obstacles: tuple[Shell, ...] = ()
    coverings: tuple[Covering, ...] = ()

    def extent(self) -> np.ndarray:
        """Left, right, bottom and top (4,) in mm of the smallest picture that holds the body and its marks."""
        view, rest, points = self.view, self.shape.rest, self.shape.points
        if view.along and view.offset is not None:
            kept = rest @ view.normal > view.offset
            rest, points = rest[kept], points[kept]
        clamp = rest[:0] if view.along else clamp_of(self.shape)
        parts = [points, rest if self.marks.outlined else rest[:0], clamp, self.marks.points]
        # Of obstacles what is near the body.
        around = AROUND * np.ptp(rest[:, 2])
        low, high = points.min(axis=0) - around, points.max(axis=0) + around
        flat = view.flat(np.concatenate([*parts, *(np.clip(each.points, low, high) for each in self.obstacles)]))
        (left, bottom), (right, top) = flat.min(axis=0), flat.max(axis=0)
        return np.array([left, right, bottom, top])


def scenes_of(
    problem: Problem,
    fields: Fields,
    results: Mapping[str, TaskResult],
    view: View | None = None,
    only: str | None = None,
) -> list[Scene]:
    """The scenes of a design.

    Parameters
    ----------
    fields, results : of the design.
    view : of all scenes; by default each task is cut in the plane in which it bends the body.
    only : a task, to leave out the others.
    """
    whole = fields.whole()
    mesh, gravity = whole.mesh, gravity_of(problem, problem.task[0])
    obstacles = obstacles_of(problem, mesh.points)
    tasks = [task for task in problem.task if only in (None, task.name)]
    views = {task.name: view or task_view(problem, task, results[task.name]) for task in tasks}
    # Bodies that no task moves are seen as the tasks are if these have one view, otherwise in the common view.
    alike = len({str(each) for each in views.values()}) == 1
    first = views[tasks[0].name] if only is not None or alike else view or view_of(problem)
    still = np.zeros_like(mesh.points)
    coverings = coverings_of(problem, mesh, still)
    # What lies on the exterior is seen on a body that is not cut.
    entire = replace(first, offset=None) if coverings and view is None else first
    scenes = [Scene("at rest", Shape(mesh, still), entire, Marks(), gravity, obstacles, coverings)]
    if whole.sag is not None:
        tip = _tip(problem, whole)
        marks = Marks([] if first.along else loads_at(problem, problem.task[0], tip), outlined=True)
        sagged = coverings_of(problem, mesh, whole.sag)
        scenes.append(Scene(_loaded(problem), Shape(mesh, whole.sag), first, marks, gravity, obstacles, sagged))
    for task in tasks:
        result = results[task.name]
        motion = task.objective.achieved(result)
        words = f"{format_pressures(result.pressures)}: {motion.word} {motion.beside_target}"
        if len(problem.task) > 1:
            words = f"{task.name}, {words}"
        shape = Shape(mesh, whole.u[task.name], whole.stretch[task.name])
        own_view = views[task.name]
        # Seen along the axis, what is marked would lie in front of the cut.
        marks = Marks(outlined=True) if own_view.along else task_marks(problem, task, result)
        there = obstacles_of(problem, mesh.points, task, result)
        down, along = gravity_of(problem, task), coverings_of(problem, mesh, shape.u)
        scenes.append(Scene(words, shape, own_view, marks, down, there, along))
    return scenes


def highest_stretch(shapes: Iterable[Shape | Shell]) -> float:
    """The stretch at which the colour scale ends."""
    fields = [shape.field for shape in shapes if isinstance(shape, Shape) and shape.field is not None]
    return max((float(np.quantile(each, MOST)) for each in fields), default=1.0)


def gravity_of(problem: Problem, task: Task) -> np.ndarray | None:
    """The direction (3,) of gravity in a task, None without."""
    gravity = acting(problem, task).gravity
    return None if gravity is None else np.array(gravity.direction)


def _loaded(problem: Problem) -> str:
    """The title of a body that is not inflated: by what it is loaded."""
    given = acting(problem, problem.task[0])
    loads = ["force"] if any(given.force) else []
    loads += ["moment"] if any(given.moment) else []
    words = ["its weight"] if given.gravity is not None else []
    words += [f"the {' and '.join(loads)} on its tip"] if loads else []
    words += ["what holds its tip"] if any(given.hold.values.values()) else []
    return f"under {' and '.join(words)}, not inflated"


def _tip(problem: Problem, fields: Fields) -> np.ndarray:
    """The centre (3,) of the tip under the loads alone."""
    assert fields.sag is not None
    top = np.unique(fields.mesh.faces["tip"])
    return problem.body.ends[1] + fields.sag[top].mean(axis=0)
