"""`pneumorph calibrate`: the rubber, walls and pressures of a casting from a measured curve."""

from __future__ import annotations

import shlex
from collections.abc import Sequence
from pathlib import Path

from pneumorph import atomic
from pneumorph.cli.source import design_of
from pneumorph.cli.trust import asking
from pneumorph.errors import ProblemError
from pneumorph.interface.calibration import require_parameters
from pneumorph.problem.measured import read_measured


def calibrate(
    source: Path,
    measured: Path,
    fit: str,
    number: int | None,
    task: str | None,
    block: Sequence[str],
    out: Path | None,
    trust: bool,
) -> None:
    """Fit a design, or the start of a problem file, to a measured curve, and print both.

    Parameters
    ----------
    source : Path
        A run directory or a problem file.
    measured : Path
        The file of the curve.
    fit : str
        Names of what is fitted, separated by commas.
    number : int or None
        Of a run's design, by default the last.
    task : str or None
        Whose loads act, by default the first.
    block : sequence of str
        Motions of the plate that were held.
    out : Path or None
        A problem file to write, with the rubber that was found.
    trust : bool
        Whether code in the problem file is trusted.

    Raises
    ------
    ProblemError
        If an option, the file or the problem has a mistake.
    ComputationError
        If a state is not found, or the curve does not determine what is fitted.
    """
    if out is not None and not out.parent.is_dir():
        raise ProblemError(f"--out: there is no folder {out.parent}; make it first")
    names = [name.strip() for name in fit.split(",") if name.strip()]
    # Before the body is read and made, which takes longer.
    require_parameters(names)
    read_measured(measured)
    fitted = design_of(source, number, asking(trust)).calibrate(measured, names, task, block)
    print(fitted)
    if out is not None:
        atomic.write_bytes(out, fitted.problem.to_toml().encode())
        print(f"written to {out}; design with this rubber: pneumorph design {shlex.quote(str(out))}")
