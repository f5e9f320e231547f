"""Draw one picture of a run: which there are, what may be asked of each, and where it is saved."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, cast

from matplotlib.figure import Figure

from pneumorph import units
from pneumorph.errors import ProblemError
from pneumorph.output.animation import Frames, evolution, save_gif
from pneumorph.output.cuts import NORMALS, Cut, asked_view
from pneumorph.output.figures import PLOTS, save
from pneumorph.output.history import history_figure
from pneumorph.output.pictures import accepted, compared_profiles, compared_shapes, tasks_with_shapes
from pneumorph.output.pressures import has_free_pressures, pressures_figure
from pneumorph.output.view import View
from pneumorph.problem import Problem

if TYPE_CHECKING:
    from pneumorph.interface.runs import Run

TAKES = {
    "body": ("design", "cut", "at", "task"),
    "history": (),
    "profile": ("design",),
    "shape": ("design", "task"),
    "pressures": (),
    "evolution": ("cut", "at"),
    "inflation": ("design", "cut", "at", "task"),
}
"""What can be asked of each picture."""

MOVING = ("evolution", "inflation")


@dataclass(frozen=True)
class RequestedPicture:
    """A picture, and what is asked of it; None where nothing is asked."""

    picture: str
    design: int | None = None
    cut: str | None = None
    at: Any = None
    task: str | None = None
    format: str | None = None


def draw(run: Run, wanted: RequestedPicture, path: Path | None) -> Path:
    """Draw a picture of a run into a file; parameters and errors are those of `Run.draw`."""
    _check(wanted)
    path = _path(run, wanted, path)
    # Says what is wrong with a run without designs, and with a number.
    design = run.design(wanted.design)
    if wanted.picture == "body":
        design.plot(path, cast(Cut | None, wanted.cut), wanted.at, wanted.task)
    elif wanted.picture == "inflation":
        design.animate(path, wanted.task, cast(Cut | None, wanted.cut), wanted.at)
    elif wanted.picture == "evolution":
        directory, history = run.directory, accepted(run.directory)
        bodies = [(entry, directory.load_design(entry.iteration).body(run.problem)) for entry in history]
        film = evolution(run.problem, bodies, view(run.problem, wanted.cut, wanted.at))
        saved_gif(film.drawn(), path)
    else:
        saved(_plot(run, wanted), path)
    return path


def _plot(run: Run, wanted: RequestedPicture) -> Figure:
    history, problem = accepted(run.directory), run.problem
    if wanted.picture == "history":
        return history_figure(problem, history)
    if wanted.picture == "profile":
        return compared_profiles(run.directory, history, wanted.design)
    if wanted.picture == "pressures":
        if not has_free_pressures(problem):
            raise ProblemError("pressures: all pressures of this problem are fixed; draw another picture")
        return pressures_figure(problem, history)
    names = tasks_with_shapes(problem)
    if not names:
        raise ProblemError("shape: no task has a target curve or target sections; draw another picture")
    if wanted.task is not None and wanted.task not in names:
        raise ProblemError(f'task: there is no task "{wanted.task}" with a target shape; use one of {", ".join(names)}')
    return compared_shapes(run.directory, history, wanted.task or names[0], wanted.design)


def _check(wanted: RequestedPicture) -> None:
    if wanted.picture not in TAKES:
        raise ProblemError(f'picture: "{wanted.picture}" is none; use one of {", ".join(TAKES)}')
    for name in ("design", "cut", "at", "task"):
        if getattr(wanted, name) is not None and name not in TAKES[wanted.picture]:
            raise ProblemError(f"{name}: means nothing for the picture {wanted.picture}; leave it out")
    _check_format("format", wanted.format or _formats(wanted.picture)[0], _formats(wanted.picture))


def _formats(picture: str) -> tuple[str, ...]:
    return ("gif",) if picture in MOVING else PLOTS


def _path(run: Run, wanted: RequestedPicture, path: Path | None) -> Path:
    formats = _formats(wanted.picture)
    if path is None:
        words = [wanted.picture]
        words += [] if wanted.design is None else [str(wanted.design)]
        words += [word for word in (wanted.task, wanted.cut) if word is not None]
        words += [] if wanted.at is None else [str(units.text_of(wanted.at)).replace(" ", "")]
        return run.path / "pictures" / f"{'_'.join(words)}.{wanted.format or formats[0]}"
    suffix = path.suffix.removeprefix(".").lower()
    if wanted.format not in (None, suffix):
        raise ProblemError(f"{path}: its suffix is not {wanted.format}; leave the format out or name another file")
    _check_format(str(path), suffix, formats)
    return path


def _check_format(place: str, format: str, formats: tuple[str, ...]) -> None:
    if format not in formats:
        raise ProblemError(f'{place}: "{format}" is not a format of this picture; use {" or ".join(formats)}')


def view(problem: Problem, cut: str | None, at: Any) -> View | None:
    """The view that is asked for, at a length as text or pint quantity; None if none is."""
    if cut is None:
        if at is not None:
            raise ProblemError("at: says where a cut is, but not which; give cut too, one of yz, xz, xy")
        return None
    if cut not in NORMALS:
        raise ProblemError(f'cut: "{cut}" is not a plane; use one of {", ".join(NORMALS)}')
    if at is not None and cut == "none":
        raise ProblemError("at: there is no cut; leave it out, or give cut as one of yz, xz, xy")
    try:
        place = None if at is None else units.parse(units.text_of(at), units.LENGTH)
    except ValueError as error:
        raise ProblemError(f"at: {error}") from None
    return asked_view(problem, cast(Cut, cut), place)


def saved(figure: Figure, path: Path) -> Figure:
    """Save a figure; ProblemError if its suffix is not known or the file cannot be written."""
    _check_format(str(path), path.suffix.removeprefix(".").lower(), PLOTS)
    _written(path, lambda: save(figure, path))
    return figure


def saved_gif(frames: Frames, path: Path) -> None:
    """Save frames as a GIF; errors as of `saved`."""
    _check_format(str(path), path.suffix.removeprefix(".").lower(), ("gif",))
    _written(path, lambda: save_gif(path, frames))


def _written(path: Path, write: Callable[[], None]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        write()
    except OSError as error:
        raise ProblemError(f"{path}: cannot be written ({error.strerror}); name another file") from None
