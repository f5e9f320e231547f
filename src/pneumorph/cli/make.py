"""`pneumorph make`: a design of a run as files for the workshop."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Annotated, Any

import typer
from rich.console import Console
from rich.table import Table

from pneumorph import units
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry import Body
from pneumorph.run import open_run


def make(
    run: Annotated[Path, typer.Argument(help="The run directory.")],
    design: Annotated[int | None, typer.Option(min=0, help="This design instead of the last.")] = None,
    out: Annotated[Path | None, typer.Option(help="Where the files go; by default make in the run directory.")] = None,
    chord: Annotated[str, typer.Option(help="Most distance of the triangles in 3MF and STL from the body.")] = (
        "0.02 mm"
    ),
) -> None:
    """Write a design as exact CAD (STEP) and as triangles (3MF, STL), and check the files."""
    began = time.perf_counter()
    allowed = _chord(chord)
    body = _body(run, design)
    folder = out or run / "make"
    try:
        # Here, because the libraries come with an extra and take a second to load.
        from pneumorph.make import make as made_of
    except ModuleNotFoundError as error:
        raise ProblemError(str(error)) from None
    try:
        made = made_of(body, folder, allowed)
    except OSError as error:
        raise ProblemError(f"--out {folder}: cannot be written ({error.strerror or error}); name another") from None
    console = Console()
    console.print(_table(made.checks))
    names = ", ".join(path.name for path in made.files)
    print(f"in {folder}: {names}; {time.perf_counter() - began:.1f} s")
    if made.failed:
        failed = "; ".join(f"{check.what} of {check.file}" for check in made.failed)
        raise ComputationError(f"the files in {folder} are not what they should be: {failed}")


def _chord(text: str) -> float:
    """The chord error in mm."""
    try:
        chord = units.parse(text, units.LENGTH)
    except ValueError as error:
        raise ProblemError(f"--chord: {error}") from None
    if not chord > 0.0:
        raise ProblemError(f"--chord: {text} is not above zero; take e.g. 0.02mm")
    return chord


def _body(path: Path, number: int | None) -> Body:
    """A design's body, the last's by default."""
    run = open_run(path)
    latest = run.latest()
    if latest is None:
        raise ProblemError(f"{path}: there is no finished design in it yet; run pneumorph design first")
    if number is not None and number > latest:
        raise ProblemError(f"--design: {path} has designs 0 to {latest} only; take one of them")
    return run.load_design(latest if number is None else number).body(run.problem)


def _table(checks: Any) -> Table:
    table = Table("file", "check", "found", "allowed", "", box=None, header_style="bold")
    for check in checks:
        found, limit = (f"{value:.3g} {check.unit}".strip() for value in (check.value, check.limit))
        table.add_row(check.file, check.what, found, limit, "ok" if check.passed else "[red]FAILED[/red]")
    return table
