"""`pneumorph simulate`: the equilibria of a body under its tasks' pressures or along a sweep."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.text import Text

from pneumorph.cli.pressures import path_of
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry import Body, design_space, starting_body
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    Model,
    NoEquilibrium,
    Tangent,
    configuration,
    held_of,
    loads_of,
    model_of,
)
from pneumorph.mechanics.plate import COMPONENTS
from pneumorph.mechanics.sweep import sweep
from pneumorph.mesh import mesh_body
from pneumorph.objective import features
from pneumorph.output.words import pressures as in_words
from pneumorph.problem import Problem, load
from pneumorph.run import atomic, open_run

BLOCKS = {
    "axial": ("axial",),
    "bending_x": ("bending_x",),
    "bending_y": ("bending_y",),
    "torsion": ("torsion",),
    "all": COMPONENTS,
}


def simulate(
    source: Annotated[Path, typer.Argument(metavar="PROBLEM_OR_RUN", help="A problem file, or a run directory.")],
    pressure: Annotated[
        list[str] | None, typer.Option(metavar="A=0:60:5kPa", help="Hold or sweep a chamber's pressure; repeatable.")
    ] = None,
    block: Annotated[
        list[str] | None, typer.Option(metavar="|".join(BLOCKS), help="Hold the plate against a motion; repeatable.")
    ] = None,
    report: Annotated[Path | None, typer.Option("--json", help="Write the steps to this file.")] = None,
    design: Annotated[int | None, typer.Option(min=0, help="Of a run: this design instead of the last.")] = None,
) -> None:
    """Simulate the starting body of a problem, or a design of a run."""
    began = time.perf_counter()
    subject = _subject(source, design)
    path = path_of(pressure or [], tuple(chamber.name for chamber in subject.problem.body.chamber))
    blocked = _blocked(subject.problem, block or [])
    mesh = mesh_body(subject.body, subject.problem.mesh.size).mesh
    model = model_of(subject.problem, mesh)
    console = Console()
    console.print(Text(f"{model.elements} {model.element} elements, {model.size} degrees of freedom"), soft_wrap=True)
    steps, reason = [], ""
    try:
        for step in _steps(subject, model, mesh.points, path, blocked):
            steps.append(step)
            console.print(_row(step), soft_wrap=True)
            reason = reason or step.get("reason", "")
    finally:
        seconds = time.perf_counter() - began
        if report is not None:
            _write(report, {"steps": steps, "elements": model.elements, "dofs": model.size, "seconds": seconds})
    if reason:
        found = sum(step["converged"] for step in steps)
        kept = f"; the other steps are in {report}" if report and found else ""
        raise ComputationError(f"{len(steps) - found} of {len(steps)} steps have no equilibrium: {reason}{kept}")


@dataclass(frozen=True)
class Subject:
    """A body to simulate, and its pressures by task and chamber in MPa."""

    problem: Problem
    body: Body
    pressures: dict[str, dict[str, float]]


def _subject(source: Path, number: int | None) -> Subject:
    if not source.is_dir():
        if number is not None:
            raise ProblemError(f"--design: {source} is no run directory and has no designs; leave it out")
        problem = load(source)
        body = starting_body(problem.body)
        space = design_space(problem, body)
        return Subject(problem, body, space.pressures(space.start))
    run = open_run(source)
    latest = run.latest()
    if latest is None:
        raise ProblemError(f"{source}: there is no finished design in it yet; run pneumorph design first")
    if number is not None and number > latest:
        raise ProblemError(f"--design: {source} has designs 0 to {latest} only; take one of them")
    stored = run.load_design(latest if number is None else number)
    return Subject(run.problem, stored.body(run.problem), stored.pressures)


def _blocked(problem: Problem, names: list[str]) -> np.ndarray:
    """The plate components (6,) that are held."""
    if names and problem.end_effector.kind == "free":
        raise ProblemError('--block: a free tip has no plate to hold; take kind = "plate" in [end_effector]')
    for name in names:
        if name not in BLOCKS:
            raise ProblemError(f'--block: "{name}" is not known here; take one of {", ".join(BLOCKS)}')
    held = {component for name in names for component in BLOCKS[name]}
    return np.array([component in held for component in COMPONENTS]) | held_of(problem)


def _steps(
    subject: Subject, model: Model, X: np.ndarray, path: list[dict[str, float]], blocked: np.ndarray
) -> Iterator[dict[str, Any]]:
    """The steps of every task, as the JSON has them."""
    tangent = Tangent(model)
    for task, own in subject.pressures.items():
        along = [own | given for given in path]
        walk = [configuration(model, X, loads_of(subject.problem, model, each), blocked) for each in along]
        for pressures, at, found in zip(along, walk, sweep(walk, tangent), strict=True):
            yield _step(task, pressures, at, found)


def _step(
    task: str, pressures: dict[str, float], at: Configuration, found: Equilibrium | NoEquilibrium
) -> dict[str, Any]:
    names = {"task": task, "pressure_MPa": pressures}
    if isinstance(found, NoEquilibrium):
        keys = ("translation_mm", "rotation_rad", "reaction", "volume_mm3", "max_stretch", "beyond_validity")
        nothing = dict.fromkeys(keys)
        return {**names, **nothing, "converged": False, "reason": found.reason}
    motion = features(at.model, at.X, found.state)
    return {
        **names,
        "translation_mm": np.asarray(motion.translation).tolist(),
        "rotation_rad": np.asarray(motion.rotation).tolist(),
        "reaction": _reaction(at, found),
        "volume_mm3": found.volumes,
        "max_stretch": found.max_stretch,
        "beyond_validity": at.model.rubber.beyond(found.max_stretch),
        "converged": True,
    }


def _reaction(at: Configuration, found: Equilibrium) -> dict[str, float]:
    """What the actuator exerts on whatever blocks or springs hold its plate, N and N·mm."""
    spring = np.asarray(at.loads.spring)
    exerted = found.reaction + spring * found.plate
    return {
        name: float(exerted[index]) for index, name in enumerate(COMPONENTS) if at.blocked[index] or spring[index] > 0.0
    }


def _row(step: dict[str, Any]) -> Text:
    head = f"{step['task']}, {in_words(step['pressure_MPa'])}: "
    if not step["converged"]:
        return Text(head + step["reason"], style="red")
    x, y, z = step["translation_mm"]
    a, b, c = np.degrees(step["rotation_rad"])
    parts = [f"tip ({x:.3f}, {y:.3f}, {z:.3f}) mm", f"turned ({a:.2f}, {b:.2f}, {c:.2f})°"]
    for name, value in step["reaction"].items():
        unit = "N·mm" if name in COMPONENTS[3:] else "N"
        parts.append(f"{name} {value:.4g} {unit}")
    beyond = ", beyond the range the rubber's parameters hold for" if step["beyond_validity"] else ""
    parts.append(f"stretch {step['max_stretch']:.3f}{beyond}")
    return Text(head + ", ".join(parts), style="yellow" if beyond else "")


def _write(path: Path, content: dict[str, Any]) -> None:
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic.write_bytes(path, f"{json.dumps(content, indent=2, allow_nan=False)}\n".encode())
    except OSError as error:
        raise ProblemError(f"--json {path}: cannot be written ({error.strerror}); name another file") from None
