"""`pneumorph simulate --supply`: pressures and motions of a design over time."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.text import Text

from pneumorph import compiling
from pneumorph.analysis.supply import Supplied
from pneumorph.cli.simulate import PRESSURES, given_values, made_folders, progress_bar, write_file
from pneumorph.cli.source import design_of
from pneumorph.cli.steps import Rows
from pneumorph.cli.trust import asking
from pneumorph.doing import announce, doing, said
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.interface.over_time import OverTime
from pneumorph.interrupts import Interrupted, deferred

SUPPLY = "a chamber with its supply; write A=100kPa or 'A=0kPa@0s,100kPa@0.5s'"


def over_time(
    source: Path,
    supply: list[str],
    tube: list[str],
    times: str | None,
    pressures: list[str],
    others: Mapping[str, Any],
    files: Mapping[str, Path | None],
    number: int | None,
    task: str | None,
    quiet: bool,
    trust: bool,
) -> None:
    """Fill the starting body of a problem file or a design of a run from a supply.

    Parameters
    ----------
    source : Path
        A problem file or a run directory.
    supply : list of "CHAMBER=100kPa" or "CHAMBER=0kPa@0s,100kPa@0.5s"
    tube : list of "2mm x 1m" or "CHAMBER=2mm x 1m"
    times : "0:2:0.05s" or None
    pressures : list of "CHAMBER=30kPa"
        Of other chambers, or at the first moment.
    others : {option: its value}
        Options that are not possible with a supply.
    files : {"--json", "--csv", "--png": Path or None}
        Output files.
    number : int or None
        Of a run's design, by default the last.
    task : str or None
        Whose loads act; by default the first.
    quiet : bool
        Whether no moments are printed.
    trust : bool
        Whether code in the problem file is trusted.

    Raises
    ------
    ProblemError
        If an option or the problem has a mistake.
    ComputationError
        If a moment has no equilibrium.
    """
    if quiet:
        compiling.announce(None)
        announce(None)
    if not supply or not tube or times is None:
        missing = "--supply" if not supply else "--tube" if not tube else "--times"
        raise ProblemError(f"{missing}: is missing; write e.g. --supply A=100kPa --tube '2mm x 1m' --times 0:2:0.05s")
    for option, value in others.items():
        if value:
            raise ProblemError(f"{option}: is not possible with --supply, from which pressures follow; leave one out")
    given, constant = given_values("--supply", supply, SUPPLY), given_values("--pressure", pressures, PRESSURES)
    alike = len(tube) == 1 and "=" not in tube[0]
    tubes = tube[0] if alike else given_values("--tube", tube, "a chamber with its tube; write 'A=2mm x 1m'")
    design = design_of(source, number, asking(trust))
    console = Console(quiet=quiet)
    for option, path in files.items():
        for folder in made_folders(option, path):
            console.print(Text(f"the folder {folder} is made for {path.name if path else ''}"), soft_wrap=True)
    own, found, count = design.prepare_over_time(given, tubes, times, constant, task)
    rows, moments = Rows({each.name: each for each in design.problem.task}), list[Supplied]()
    stop: Interrupted | None = None
    try:
        with deferred(), doing("filling") as far, progress_bar(console, count) as progress:
            for moment in found:
                moments.append(moment)
                for line in rows.lines(moment.step):
                    console.print(line, soft_wrap=True)
                far(f"moment {len(moments)} of {count}")
                said()
                progress.advance(progress.task_ids[0])
    except Interrupted as error:
        stop = error
    filled = OverTime(design.problem.title, own, moments)
    if moments:
        for sentence in filled.summary():
            console.print(Text(sentence), soft_wrap=True)
        write_file("--json", files["--json"], f"{json.dumps(filled.to_json(), indent=2, allow_nan=False)}\n")
        write_file("--csv", files["--csv"], filled.to_csv())
        if files["--png"] is not None and moments[0].step.converged:
            filled.plot(files["--png"])
    if stop is not None:
        raise stop.saying(f"stopped after {len(moments)} of {count} moments")
    if not moments[-1].step.converged:
        raise ComputationError(f"at {moments[-1].step.time:g} s: {moments[-1].step.reason}")
