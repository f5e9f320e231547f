"""`pneumorph simulate`: the equilibria of a body under its tasks' pressures or along a sweep."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

import numpy as np
import typer
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from pneumorph.cli.pressures import Leg, legs_of
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry import Body, design_space, starting_body
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    Model,
    NoEquilibrium,
    Tangent,
    Whole,
    configuration,
    held_of,
    loads_of,
    mirror_of,
    model_of,
    whole_of,
)
from pneumorph.mechanics.assembly.plate import COMPONENTS
from pneumorph.mechanics.solve.sweep import sweep
from pneumorph.mesh import TetMesh, mesh_body
from pneumorph.objective import features
from pneumorph.output.curves import draw_curves
from pneumorph.output.sweeps import Curve, csv_text
from pneumorph.output.words import analysed
from pneumorph.output.words import pressures as in_words
from pneumorph.problem import Problem, load
from pneumorph.run import atomic, open_run

BLOCKS = {
    "shift_x": ("shift_x",),
    "shift_y": ("shift_y",),
    "axial": ("axial",),
    "bending_x": ("bending_x",),
    "bending_y": ("bending_y",),
    "torsion": ("torsion",),
    "all": COMPONENTS,
}


def simulate(
    source: Annotated[Path, typer.Argument(metavar="PROBLEM_OR_RUN", help="A problem file, or a run directory.")],
    pressure: Annotated[
        list[str] | None,
        typer.Option(
            metavar="A=0:60:5kPa",
            help="Sweep a chamber's pressure from start to stop by step, or hold it (A=60kPa); repeatable. "
            "Chambers swept step together. A chamber without has the pressure of the task.",
        ),
    ] = None,
    one_by_one: Annotated[
        bool,
        typer.Option("--one-by-one", help="Sweep one chamber after the other; the others wait at the start of theirs."),
    ] = False,
    block: Annotated[
        list[str] | None,
        typer.Option(
            metavar="|".join(BLOCKS),
            help="Hold the plate against a motion, and tell the force or torque on what holds it; repeatable.",
        ),
    ] = None,
    report: Annotated[Path | None, typer.Option("--json", help="Write the steps to this file.")] = None,
    table: Annotated[Path | None, typer.Option("--csv", help="Write them as a table to this file.")] = None,
    picture: Annotated[Path | None, typer.Option("--png", help="Draw the curves of a sweep into this file.")] = None,
    design: Annotated[int | None, typer.Option(min=0, help="Of a run: this design instead of the last.")] = None,
) -> None:
    """Simulate the starting body of a problem, or a design of a run: at the tasks' pressures or along sweeps."""
    began = time.perf_counter()
    subject = _subject(source, design)
    legs = legs_of(pressure or [], tuple(chamber.name for chamber in subject.problem.body.chamber), one_by_one)
    if picture is not None and not legs[0].swept:
        raise ProblemError("--png: there is no sweep to draw; add e.g. --pressure A=0:60:5kPa")
    blocked = _blocked(subject.problem, block or [])
    files = {"--json": report, "--csv": table, "--png": picture}
    for option, path in files.items():
        _check(option, path)
    applied = [own | given for own in subject.pressures.values() for leg in legs for given in leg.path]
    mesh = mesh_body(subject.body, subject.problem.mesh.size, mirror_of(subject.problem, applied)).mesh
    model = model_of(subject.problem, mesh)
    console = Console()
    size = f"{model.elements} {model.element} elements, {model.size} degrees of freedom{analysed(model.mirror)}"
    console.print(Text(size), soft_wrap=True)
    curves: list[Curve] = []
    total = len(subject.pressures) * sum(len(leg.path) for leg in legs)
    stopped = False
    try:
        with _progress(console, total) as progress:
            for step in _steps(subject, model, mesh, legs, blocked, curves):
                console.print(_row(step), soft_wrap=True)
                progress.advance(progress.task_ids[0])
    except KeyboardInterrupt:
        stopped = True
    finally:
        steps = [step for curve in curves for step in curve.steps]
        seconds = time.perf_counter() - began
        content = {"steps": steps, "elements": model.elements, "dofs": model.size, "seconds": seconds}
        _write("--json", report, f"{json.dumps(content, indent=2, allow_nan=False)}\n")
        _write("--csv", table, csv_text(curves, [chamber.name for chamber in subject.problem.body.chamber]))
        if picture is not None and any(curve.found for curve in curves):
            title = ", ".join(part for part in (subject.problem.title, _hold(block or [])) if part)
            draw_curves(picture, curves, title)
    found = sum(step["converged"] for step in steps)
    written = ", ".join(str(path) for path in files.values() if path is not None and path.exists())
    kept = f"; what was found is in {written}" if written and found else ""
    if stopped:
        raise ComputationError(f"stopped after {len(steps)} of {total} steps{kept}")
    if found < total:
        reason = next(step["reason"] for step in steps if not step["converged"])
        raise ComputationError(f"{total - found} of {total} steps have no equilibrium: {reason}{kept}")


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


def _hold(names: list[str]) -> str:
    """What `--block` holds, in words."""
    return f"blocked: {' and '.join(name.replace('_', ' about ') for name in names)}" if names else ""


def _progress(console: Console, total: int) -> Progress:
    """A bar below the rows; none where the console is no terminal."""
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("steps,"), TimeElapsedColumn(), TextColumn("left"))
    progress = Progress(*columns, TimeRemainingColumn(), console=console, transient=True)
    progress.disable = not console.is_terminal
    progress.add_task("", total=total)
    return progress


def _steps(
    subject: Subject, model: Model, mesh: TetMesh, legs: list[Leg], blocked: np.ndarray, curves: list[Curve]
) -> Iterator[dict[str, Any]]:
    """Walk every leg of every task; each step goes to the last of `curves`, as the JSON has it, and out."""
    tangent = Tangent(model)
    whole = None if model.mirror is None else whole_of(model, mesh)
    for task, own in subject.pressures.items():
        for leg in legs:
            curves.append(Curve(task, leg.swept, []))
            along = [own | given for given in leg.path]
            loads = [loads_of(subject.problem, model, each) for each in along]
            walk = [configuration(model, mesh.points, each, blocked) for each in loads]
            for pressures, at, found in zip(along, walk, sweep(walk, tangent), strict=True):
                step = _step(task, pressures, at, found, whole)
                curves[-1].steps.append(step)
                yield step


def _step(
    task: str, pressures: dict[str, float], at: Configuration, found: Equilibrium | NoEquilibrium, whole: Whole | None
) -> dict[str, Any]:
    names = {"task": task, "pressure_MPa": pressures}
    if isinstance(found, NoEquilibrium):
        keys = ("translation_mm", "rotation_rad", "reaction", "volume_mm3", "max_stretch", "beyond_validity", "stable")
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
        "stable": found.stable and (whole is None or whole.negative_pivots(at, found.state) == 0),
        "converged": True,
    }


def _reaction(at: Configuration, found: Equilibrium) -> dict[str, float]:
    """What the actuator exerts on whatever blocks or springs hold its plate, N and N·mm."""
    spring = at.model.copies * np.asarray(at.loads.spring)
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
    if not step["stable"]:
        parts.append("not stable: the body buckles out of this state")
    return Text(head + ", ".join(parts), style="yellow" if beyond or not step["stable"] else "")


def _check(option: str, path: Path | None) -> None:
    """Refuse a file that cannot be written, before anything is computed for it."""
    if path is None:
        return
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise ProblemError(f"{option} {path}: cannot be written ({error.strerror}); name another file") from None
    if path.is_dir() or not os.access(path.parent, os.W_OK):
        wrong = "is a directory" if path.is_dir() else "its folder cannot be written to"
        raise ProblemError(f"{option} {path}: {wrong}; name another file")


def _write(option: str, path: Path | None, text: str) -> None:
    if path is None:
        return
    try:
        atomic.write_bytes(path, text.encode())
    except OSError as error:
        raise ProblemError(f"{option} {path}: cannot be written ({error.strerror}); name another file") from None
