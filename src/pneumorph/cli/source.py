"""The design that a command is about: of a run directory, or the start of a problem file."""

from __future__ import annotations

from pathlib import Path

from pneumorph.errors import ProblemError
from pneumorph.interface.design import Design, starting_design
from pneumorph.interface.runs import open_run
from pneumorph.problem import Trust, load


def design_of(source: Path, number: int | None, trust: Trust) -> Design:
    """A design of the run in a directory, by default the last one, or the starting body of a problem file.

    Raises
    ------
    ProblemError
        If there is none, or a number is given with a problem file.
    """
    if source.is_dir():
        return open_run(source, trust).design(number)
    if number is not None:
        raise ProblemError(f"--design: {source} is not a run directory and has no designs; leave the option out")
    if source.suffix == ".npz":
        raise ProblemError(f"{source}: is no run and no problem file; give the directory of the run")
    return starting_design(load(source, trust))
