"""`pneumorph simulate`: find the equilibria of a body at the tasks' pressures or along sweeps."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from pathlib import Path

import numpy as np
from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from pneumorph.analysis import Curve, SweepStep
from pneumorph.cli.trust import asking
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.interface.design import Design, starting_design
from pneumorph.interface.runs import open_run
from pneumorph.interface.sweep import Sweep
from pneumorph.mechanics import COMPONENTS
from pneumorph.mesh import keep_netgen_quiet
from pneumorph.output.format import format_pressures, mirror_note
from pneumorph.problem import Trust, load
from pneumorph.run import atomic


def simulate(
    source: Path,
    pressures: list[str],
    one_by_one: bool,
    block: list[str],
    files: Mapping[str, Path | None],
    number: int | None,
    trust: bool,
) -> None:
    """Simulate the starting body of a problem file or a design of a run; `files` are the output files by option."""
    began = time.perf_counter()
    keep_netgen_quiet()
    design = _design(source, number, asking(trust))
    given = _given(pressures)
    for option, path in files.items():
        _check(option, path)
    simulation = design.prepare_simulation(given, block, one_by_one)
    if files["--png"] is not None and not simulation.paths[0].swept:
        raise ProblemError("--png: there is no sweep to draw; add e.g. --pressure A=0:60:5kPa")
    model, console = simulation.model, Console()
    size = f"{model.elements} {model.element} elements, {model.size} degrees of freedom{mirror_note(model.mirror)}"
    console.print(Text(size), soft_wrap=True)
    curves: list[Curve] = []
    stopped = False
    try:
        with _progress(console, simulation.count) as progress:
            for step in simulation.run(curves):
                console.print(_row(step), soft_wrap=True)
                progress.advance(progress.task_ids[0])
    except KeyboardInterrupt:
        stopped = True
    finally:
        sweep = Sweep(simulation, curves, time.perf_counter() - began)
        _write("--json", files["--json"], f"{json.dumps(sweep.to_json(), indent=2, allow_nan=False)}\n")
        _write("--csv", files["--csv"], sweep.to_csv())
        if files["--png"] is not None and sweep.found:
            sweep.plot(files["--png"])
    steps = sweep.steps
    written = ", ".join(str(path) for path in files.values() if path is not None and path.exists())
    kept = f"; the steps so far are in {written}" if written and sweep.found else ""
    if stopped:
        raise ComputationError(f"stopped after {len(steps)} of {simulation.count} steps{kept}")
    if len(sweep.found) < simulation.count:
        reason = next(step.reason for step in steps if not step.converged)
        missing = simulation.count - len(sweep.found)
        raise ComputationError(f"{missing} of {simulation.count} steps have no equilibrium: {reason}{kept}")


def _design(source: Path, number: int | None, trust: Trust) -> Design:
    if source.is_dir():
        return open_run(source, trust).design(number)
    if number is not None:
        raise ProblemError(f"--design: {source} is not a run directory and has no designs; leave the option out")
    return starting_design(load(source, trust))


def _given(options: list[str]) -> dict[str, str]:
    """The pressures in the options, as text, by chamber."""
    given: dict[str, str] = {}
    for option in options:
        name, equals, values = option.partition("=")
        if not equals:
            raise ProblemError(
                f"--pressure {option}: is not a chamber with its pressure; write A=60kPa for a constant pressure or "
                "A=0:60:5kPa for a sweep"
            )
        if name.strip() in given:
            raise ProblemError(f'--pressure {option}: chamber "{name.strip()}" is given twice; leave one of them out')
        given[name.strip()] = values
    return given


def _progress(console: Console, total: int) -> Progress:
    """A progress bar below the rows; none if the console is not a terminal."""
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("steps,"), TimeElapsedColumn(), TextColumn("left"))
    progress = Progress(*columns, TimeRemainingColumn(), console=console, transient=True)
    progress.disable = not console.is_terminal
    progress.add_task("", total=total)
    return progress


def _row(step: SweepStep) -> Text:
    head = f"{step.task}, {format_pressures(step.pressures)}: "
    if not step.converged:
        return Text(head + step.reason, style="red")
    x, y, z = step.translation
    a, b, c = np.degrees(step.rotation)
    parts = [f"tip ({x:.3f}, {y:.3f}, {z:.3f}) mm", f"turned ({a:.2f}, {b:.2f}, {c:.2f})°"]
    for name, value in step.reaction.items():
        unit = "N·mm" if name in COMPONENTS[3:] else "N"
        parts.append(f"{name} {value:.4g} {unit}")
    beyond = ", beyond the range of the rubber's parameters" if step.beyond_validity else ""
    parts.append(f"stretch {step.max_stretch:.3f}{beyond}")
    if not step.stable:
        parts.append("not stable: the body buckles out of this state")
    return Text(head + ", ".join(parts), style="yellow" if beyond or not step.stable else "")


def _check(option: str, path: Path | None) -> None:
    """Raise ProblemError for a file that cannot be written, before anything is computed."""
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
