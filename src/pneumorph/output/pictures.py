"""Draw all pictures of a run."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from matplotlib.figure import Figure

from pneumorph.atomic import make_folder
from pneumorph.doing import doing
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of
from pneumorph.objective.kinds import target_of
from pneumorph.output.animation import Film, evolution, inflation, save_gif
from pneumorph.output.bodies import Row, bodies_figure
from pneumorph.output.figures import PLOTS, save
from pneumorph.output.history import history_figure
from pneumorph.output.pressures import has_free_pressures, pressures_figure
from pneumorph.output.render import Drawing, NoPicture
from pneumorph.output.scenes import Scene, highest_stretch, scenes_of
from pneumorph.output.shape import shape_figure
from pneumorph.output.tube.nets import of_straight_tubes
from pneumorph.output.tube.profile import profile_figure
from pneumorph.output.view import View
from pneumorph.problem import Problem
from pneumorph.problem.designed import starting_from
from pneumorph.results import Fields, HistoryEntry, TaskResult
from pneumorph.run import RunDirectory

NO_FIELDS = "its displacements are not stored (runs of early versions do not have them)"


@dataclass(frozen=True)
class Pictures:
    """The pictures that were drawn, and a sentence for each that could not be drawn."""

    paths: tuple[Path, ...]
    missing: tuple[str, ...]


def run_pictures(run: RunDirectory) -> Pictures:
    """Draw a run into its folder ``pictures``.

    Always history and profile as PNG, PDF and SVG, start.png and final.png; shape (shape_<task> if there are several)
    for tasks with a target curve or target sections; pressures if pressures are design variables; evolution.gif if
    there are several designs; inflation.gif (inflation_<task>.gif) for tasks whose inflation is stored. A picture that
    cannot be drawn is reported and raises nothing.
    """
    folder = pictures_folder(run)
    history, paths = accepted(run), list[Path]()
    parts, missing = _bodies(folder, run, history)
    # Another process draws the bodies while this one draws the diagrams.
    with doing("drawing the pictures") as far, Drawing([part.job for part in parts.values()]) as drawing:
        for name, figure in _plots(run, history):
            far(name)
            # Its layout is the same in every format, and found once.
            figure.draw_without_rendering()
            figure.set_layout_engine(None)
            for suffix in PLOTS:
                paths.append(folder / f"{name}.{suffix}")
                save(figure, paths[-1])
        try:
            # What is drawn is waited for.
            far("bodies")
            for (path, part), pictures in zip(parts.items(), drawing.images(), strict=True):
                far(path.name)
                if isinstance(part, Film):
                    save_gif(path, part.frames(pictures))
                else:
                    save(part.figure(pictures), path)
                paths.append(path)
        except NoPicture as error:
            first = next(path for path in parts if path not in paths)
            missing.append(f"{first} and other pictures of bodies could not be drawn: {error}")
    return Pictures(tuple(paths), tuple(missing))


def pictures_folder(run: RunDirectory) -> Path:
    """The folder for pictures of a run, made if need be; ProblemError if it cannot be written or is a link."""
    folder = run.path / "pictures"
    try:
        return make_folder(folder)
    except OSError as error:
        raise ProblemError(f"{folder}: cannot be written ({error.strerror}); put a folder there") from None


def picture_names(paths: Sequence[Path]) -> str:
    """The names of pictures, with those of one name but several formats as one: "history.png|pdf|svg"."""
    formats: dict[str, list[str]] = {}
    for path in paths:
        formats.setdefault(path.stem, []).append(path.suffix.removeprefix("."))
    return ", ".join(f"{stem}.{'|'.join(suffixes)}" for stem, suffixes in formats.items())


def accepted(run: RunDirectory) -> list[HistoryEntry]:
    """The accepted designs of a run, without one that is still being stored, or was when the run stopped."""
    latest = run.latest()
    return [entry for entry in run.history() if latest is None or entry.iteration <= latest]


def compared_profiles(run: RunDirectory, history: list[HistoryEntry], number: int | None = None) -> Figure:
    """The profiles of the start and of a design, by default the last.

    Raises
    ------
    ProblemError
        If the body is not of straight tubes.
    """
    number = history[-1].iteration if number is None else number
    envelope = run.problem.limits.envelope
    first, last = (run.load_design(each).body(run.problem) for each in (history[0].iteration, number))
    if not of_straight_tubes(first):
        raise ProblemError("picture: a profile is drawn of straight tubes only; ask for the body")
    return profile_figure(first, last, envelope and envelope.radius, ("start", _called(number, history)))


def compared_shapes(run: RunDirectory, history: list[HistoryEntry], name: str, number: int | None = None) -> Figure:
    """Target and achieved shape in a task, of the start and of a design, by default the last.

    Parameters
    ----------
    run : RunDirectory
    history : list of HistoryEntry
        Of its designs.
    name : str
        Of the task.
    number : int, optional
        Of the design, by default the last.
    """
    number = history[-1].iteration if number is None else number
    task = next(task for task in run.problem.task if task.name == name)
    entry = next(entry for entry in history if entry.iteration == number)
    first, last = history[0].tasks[name], entry.tasks[name]
    return shape_figure(task, run.problem.body.length, first, last, ("start", _called(number, history)))


def tasks_with_shapes(problem: Problem) -> list[str]:
    """The names of tasks with a target curve or target sections."""
    targets = {task.name: target_of(task.objective, problem.body.length) for task in problem.task}
    return [name for name, target in targets.items() if target is not None and len(target.line)]


def _called(number: int, history: list[HistoryEntry]) -> str:
    return "final" if number == history[-1].iteration else f"design {number}"


def _plots(run: RunDirectory, history: list[HistoryEntry]) -> Iterator[tuple[str, Figure]]:
    yield "history", history_figure(run.problem, history)
    if of_straight_tubes(body_of(run.problem)):
        yield "profile", compared_profiles(run, history)
    shapes = tasks_with_shapes(run.problem)
    for name in shapes:
        yield "shape" if len(shapes) == 1 else f"shape_{name}", compared_shapes(run, history, name)
    if has_free_pressures(run.problem):
        yield "pressures", pressures_figure(run.problem, history)


def _bodies(folder: Path, run: RunDirectory, history: list[HistoryEntry]) -> tuple[dict[Path, Row | Film], list[str]]:
    """The starting and the final design in the same colours, how shape and pressures change; what is missing."""
    problem, missing = run.problem, list[str]()
    stored: dict[str, Fields] = {}
    scenes: dict[str, list[Scene]] = {}
    for name, entry in (("start", history[0]), ("final", history[-1])):
        fields = run.fields(entry.iteration)
        if fields is None:
            missing.append(f"{folder / name}.png could not be drawn: {NO_FIELDS}")
        else:
            # Made whole once: all that is drawn of one mesh is then cut once.
            stored[name] = fields.whole()
            scenes[name] = scenes_of(starting_from(problem, entry.reinforcements), stored[name], entry.tasks)
    stretch = 1.0, highest_stretch(scene.shape for own in scenes.values() for scene in own)
    parts: dict[Path, Row | Film] = {}
    for name, own in scenes.items():
        title = f"{problem.title}, {name}" if problem.title else name
        parts[folder / f"{name}.png"] = Row(own, stretch, title)
    if len(history) > 1:
        bodies = [(entry, run.load_design(entry.iteration).body(problem)) for entry in history]
        parts[folder / "evolution.gif"] = evolution(problem, bodies)
    if "final" in stored:
        ways, last = stored["final"].inflation, starting_from(problem, history[-1].reinforcements)
        for task in ways:
            path = folder / ("inflation.gif" if len(ways) == 1 else f"inflation_{task}.gif")
            parts[path] = inflation(last, stored["final"], history[-1].tasks[task], task)
    return parts, missing


def design_figure(
    problem: Problem,
    fields: Fields,
    results: Mapping[str, TaskResult],
    title: str,
    view: View | None = None,
    only: str | None = None,
) -> Figure:
    """A figure of one design at rest and inflated.

    Parameters
    ----------
    problem, fields, results, view, only
        As for `scenes_of`.
    title : str
        Of the figure.

    Raises
    ------
    NoPicture
        If this machine cannot draw off-screen.
    """
    scenes = scenes_of(problem, fields, results, view, only)
    return bodies_figure(scenes, (1.0, highest_stretch(scene.shape for scene in scenes)), title)


def final_scenes(run: RunDirectory) -> list[Scene]:
    """The last design of a run, at rest and inflated for every task.

    Raises
    ------
    NoPicture
        If its fields are not stored.
    """
    last = accepted(run)[-1]
    fields = run.fields(last.iteration)
    if fields is None:
        raise NoPicture(NO_FIELDS)
    return scenes_of(starting_from(run.problem, last.reinforcements), fields, last.tasks)
