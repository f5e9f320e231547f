"""The pictures of a run: which there are, what may be asked of each, and in which file it is saved."""

from __future__ import annotations

import os
from dataclasses import dataclass
from pathlib import Path
from typing import Any, cast

from matplotlib.figure import Figure

from pneumorph import units
from pneumorph.errors import ProblemError
from pneumorph.interface.design import Design
from pneumorph.interface.drawing import check_format, saved, saved_gif, view
from pneumorph.output.animation import evolution
from pneumorph.output.cuts import Cut
from pneumorph.output.figures import PLOTS
from pneumorph.output.history import history_figure
from pneumorph.output.pictures import (
    accepted,
    compared_profiles,
    compared_shapes,
    pictures_folder,
    tasks_with_shapes,
)
from pneumorph.output.pressures import has_free_pressures, pressures_figure
from pneumorph.run import RunDirectory

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

    def __post_init__(self):
        """Raise ProblemError if there is no such picture, or what is asked means nothing for it."""
        if self.picture not in TAKES:
            raise ProblemError(f'picture: "{self.picture}" is none; use one of {", ".join(TAKES)}')
        for name in ("design", "cut", "at", "task"):
            if getattr(self, name) is not None and name not in TAKES[self.picture]:
                raise ProblemError(f"{name}: means nothing for the picture {self.picture}; leave it out")
        check_format("format", self.format or self.formats[0], self.formats)

    @property
    def formats(self) -> tuple[str, ...]:
        """The formats in which it can be saved, the usual one first."""
        return ("gif",) if self.picture in MOVING else PLOTS

    def file(self, folder: Path, path: Path | None) -> Path:
        """The file to save it in: the given one, or in the pictures of a folder one that is named by what it shows.

        Raises
        ------
        ProblemError
            If the suffix of the given file is not a format of the picture, or not the one that is asked for.
        """
        if path is None:
            words = [self.picture]
            words += [] if self.design is None else [str(self.design)]
            words += [word for word in (self.task, self.cut) if word is not None]
            words += [] if self.at is None else [str(units.text_of(self.at)).replace(" ", "")]
            return folder / "pictures" / f"{'_'.join(words)}.{self.format or self.formats[0]}"
        suffix = path.suffix.removeprefix(".").lower()
        if self.format not in (None, suffix):
            raise ProblemError(f"{path}: its suffix is not {self.format}; leave the format out or name another file")
        check_format(str(path), suffix, self.formats)
        return path


def draw(directory: RunDirectory, design: Design, asked: RequestedPicture, file: Path) -> Path:
    """Draw a picture of a run into a file; errors are those of `Run.draw`.

    Parameters
    ----------
    directory : of the run.
    design : the one that is asked for, or the last.
    asked : the picture.
    file : where to.
    """
    if file.parent == directory.path / "pictures" and os.path.lexists(file.parent):
        pictures_folder(directory)  # refuses a link
    cut, problem = cast(Cut | None, asked.cut), directory.problem
    if asked.picture == "body":
        design.plot(file, cut, asked.at, asked.task)
    elif asked.picture == "inflation":
        design.animate(file, asked.task, cut, asked.at)
    elif asked.picture == "evolution":
        bodies = [(entry, directory.load_design(entry.iteration).body(problem)) for entry in accepted(directory)]
        film = evolution(problem, bodies, view(problem, asked.cut, asked.at))
        saved_gif(film.drawn(), file)
    else:
        saved(_figure(directory, asked), file)
    return file


def _figure(directory: RunDirectory, asked: RequestedPicture) -> Figure:
    history, problem = accepted(directory), directory.problem
    if asked.picture == "history":
        return history_figure(problem, history)
    if asked.picture == "profile":
        return compared_profiles(directory, history, asked.design)
    if asked.picture == "pressures":
        if not has_free_pressures(problem):
            raise ProblemError("pressures: all pressures of this problem are fixed; draw another picture")
        return pressures_figure(problem, history)
    names = tasks_with_shapes(problem)
    if not names:
        raise ProblemError("shape: no task has a target curve or target sections; draw another picture")
    if asked.task is not None and asked.task not in names:
        raise ProblemError(f'task: there is no task "{asked.task}" with a target shape; use one of {", ".join(names)}')
    return compared_shapes(directory, history, asked.task or names[0], asked.design)
