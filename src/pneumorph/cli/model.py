"""`pneumorph model` and `pneumorph workspace`: fast models of designs, and where tips can go."""

from __future__ import annotations

import csv
import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from pneumorph import atomic
from pneumorph.cli.reach import MISSED, pairs
from pneumorph.cli.source import design_of
from pneumorph.cli.trust import asking
from pneumorph.errors import ProblemError, writing
from pneumorph.interface.fast_model import build_model, read_model
from pneumorph.interface.workspace import narrowed, workspace_of
from pneumorph.problem.components import MOTIONS
from pneumorph.surrogate.workspace import Workspace


def model(
    source: Path,
    out: Path | None,
    bounds: Sequence[str],
    tolerance: str,
    sections: int,
    most: int,
    check: Path | None,
    task: str | None,
    number: int | None,
    trust: bool,
    force: str | None = None,
    gravity: bool = False,
    workers: int = 1,
) -> int:
    """Build a model, or check one; the exit status is 3 where it is not as good as asked for.

    Parameters
    ----------
    source : Path
        A run directory or a problem file.
    out : Path or None
        The file.
    bounds : sequence of "name=value"
    tolerance : str
        "0.5 %" of ranges.
    sections, most : int
        Number of sections that are modelled, and of states that may be solved.
    check : Path or None
        A model to be checked, in place of a new one.
    task : str or None
        Whose loads act; by default the first.
    number : int or None
        Of a run's design, by default the last.
    trust : bool
        Whether code in the problem file is trusted.
    force, gravity : str or None, bool
        Loads that vary too: the largest component of the force on the tip, and the direction of gravity.
    workers : int
        Processes that solve states.

    Raises
    ------
    ProblemError
        If an option, a file or the problem has a mistake.
    ComputationError
        If there is no stable equilibrium within the bounds, or the body cannot be meshed.
    """
    given, largest = pairs(bounds, "A=0:60kPa"), _per_cent(tolerance)
    design = design_of(source, number, asking(trust))
    if check is not None:
        checked = design.check_model(check, task)
        print(checked)
        return 0 if checked.good else MISSED
    path = out or (source / "model.npz" if source.is_dir() else source.with_suffix(".npz"))
    with writing(f"--out {path}"):
        path.parent.mkdir(parents=True, exist_ok=True)
    found = build_model(design.explorer(task), path, given, largest, sections, most, print, force, gravity, workers)
    print(found)
    print(f"written to {path}")
    return 0 if found.good else MISSED


def workspace(path: Path, bounds: Sequence[str], points: int, table: Path | None, picture: Path | None) -> None:
    """Print and draw where the tip can go.

    Parameters
    ----------
    path : Path
        Of a model.
    bounds : sequence of "name=value"
        Narrower than those of the model.
    points : int
        Number of poses.
    table, picture : Path or None
        Files to write.

    Raises
    ------
    ProblemError
        If the file is no model, or an option has a mistake.
    """
    fast = read_model(path)
    found = workspace_of(fast, narrowed(fast, pairs(bounds, "A=0:60kPa")), points)
    print(found)
    if table is not None:
        with writing(f"--csv {table}"):
            atomic.write_bytes(table, _table(found).encode())
        print(f"written to {table}")
    if picture is not None:
        from pneumorph.output.workspace import draw_workspace

        with writing(f"--png {picture}"):
            draw_workspace(found, picture)
        print(f"written to {picture}")


def _per_cent(text: str) -> float:
    try:
        return float(text.strip().removesuffix("%")) / 100.0
    except ValueError:
        raise ProblemError(f'--tolerance: "{text}" is no percentage; write "0.5 %"') from None


def _table(found: Workspace) -> str:
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    titles = [f"{name} ({'mm' if number < 3 else 'deg'})" for number, name in enumerate(MOTIONS)]
    pressures = [f"pressure {name} (kPa)" for name in found.chambers]
    writer.writerow([*pressures, *titles, "finest (mm/kPa)", "softest (N/mm)", "stiffest (N/mm)"])
    motions = found.motions * np.where(np.arange(6) < 3, 1.0, np.degrees(1.0))
    columns = [1e3 * found.pressures, motions, 1e-3 * found.finest[:, None], found.stiffness[:, [0, -1]]]
    for row in np.hstack(columns):
        writer.writerow([f"{value:.6g}" for value in row])
    return text.getvalue()
