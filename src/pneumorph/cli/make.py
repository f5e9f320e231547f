"""`pneumorph make`: write a design of a run, and its mould, as files for fabrication."""

from __future__ import annotations

import time
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.table import Table

from pneumorph import extras, units
from pneumorph.atomic import make_folder
from pneumorph.cli.trust import asking
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.interface.runs import open_run


def make(run: Path, design: int | None, out: Path | None, chord: str, trust: bool) -> None:
    """Write the files of a design and print the results of their checks.

    Parameters
    ----------
    run : Path
        The run directory.
    design : int or None
        Number of the design, by default the last.
    out : Path or None
        Folder of the files; by default ``make`` in the run directory.
    chord : str
        Largest distance of triangles from the body, with its unit.
    trust : bool
        Whether code in the problem file is trusted.

    Raises
    ------
    ProblemError
        If an option has a mistake, a package is missing, or the folder cannot be written.
    ComputationError
        If a file fails one of its checks.
    """
    began = time.perf_counter()
    allowed = units.parse_positive("--chord", chord, units.LENGTH)
    chosen = open_run(run, asking(trust)).design(design)
    folder = out or run / "make"
    try:
        # First, since making takes a minute.
        if out is None:
            make_folder(folder)
        else:
            out.mkdir(parents=True, exist_ok=True)
        made = chosen.make(folder, allowed)
    except ModuleNotFoundError as error:
        raise ProblemError(str(error)) from None
    except OSError as error:
        raise ProblemError(f"--out {folder}: cannot be written ({error.strerror or error}); name another") from None
    console = Console()
    console.print(_table(made.checks))
    names = ", ".join(str(path.relative_to(folder)) for path in made.files)
    print(f"written to {folder}: {names}; {time.perf_counter() - began:.1f} s")
    if chosen.problem.solid is None and (words := extras.missing("pictures", "mould.png")):
        print(words)
    if made.failed:
        failed = "; ".join(f"{check.what} of {check.file}" for check in made.failed)
        raise ComputationError(f"the files in {folder} failed checks: {failed}")


def _table(checks: Any) -> Table:
    table = Table("file", "check", "found", "allowed", "", box=None, header_style="bold")
    for check in checks:
        shown, limit = (f"{value:.3g} {check.unit}".strip() for value in (check.value, check.limit))
        table.add_row(check.file, check.what, shown, limit, "ok" if check.passed else "[red]FAILED[/red]")
    return table
