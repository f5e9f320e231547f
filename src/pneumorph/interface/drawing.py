"""Views that are asked for, and figures and films saved as files."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any, cast

from matplotlib.figure import Figure

from pneumorph import units
from pneumorph.errors import ProblemError, writing
from pneumorph.output.animation import Frames, save_gif
from pneumorph.output.cuts import NORMALS, Cut, asked_view
from pneumorph.output.figures import PLOTS, save
from pneumorph.output.view import View
from pneumorph.problem import Problem


def check_format(place: str, format: str, formats: tuple[str, ...]) -> None:
    """ProblemError at a place, a key or a file, if a format is not among those of a picture."""
    if format not in formats:
        raise ProblemError(f'{place}: "{format}" is not a format of this picture; use {" or ".join(formats)}')


def view(problem: Problem, cut: str | None, at: Any) -> View | None:
    """The view that is asked for, at a length as text or pint quantity; None if none is.

    Raises
    ------
    ProblemError
        If there is no such plane, or the length is not one or has no plane.
    """
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
    check_format(str(path), path.suffix.removeprefix(".").lower(), PLOTS)
    _written(path, lambda: save(figure, path))
    return figure


def saved_gif(frames: Frames, path: Path) -> None:
    """Save frames as a GIF; errors as of `saved`."""
    check_format(str(path), path.suffix.removeprefix(".").lower(), ("gif",))
    _written(path, lambda: save_gif(path, frames))


def _written(path: Path, write: Callable[[], None]) -> None:
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        write()
