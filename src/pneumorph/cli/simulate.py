"""`pneumorph simulate`: find the equilibria of a body at the tasks' pressures or along sweeps."""

from __future__ import annotations

import json
import os
import time
from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.text import Text

from pneumorph import atomic, compiling
from pneumorph.analysis import Curve
from pneumorph.analysis.pressures import held_values
from pneumorph.cli.source import design_of
from pneumorph.cli.steps import Rows
from pneumorph.cli.stiffness import stiffness_lines
from pneumorph.cli.trust import asking
from pneumorph.doing import announce, doing, said
from pneumorph.errors import ComputationError, ProblemError, writing
from pneumorph.interface.sweep import Sweep
from pneumorph.interrupts import Interrupted, deferred
from pneumorph.output.format import part_note
from pneumorph.problem.materials import materials
from pneumorph.problem.sources import doubt, told
from pneumorph.results import Cycle


def simulate(
    source: Path,
    *,
    pressures: list[str],
    volumes: list[str],
    moves: list[str],
    friction: float | None,
    rate: str | None,
    cycles: int | None,
    hold: str | None,
    one_by_one: bool,
    block: list[str],
    stiffness: bool,
    along: str | None,
    files: Mapping[str, Path | None],
    number: int | None,
    task: str | None,
    quiet: bool,
    trust: bool,
) -> None:
    """Simulate the starting body of a problem file or a design of a run.

    Parameters
    ----------
    source : Path
        A problem file or a run directory.
    pressures : list of "CHAMBER=60kPa" or "CHAMBER=0:60:5kPa"
        Constant and swept pressures.
    volumes : list of "CHAMBER=12ml" or "CHAMBER=0:12:1ml"
        Constant and swept volumes of liquid, in place of pressures.
    moves : list of "OBSTACLE.AXIS=-3mm" or "OBSTACLE.AXIS=0:-3:-0.5mm"
        Constant and swept poses.
    friction : float or None
        Coefficient; by default that of the problem.
    rate : str or None
        Of the first that is swept, "2kPa/s".
    cycles : int or None
        How often sweeps go there and back.
    hold : str or None
        How long loads stay at the ends of sweeps, "10s".
    one_by_one : bool
        Whether chambers are swept one after another.
    block : list of str
        Motions of the plate that are held, "axial", "axial=2mm" or "axial=0:4:1mm".
    stiffness : bool
        Whether the stiffness of the tip is printed for every step.
    along : str or None
        A direction in which the tip is blocked then.
    files : {"--json", "--csv", "--png": Path or None}
        Output files.
    number : int or None
        Of a run's design, by default the last.
    task : str or None
        The only one simulated.
    quiet : bool
        Whether no steps are printed.
    trust : bool
        Whether code in the problem file is trusted.

    Raises
    ------
    ProblemError
        If an option or the problem has a mistake.
    ComputationError
        If a step has no equilibrium.
    """
    began = time.perf_counter()
    if quiet:
        compiling.announce(None)
        announce(None)
    # What is wrong with options alone, before a body is read from a file.
    given = given_values("--pressure", pressures, PRESSURES)
    filled = given_values("--volume", volumes, VOLUMES)
    moved = given_values("--move", moves, MOVES)
    held_values(block)
    design = design_of(source, number, asking(trust))
    console = Console(quiet=quiet)
    for option, path in files.items():
        for folder in made_folders(option, path):
            console.print(Text(f"the folder {folder} is made for {path.name if path else ''}"), soft_wrap=True)
    options = moved, friction, filled, stiffness, along, rate, cycles, hold
    simulation = design.prepare_simulation(given, block, one_by_one, task, *options)
    if files["--png"] is not None and not simulation.paths[0].swept:
        raise ProblemError("--png: there is no sweep to draw; add e.g. --pressure A=0:60:5kPa")
    model = simulation.model
    size = f"{model.elements} {model.element} elements, {model.size} degrees of freedom{part_note(model.part)}"
    console.print(Text(size), soft_wrap=True)
    for material in materials(design.problem).values():
        sentences = told(material) if rate is None and cycles is None else filter(None, [doubt(material)])
        for sentence in sentences:
            console.print(Text(sentence), soft_wrap=True)
    for other, same in simulation.left_out.items():
        console.print(Text(f"task {other} is left out: its loads here are those of task {same}"), soft_wrap=True)
    rows = Rows({each.name: each for each in design.problem.task})
    curves: list[Curve] = []
    stop: Interrupted | None = None
    try:
        with deferred(), doing("sweeping") as far, progress_bar(console, simulation.count) as progress:
            far(f"step 1 of {simulation.count}")
            for number, step in enumerate(simulation.run(curves), start=1):
                far(f"step {min(number + 1, simulation.count)} of {simulation.count}")
                for line in [*rows.lines(step), *stiffness_lines(step)]:
                    console.print(line, soft_wrap=True)
                said()
                progress.advance(progress.task_ids[0])
        for cycle in (each for curve in curves for each in curve.cycles):
            console.print(Text(cycle_line(cycle)), soft_wrap=True)
    except Interrupted as error:
        stop = error
    finally:
        sweep = Sweep(simulation, curves, time.perf_counter() - began)
        write_file("--json", files["--json"], f"{json.dumps(sweep.to_json(), indent=2, allow_nan=False)}\n")
        write_file("--csv", files["--csv"], sweep.to_csv())
        if files["--png"] is not None and sweep.found:
            sweep.plot(files["--png"])
    steps = sweep.steps
    written = ", ".join(str(path) for path in files.values() if path is not None and path.exists())
    kept = f"; the steps so far are in {written}" if written and sweep.found else ""
    if stop is not None:
        raise stop.saying(f"stopped after {len(steps)} of {simulation.count} steps{kept}")
    if len(sweep.found) < simulation.count:
        reason = next(step.reason for step in steps if not step.converged)
        missing = simulation.count - len(sweep.found)
        raise ComputationError(f"{missing} of {simulation.count} steps have no equilibrium: {reason}{kept}")


def cycle_line(cycle: Cycle) -> str:
    """A line on a cycle."""
    share = f" ({100.0 * cycle.lost / cycle.work:.3g} %)" if cycle.work > 0.0 else ""
    lost = f"{cycle.lost:.4g} mJ of {cycle.work:.4g} mJ do not come back{share}"
    return f"{cycle.task}: in cycle {cycle.number} {lost}"


PRESSURES = "a chamber with its pressure; write A=60kPa for a constant pressure or A=0:60:5kPa for a sweep"
VOLUMES = "a chamber with its volume; write A=12ml for a constant one or A=0:12:1ml for a sweep"
MOVES = (
    "an obstacle and an axis with a displacement or a turn; write plate.z=-3mm or plate.turn_z=30deg or, for a sweep, "
    "plate.z=0:-3:-0.5mm"
)


def given_values(key: str, options: list[str], what: str) -> dict[str, str]:
    """The values in the options, as text, by chamber, or by obstacle and axis."""
    given: dict[str, str] = {}
    for option in options:
        name, equals, values = option.partition("=")
        if not equals:
            raise ProblemError(f"{key} {option}: is not {what}")
        if name.strip() in given:
            kind = "chamber " if key != "--move" else ""
            raise ProblemError(f'{key} {option}: {kind}"{name.strip()}" is given twice; leave one of them out')
        given[name.strip()] = values
    return given


def progress_bar(console: Console, total: int) -> Progress:
    """A progress bar below the rows; none if the console is not a terminal."""
    columns = (BarColumn(), MofNCompleteColumn(), TextColumn("steps,"), TimeElapsedColumn(), TextColumn("left"))
    progress = Progress(*columns, TimeRemainingColumn(), console=console, transient=True)
    progress.disable = not console.is_terminal
    progress.add_task("", total=total)
    return progress


def made_folders(option: str, path: Path | None) -> list[Path]:
    """Make the folder of a file, and return it if it is new.

    Raises
    ------
    ProblemError
        If the file cannot be written, before anything is computed.
    """
    if path is None:
        return []
    new = [] if path.parent.exists() else [path.parent]
    with writing(f"{option} {path}"):
        path.parent.mkdir(parents=True, exist_ok=True)
    if path.is_dir() or not os.access(path.parent, os.W_OK):
        wrong = "is a directory" if path.is_dir() else "its folder cannot be written to"
        raise ProblemError(f"{option} {path}: {wrong}; name another file")
    return new


def write_file(option: str, path: Path | None, text: str) -> None:
    if path is None:
        return
    with writing(f"{option} {path}"):
        atomic.write_bytes(path, text.encode())
