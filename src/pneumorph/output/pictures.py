"""Draw all pictures of a run."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.figure import Figure

from pneumorph.analysis import Fields, TaskResult
from pneumorph.output.bodies import bodies_figure
from pneumorph.output.format import format_pressures, motion_of
from pneumorph.output.history import History, draw_history
from pneumorph.output.pressures import draw_pressures, has_free_pressures
from pneumorph.output.profile import draw_profile
from pneumorph.output.render import NoPicture
from pneumorph.output.shape import draw_shape
from pneumorph.output.view import Shape, View
from pneumorph.problem import MatchCurve, MatchSections, Maximize, ObjectiveSpec, Problem, Reach
from pneumorph.run import RunDirectory

NO_FIELDS = "its displacements are not stored (runs of early versions do not have them)"

MOST = 0.998
"""Quantile of the stretch at which the colour scale ends, so that one sharp corner does not stretch it."""


@dataclass(frozen=True)
class Pictures:
    """The pictures that were drawn, and a sentence for each that could not be drawn."""

    paths: tuple[Path, ...]
    missing: tuple[str, ...]


def run_pictures(run: RunDirectory) -> Pictures:
    """Draw a run into its folder ``pictures``.

    Always history.png, profile.png, start.png and final.png; shape.png (shape_<task>.png if there are several) for
    tasks with a target curve or target sections; pressures.png if pressures are design variables. A picture that cannot
    be drawn is reported and raises nothing.
    """
    folder = run.path / "pictures"
    folder.mkdir(exist_ok=True)
    history, problem = run.history(), run.problem
    first, last = (run.load_design(entry.iteration) for entry in (history[0], history[-1]))
    envelope = problem.limits.envelope
    draw_history(folder / "history.png", problem, history)
    draw_profile(
        folder / "profile.png", first.body(problem), last.body(problem), None if envelope is None else envelope.radius
    )
    plain = [folder / "history.png", folder / "profile.png", *_draw_shapes(folder, problem, history)]
    if has_free_pressures(problem):
        plain.append(folder / "pressures.png")
        draw_pressures(plain[-1], problem, history)
    drawn, missing = _draw_bodies(folder, run, history)
    return Pictures((*plain, *drawn), tuple(missing))


def _draw_shapes(folder: Path, problem: Problem, history: History) -> list[Path]:
    """Draw target and achieved curve of every task that has a target curve or target sections."""
    tasks = [task for task in problem.task if isinstance(task.objective, MatchCurve | MatchSections)]
    paths = [folder / ("shape.png" if len(tasks) == 1 else f"shape_{task.name}.png") for task in tasks]
    for task, path in zip(tasks, paths, strict=True):
        first, last = (entry.tasks[task.name] for entry in (history[0], history[-1]))
        draw_shape(path, task, problem.body.length, first, last)
    return paths


def _draw_bodies(folder: Path, run: RunDirectory, history: History) -> tuple[list[Path], list[str]]:
    """Draw the starting and the final design, to the same scale and in the same colours."""
    problem, missing = run.problem, []
    shapes: dict[Path, dict[str, Shape]] = {}
    for name, entry in (("start", history[0]), ("final", history[-1])):
        path, fields = folder / f"{name}.png", run.fields(entry.iteration)
        if fields is None:
            missing.append(f"{path} could not be drawn: {NO_FIELDS}")
        else:
            shapes[path] = _shapes(problem, fields, entry.tasks)
    everything = [shape for panels in shapes.values() for shape in panels.values()]
    highest = max((float(np.quantile(shape.field, MOST)) for shape in everything if shape.field is not None), default=1)
    view = view_of(problem)
    drawn = []
    for path, panels in shapes.items():
        title = f"{problem.title}, {path.stem}" if problem.title else path.stem
        try:
            figure = bodies_figure(panels, view, view.extent(everything), (1.0, highest), title)
            figure.savefig(path, dpi=160)
            drawn.append(path)
        except NoPicture as error:
            missing.append(f"{path} could not be drawn: {error}")
    return drawn, missing


def design_figure(problem: Problem, fields: Fields, results: Mapping[str, TaskResult]) -> Figure:
    """A figure of one design at rest and inflated.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    shapes, view = _shapes(problem, fields, results), view_of(problem)
    highest = max(float(np.quantile(shape.field, MOST)) for shape in shapes.values() if shape.field is not None)
    return bodies_figure(shapes, view, view.extent(list(shapes.values())), (1.0, highest), problem.title)


def final_shapes(run: RunDirectory) -> dict[str, Shape]:
    """The last design of a run, at rest and inflated for every task, by the title of each picture.

    Raises
    ------
    NoPicture
        If its fields are not stored.
    """
    last = run.history()[-1]
    fields = run.fields(last.iteration)
    if fields is None:
        raise NoPicture(NO_FIELDS)
    return _shapes(run.problem, fields, last.tasks)


def _shapes(problem: Problem, half: Fields, results: Mapping[str, TaskResult]) -> dict[str, Shape]:
    """A design at rest, under its weight, and inflated for every task, by the title of each picture."""
    fields = half.whole()
    mesh = fields.mesh
    shapes = {"at rest": Shape(mesh, np.zeros_like(mesh.points))}
    if fields.sag is not None:
        shapes["under its weight"] = Shape(mesh, fields.sag)
    for task in problem.task:
        found = results[task.name]
        motion = motion_of(task, found)
        words = f"{format_pressures(found.pressures)}: {motion.word} {motion}"
        if len(problem.task) > 1:
            words = f"{task.name}, {words}"
        shapes[words] = Shape(mesh, fields.u[task.name], fields.stretch[task.name])
    return shapes


def view_of(problem: Problem) -> View:
    """A view of the plane in which the tasks bend most, cut so that chambers are visible."""
    about = np.zeros(3)
    for task in problem.task:
        about += np.abs(_axis(task.objective))
    normal = np.array([-1.0, 0.0, 0.0]) if about[0] > about[1] else np.array([0.0, 1.0, 0.0])
    return View(normal, _offset(problem, normal))


def _offset(problem: Problem, normal: np.ndarray) -> float:
    """Where to cut: through the axis if it passes through a chamber, otherwise through the nearest chamber in front."""
    places = [(float(np.dot([*chamber.center, 0.0], normal)), chamber.radius) for chamber in problem.body.chamber]
    if any(abs(place) < radius for place, radius in places):
        return 0.0
    return -min(abs(place) for place, _ in places)


def _axis(objective: ObjectiveSpec) -> np.ndarray:
    """How much a task bends about x and y and twists about z (3,), as fractions of its whole motion."""
    match objective:
        case Maximize(component=component):
            return np.array([component == name for name in ("bending_x", "bending_y", "twist")], float)
        case MatchCurve(control_points=points):
            across = np.ptp(np.array(points), axis=0)
            return np.array([across[1], across[0], 0.0]) / max(across[:2].sum(), 1e-9)
        case MatchSections(rotations=turns):
            turned = np.abs(np.array(turns)).max(axis=0)
            return turned / max(turned.sum(), 1e-9)
        case Reach(position=place) if place is not None:
            return np.array([abs(place[1]), abs(place[0]), 0.0]) / max(abs(place[0]) + abs(place[1]), 1e-9)
    return np.zeros(3)
