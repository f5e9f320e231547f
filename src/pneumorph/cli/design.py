"""`pneumorph design`: run the design loop and store every accepted design before the next one begins."""

from __future__ import annotations

from pathlib import Path
from shlex import quote

import typer
from rich.console import Console
from rich.text import Text

from pneumorph import compiling, doing, extras
from pneumorph.cli.outcome import outcome
from pneumorph.cli.screen import Screen
from pneumorph.cli.trust import asking
from pneumorph.cli.verdict import all_reached
from pneumorph.errors import ComputationError, Hopeless, NotWritten, ProblemError
from pneumorph.interface.runs import Run, prepare_run
from pneumorph.interrupts import Interrupted, deferred
from pneumorph.mechanics import rubbers_of
from pneumorph.output.format import warnings_of
from pneumorph.problem import load
from pneumorph.problem.columns import adjusted_columns
from pneumorph.problem.doubts import doubts
from pneumorph.results.targets import targets_reached

MISSED = 3
"""The exit status of a run that ended by itself and reached no, or not every, stated target."""


def design(
    problem: Path,
    out: Path | None,
    iterations: int | None,
    resume: bool,
    quiet: bool = False,
    verbose: bool = False,
    trust: bool = False,
    begin: Path | None = None,
) -> None:
    """Design a body for a problem file.

    Parameters
    ----------
    problem : Path
        The problem file, or to resume a run its directory.
    out : Path or None
        The run directory; by default in ``runs``, with the name of the file.
    iterations : int or None
        Most designs, in place of those of the problem.
    resume : bool
        Whether an interrupted run is resumed.
    quiet, verbose : bool
        Whether less or more is printed of every design.
    trust : bool
        Whether code in the problem file is trusted.
    begin : Path or None
        The directory of a run of the same body, with whose last design this one begins.

    Raises
    ------
    ProblemError
        If an option or the problem has a mistake.
    """
    if quiet and verbose:
        raise ProblemError("--quiet: is the opposite of --verbose; leave one of them out")
    if quiet:
        compiling.announce(None)
        doing.announce(None)
    if resume and (problem.is_dir() or not problem.suffix):
        if not (problem / "problem.toml").exists():
            raise ProblemError(
                f"{problem}: there is no run to resume; give the directory of a run, or start one with: "
                f"pneumorph design PROBLEM.toml --out {quote(str(problem))}"
            )
        if out is not None and out.resolve() != problem.resolve():
            raise ProblemError(f"--out: is another folder than {problem}, in which that run goes on; leave it out")
        problem, out = problem / "problem.toml", problem
    asked = load(problem, asking(trust))
    if iterations is not None:
        asked = asked.with_changes({"optimizer.iterations": iterations})
    run = prepare_run(asked, out or Path("runs") / problem.stem, resume, begin=begin)
    again = "" if iterations is None else f" --iterations {iterations}"
    command = f"pneumorph design {quote(str(problem))} --out {quote(str(run.path))}{again} --resume"
    console = Console()
    designed = False
    try:
        with deferred(), Screen(asked, console, quiet, verbose) as screen:
            if run.latest is not None:
                screen.say(f"resuming after design {run.latest} in {run.path}")
            if extras.has_mkl() and extras.missing("fast", "PARDISO"):
                screen.say("solved by SuperLU; pip install 'pneumorph[fast]' makes factorisations 6 to 8 times as fast")
            if asked.mesh.error is not None:
                size, error = run.problem.mesh.size, 100 * asked.mesh.error
                screen.say(
                    f"elements of {size:g} mm at first; those that contribute most to an error of the mesh above "
                    f"{error:g} % are divided"
                )
            for sentence in () if asked.solid else adjusted_columns(asked.tubes):
                screen.say(sentence)
            for sentence in doubts(asked):
                screen.say(sentence)
            try:
                run.complete(screen.show)
            except NotWritten as error:
                raise ComputationError(f"{error}; then resume with: {command}") from None
            except Hopeless:
                raise
            except ComputationError as error:
                _conclude(run, screen, console)
                raise ComputationError(f"{error}; {_saved(run, command)}") from None
            designed = True
            _conclude(run, screen, console)
            if not all_reached(targets_reached(run.problem, run.history)):
                raise typer.Exit(MISSED)
    except Interrupted as stop:
        left = f"the run in {run.path} is complete; draw its pictures with: pneumorph draw {quote(str(run.path))} all"
        raise stop.saying(f"stopped; {left if designed else _saved(run, command)}") from None


def _conclude(run: Run, screen: Screen, console: Console) -> None:
    """Draw the pictures and the page, say where they are, and print the summary, which is never left out."""
    history, result = run.history, run.result
    if not history or result is None:
        return
    # Loaded here: what draws is not needed until the run ends.
    from pneumorph.output.pictures import picture_names, run_pictures

    pictures = run_pictures(run.directory)
    for sentence in pictures.missing:
        screen.say(sentence)
    if pictures.paths:
        screen.say(f"pictures in {run.path / 'pictures'}: {picture_names(pictures.paths)}")
    try:
        screen.say(f"everything in one page: {run.report()}")
    except ProblemError as error:
        screen.say(f"the page could not be written: {error}")
    for part in outcome(run, history[0], result):
        console.print(part, soft_wrap=isinstance(part, Text))
    rubbers = rubbers_of(run.problem)
    for name, found in result.tasks.items():
        for sentence in warnings_of(rubbers, found):
            console.print(Text(f"Task {name}: {sentence}."), soft_wrap=True)


def _saved(run: Run, command: str) -> str:
    """What is on disk, and how to resume the run."""
    latest = run.latest
    if latest is None:
        return f"no design was finished; {run.path} contains the problem only"
    done = "design 0 is" if latest == 0 else f"designs 0 to {latest} are"
    return f"{done} saved in {run.path}; resume with: {command}"
