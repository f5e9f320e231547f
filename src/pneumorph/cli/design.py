"""`pneumorph design`: the design loop, with every accepted design on disk before the next begins."""

from __future__ import annotations

import platform
import sys
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console

import pneumorph
from pneumorph.cli.screen import Screen
from pneumorph.errors import ComputationError
from pneumorph.mechanics import rubber_of
from pneumorph.optimize import DesignAccepted, Finished
from pneumorph.optimize import design as loop
from pneumorph.output import run_pictures
from pneumorph.output.words import duration, motion_of, validity
from pneumorph.problem import Problem, load
from pneumorph.run import Design, RunDirectory, create, resume


def design(
    problem: Annotated[Path, typer.Argument(help="The problem file (TOML).")],
    out: Annotated[Path | None, typer.Option(help="The run directory; by default runs/<name of the file>.")] = None,
    iterations: Annotated[int | None, typer.Option(min=1, help="Most designs, instead of the file's number.")] = None,
    going_on: Annotated[bool, typer.Option("--resume", help="Go on with a run that was stopped.")] = False,
) -> None:
    """Design a body for a problem."""
    asked = _with_iterations(load(problem), iterations)
    run = (resume if going_on else create)(out or Path("runs") / problem.stem, asked)
    again = "" if iterations is None else f" --iterations {iterations}"
    command = f"pneumorph design {problem} --out {run.path}{again} --resume"
    with Screen(asked, Console()) as screen:
        try:
            finished = _loop(run, screen)
        except ComputationError as error:
            _finish(run, screen, Outcome(f"the computation failed: {error}", completed=False))
            raise ComputationError(f"{error}; {_saved(run, command)}") from None
        except KeyboardInterrupt:
            raise ComputationError(f"stopped; {_saved(run, command)}") from None
        _finish(run, screen, Outcome(finished.reason, completed=True))


@dataclass(frozen=True)
class Outcome:
    """How a run ended: the reason as a sentence, and whether the loop came to its own end."""

    reason: str
    completed: bool


def _with_iterations(problem: Problem, iterations: int | None) -> Problem:
    if iterations is None:
        return problem
    optimizer = problem.optimizer.model_copy(update={"iterations": iterations})
    return problem.model_copy(update={"optimizer": optimizer})


def _loop(run: RunDirectory, screen: Screen) -> Finished:
    """Run the loop to its end, from the checkpoint where there is one."""
    state = None
    latest = run.latest()
    if latest is not None:
        _, state = run.checkpoint()
        screen.say(f"going on after design {latest} in {run.path}")
    for event in loop(run.problem, state):
        if isinstance(event, DesignAccepted):
            run.record(event.line, Design.of(event.body, event.pressures), event.state)
        screen.show(event)
        if isinstance(event, Finished):
            return event
    raise ComputationError("the design loop ended without a reason")


def _finish(run: RunDirectory, screen: Screen, outcome: Outcome) -> None:
    """Write the result and draw the pictures of what there is, and say where they are."""
    history = run.history()
    if not history:
        return
    result = _result(run.problem, history, outcome)
    run.write_result(result)
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
    screen.say(f"{result['iterations']} designs in {spent}: {motions}; the loop ended because {outcome.reason}.")
    rubber = rubber_of(run.problem.material)
    for name, answer in history[-1]["tasks"].items():
        if sentence := validity(rubber, answer["max_stretch"]):
            screen.say(f"Task {name}: {sentence}.")


def _result(problem: Problem, history: list[dict[str, Any]], outcome: Outcome) -> dict[str, Any]:
    """What ``result.json`` says."""
    last = history[-1]
    phases = last["seconds"].keys()
    motions = {task.name: motion_of(task, last["tasks"][task.name]) for task in problem.task}
    return {
        "title": problem.title,
        "completed": outcome.completed,
        "reason": outcome.reason,
        "iterations": last["iteration"],
        "objective": last["objective"],
        "motions": {name: {"value": motion.value, "unit": motion.unit} for name, motion in motions.items()},
        "tasks": last["tasks"],
        "limits": last["limits"],
        "held": last["held"],
        "seconds": {phase: sum(line["seconds"][phase] for line in history) for phase in phases},
        "peak_memory_MB": peak_memory(),
        "versions": {
            "pneumorph": pneumorph.__version__,
            "python": platform.python_version(),
            **{name: _version(name) for name in ("numpy", "scipy", "jax", "netgen-mesher")},
        },
    }


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def peak_memory() -> float | None:
    """Largest memory this process has held, in MB; None where the system does not tell."""
    try:
        import resource
    except ImportError:
        return None
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used / (1e6 if sys.platform == "darwin" else 1e3)


def _saved(run: RunDirectory, command: str) -> str:
    """What is on disk and how to go on with it."""
    latest = run.latest()
    if latest is None:
        return f"no design was finished, {run.path} holds the problem alone"
    done = "design 0 is" if latest == 0 else f"designs 0 to {latest} are"
    return f"{done} saved in {run.path}; go on with: {command}"
