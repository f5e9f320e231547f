"""All pictures of a run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np

from pneumorph.errors import ComputationError
from pneumorph.geometry import DesignSpace, design_space, starting_body
from pneumorph.mechanics import Equilibrium, NoEquilibrium, configuration, held_of, loads_of, solve
from pneumorph.mesh import unfolded
from pneumorph.optimize.analysis import Analysis, Discretisation, analyse, discretise
from pneumorph.optimize.checkpoint import unpack
from pneumorph.optimize.history import answers
from pneumorph.output.bodies import draw_bodies, nodal_stretch
from pneumorph.output.history import Lines, draw_history
from pneumorph.output.pressures import draw_pressures, has_free_pressures
from pneumorph.output.profile import draw_profile
from pneumorph.output.render import NoPicture
from pneumorph.output.shape import draw_shape
from pneumorph.output.view import Shape, View
from pneumorph.output.words import motion_of, pressures
from pneumorph.problem import MatchCurve, MatchSections, Maximize, Objective, Problem, Reach
from pneumorph.run import RunDirectory

MOST = 0.998
"""The colours end at this quantile of the stretch, so that a single sharp corner does not pale all the rest."""


@dataclass(frozen=True)
class Pictures:
    """The pictures that were made, and a sentence for each that could not be."""

    paths: tuple[Path, ...]
    missing: tuple[str, ...]


def run_pictures(run: RunDirectory) -> Pictures:
    """Draw a run into its folder ``pictures``.

    There are history.png, profile.png, start.png and final.png; shape.png (with several, one shape_<task>.png each) for
    tasks with a target curve or sections; pressures.png where pressures are designed. What cannot be drawn is told,
    never an error.
    """
    folder = run.path / "pictures"
    folder.mkdir(exist_ok=True)
    history, problem = run.history(), run.problem
    first, last = (run.load_design(line["iteration"]) for line in (history[0], history[-1]))
    envelope = problem.limits.envelope
    draw_history(folder / "history.png", problem, history)
    draw_profile(
        folder / "profile.png", first.body(problem), last.body(problem), None if envelope is None else envelope.radius
    )
    plain = [folder / "history.png", folder / "profile.png", *_draw_shapes(folder, problem, history)]
    if has_free_pressures(problem):
        plain.append(folder / "pressures.png")
        draw_pressures(plain[-1], problem, history)
    drawn, missing = _draw_bodies(folder, run)
    return Pictures((*plain, *drawn), tuple(missing))


def _draw_shapes(folder: Path, problem: Problem, history: Lines) -> list[Path]:
    """Target and achieved curve of every task that has one."""
    tasks = [task for task in problem.task if isinstance(task.objective, MatchCurve | MatchSections)]
    paths = [folder / ("shape.png" if len(tasks) == 1 else f"shape_{task.name}.png") for task in tasks]
    for task, path in zip(tasks, paths, strict=True):
        first, last = (line["tasks"][task.name] for line in (history[0], history[-1]))
        draw_shape(path, task, problem.body.length, first, last)
    return paths


def _draw_bodies(folder: Path, run: RunDirectory) -> tuple[list[Path], list[str]]:
    """Start and final design to the same scale and in the same colours."""
    problem, missing = run.problem, []
    space = design_space(problem, starting_body(problem.body))
    shapes: dict[Path, dict[str, Shape]] = {}
    for name, analysed in (("start", _start), ("final", _final)):
        path = folder / f"{name}.png"
        try:
            shapes[path] = _shapes(problem, *analysed(run, space))
        except ComputationError as error:
            missing.append(f"{path} could not be drawn: {error}")
    everything = [shape for panels in shapes.values() for shape in panels.values()]
    fields = [shape.field for shape in everything if shape.field is not None]
    view = view_of(problem)
    drawn = []
    for path, panels in shapes.items():
        highest = max(float(np.quantile(field, MOST)) for field in fields)
        title = f"{problem.title}, {path.stem}" if problem.title else path.stem
        try:
            draw_bodies(path, panels, view, view.extent(everything), (1.0, highest), title)
            drawn.append(path)
        except NoPicture as error:
            missing.append(f"{path} could not be drawn: {error}")
    return drawn, missing


def _start(run: RunDirectory, space: DesignSpace) -> tuple[Discretisation, Analysis]:
    disc = discretise(run.problem, space.reference)
    found = analyse(run.problem, space, disc, space.start)
    if isinstance(found, NoEquilibrium):
        raise ComputationError(found.reason)
    return disc, found


def _final(run: RunDirectory, space: DesignSpace) -> tuple[Discretisation, Analysis]:
    """As it was accepted: a deep bellows may be hard to inflate anew from rest."""
    _, state = run.checkpoint()
    return unpack(run.problem, space, state)


def final_shapes(run: RunDirectory) -> dict[str, Shape]:
    """The last design of a run at rest and inflated for every task, by the words above each."""
    return _shapes(run.problem, *_final(run, design_space(run.problem, starting_body(run.problem.body))))


def _shapes(problem: Problem, disc: Discretisation, analysis: Analysis) -> dict[str, Shape]:
    """A design at rest, under its weight, and inflated for every task, by the words above each."""
    mesh = disc.morph.mesh.at(analysis.X)
    whole = unfolded(mesh)
    shapes = {"at rest": Shape(whole.mesh, np.zeros_like(whole.mesh.points))}
    sag = _sag(problem, disc, analysis)
    if sag is not None:
        shapes["under its weight"] = Shape(whole.mesh, whole.vectors(sag.u))
    told = answers(disc, analysis)
    for task in problem.task:
        found, motion = analysis.equilibria[task.name], motion_of(task, told[task.name])
        words = f"{pressures(analysis.pressures[task.name])}: {motion.word} {motion}"
        if len(problem.task) > 1:
            words = f"{task.name}, {words}"
        shapes[words] = Shape(whole.mesh, whole.vectors(found.u), nodal_stretch(mesh, found.u)[whole.source])
    return shapes


def _sag(problem: Problem, disc: Discretisation, analysis: Analysis) -> Equilibrium | None:
    """A design without pressures, where weight or plate loads move it then; None where there is no such state."""
    effector = problem.end_effector
    if problem.gravity is None and not any((*effector.force, *effector.moment)):
        return None
    at = configuration(disc.model, analysis.X, loads_of(problem, disc.model, {}), held_of(problem))
    found = solve(at, next(iter(disc.tangents.values())))
    return found if isinstance(found, Equilibrium) else None


def view_of(problem: Problem) -> View:
    """Looking at the plane in which most tasks bend, cut so that chambers are seen."""
    about = np.zeros(3)
    for task in problem.task:
        about += np.abs(_axis(task.objective))
    normal = np.array([-1.0, 0.0, 0.0]) if about[0] > about[1] else np.array([0.0, 1.0, 0.0])
    return View(normal, _offset(problem, normal))


def _offset(problem: Problem, normal: np.ndarray) -> float:
    """Where to cut: through the axis, or in front of it through the nearest chambers where none is on the axis."""
    places = [(float(np.dot([*chamber.center, 0.0], normal)), chamber.radius) for chamber in problem.body.chamber]
    if any(abs(place) < radius for place, radius in places):
        return 0.0
    return -min(abs(place) for place, _ in places)


def _axis(objective: Objective) -> np.ndarray:
    """How much a task bends about x, y and z, in parts of all it does."""
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
