"""`pneumorph tolerance`: how far a design's motions scatter when it is made."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path

from pneumorph import atomic
from pneumorph.errors import ProblemError
from pneumorph.problem.deviations import read_deviations


def tolerance(
    source: Path,
    given: Mapping[str, str | None],
    number: int | None,
    task: str | None,
    out: Path | None,
    picture: Path | None,
    trust: bool,
) -> None:
    """Print tables of the scatter of a design, or of the start of a problem file.

    Parameters
    ----------
    source : Path
        A run directory or a problem file.
    given : {tolerance: text or None}
        Tolerances other than the usual ones.
    number : int or None
        Of a run's design, by default the last.
    task : str or None
        The only one.
    out : Path or None
        A file for all figures as JSON.
    picture : Path or None
        A file for the picture of what more rubber at each place does.
    trust : bool
        Whether code in the problem file is trusted.

    Raises
    ------
    ProblemError
        If an option or the problem has a mistake.
    ComputationError
        If the whole body cannot be meshed or has no equilibrium.
    """
    if out is not None and not out.parent.is_dir():
        raise ProblemError(f"--json: there is no folder {out.parent}; make it first")
    tolerances = {name: text for name, text in given.items() if text is not None}
    # Before anything else is loaded and the body is made, which takes longer.
    read_deviations(tolerances)
    from pneumorph.cli.source import design_of
    from pneumorph.cli.trust import asking
    from pneumorph.interface.drawing import check_format
    from pneumorph.output.figures import PLOTS

    if picture is not None:
        check_format("--picture", picture.suffix.removeprefix(".").lower(), PLOTS)
    design = design_of(source, number, asking(trust))
    report = design.tolerance(task=task, **tolerances)
    print(report)
    if out is not None:
        atomic.write_bytes(out, f"{json.dumps(report.to_json(), indent=2, allow_nan=False)}\n".encode())
        print(f"written to {out}")
    if picture is not None:
        print(f"drawn in {report.picture(picture)}")
