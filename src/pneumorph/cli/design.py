"""`pneumorph design`: the design loop, with every accepted design on disk before the next begins."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer
from rich.console import Console

from pneumorph.cli.screen import Screen
from pneumorph.errors import ComputationError
from pneumorph.geometry import adjusted_columns
from pneumorph.mechanics import rubber_of
from pneumorph.objective import objectives
from pneumorph.output import run_pictures
from pneumorph.output.words import duration, motion_of, validity
from pneumorph.problem import Problem, load
from pneumorph.run import RunDirectory, create, resume
from pneumorph.study import drive


def design(
    problem: Annotated[Path, typer.Argument(help="The problem file (TOML).")],
    out: Annotated[Path | None, typer.Option(help="The run directory; by default runs/<name of the file>.")] = None,
    iterations: Annotated[int | None, typer.Option(min=1, help="Most designs, instead of the file's number.")] = None,
    going_on: Annotated[bool, typer.Option("--resume", help="Go on with a run that was stopped.")] = False,
) -> None:
    """Design a body for a problem."""
    asked = _with_iterations(load(problem), iterations)
    # What is wrong with a target is told before there is a directory.
    objectives(asked)
    run = (resume if going_on else create)(out or Path("runs") / problem.stem, asked)
    again = "" if iterations is None else f" --iterations {iterations}"
    command = f"pneumorph design {problem} --out {run.path}{again} --resume"
    with Screen(asked, Console()) as screen:
        latest = run.latest()
        if latest is not None:
            screen.say(f"going on after design {latest} in {run.path}")
        for sentence in adjusted_columns(asked.body):
            screen.say(sentence)
        try:
            outcome = drive(run, screen.show)
        except ComputationError as error:
            _conclude(run, screen, f"the computation failed: {error}")
            raise ComputationError(f"{error}; {_saved(run, command)}") from None
        except KeyboardInterrupt:
            raise ComputationError(f"stopped; {_saved(run, command)}") from None
        _conclude(run, screen, outcome.reason)


def _with_iterations(problem: Problem, iterations: int | None) -> Problem:
    if iterations is None:
        return problem
    optimizer = problem.optimizer.model_copy(update={"iterations": iterations})
    return problem.model_copy(update={"optimizer": optimizer})


def _conclude(run: RunDirectory, screen: Screen, reason: str) -> None:
    """Draw the pictures of what there is and say where they are, and what the run came to."""
    history, result = run.history(), run.result()
    if not history or result is None:
        return
    pictures = run_pictures(run)
    for sentence in pictures.missing:
        screen.say(sentence)
    if pictures.paths:
        screen.say(f"pictures in {run.path / 'pictures'}: {', '.join(path.name for path in pictures.paths)}")
    motions = ", ".join(
        f"{motion.word} {motion_of(task, history[0]['tasks'][task.name])} → {motion}"
        for task in run.problem.task
        for motion in [motion_of(task, history[-1]["tasks"][task.name])]
    )
    spent = duration(result["seconds"]["total"])
    screen.say(f"{result['iterations']} designs in {spent}: {motions}; the loop ended because {reason}.")
    rubber = rubber_of(run.problem.material)
    for name, answer in history[-1]["tasks"].items():
        if sentence := validity(rubber, answer["max_stretch"]):
            screen.say(f"Task {name}: {sentence}.")


def _saved(run: RunDirectory, command: str) -> str:
    """What is on disk and how to go on with it."""
    latest = run.latest()
    if latest is None:
        return f"no design was finished, {run.path} holds the problem alone"
    done = "design 0 is" if latest == 0 else f"designs 0 to {latest} are"
    return f"{done} saved in {run.path}; go on with: {command}"
