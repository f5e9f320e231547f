"""`pneumorph validate`: predictions beside measurements."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.console import Console
from rich.text import Text

from pneumorph.cli.source import design_of
from pneumorph.cli.trust import asking
from pneumorph.doing import said
from pneumorph.errors import ProblemError
from pneumorph.interface.tolerance import read_tolerances
from pneumorph.interface.validation import Validation, lines, require_bodies
from pneumorph.interface.validation import validate as validate_published
from pneumorph.problem.measured import read_measured
from pneumorph.validation import Comparison


def validate(
    sources: Sequence[str],
    *,
    measured: Path | None,
    tolerances: Sequence[str],
    quick: bool,
    out: Path | None,
    number: int | None,
    task: str | None,
    trust: bool,
) -> None:
    """Print published measurements beside their predictions, or a curve beside the prediction of a design.

    Parameters
    ----------
    sources : sequence of str
        Names of measured bodies, all without one; with `measured` a run directory or a problem file.
    measured : Path or None
        The file of a curve.
    tolerances : sequence of "NAME=VALUE"
        Of the design, other than the usual ones.
    quick : bool
        Whether elements and steps of the published ones are large.
    out : Path or None
        A folder for table, points and pictures.
    number : int or None
        Of a run's design, by default the last.
    task : str or None
        Whose loads act, by default the first.
    trust : bool
        Whether code in the problem file is trusted.

    Raises
    ------
    ProblemError
        If an option, the file or the problem has a mistake.
    ComputationError
        If a state is not found.
    """
    console = Console()

    def show(one: Comparison) -> None:
        for line in lines(one):
            console.print(Text(line), soft_wrap=True)
        said()

    if measured is None:
        for option, given in (("--tolerance", tolerances), ("--task", task), ("--design", number)):
            if given:
                raise ProblemError(f"{option}: is for a curve of your own; add --measured curve.csv")
        require_bodies(sources)
        found = validate_published(sources, quick, show)
    else:
        found = _own(sources, measured, tolerances, quick, number, task, trust)
        show(found.comparisons[0])
    if out is not None:
        console.print(Text(f"written to {out}: {', '.join(path.name for path in found.write(out))}"), soft_wrap=True)


def _own(
    sources: Sequence[str],
    measured: Path,
    tolerances: Sequence[str],
    quick: bool,
    number: int | None,
    task: str | None,
    trust: bool,
) -> Validation:
    """The curve in a file beside the prediction of a design; parameters as of `validate`."""
    if len(sources) != 1:
        raise ProblemError("--measured: is a curve of one body; give one run directory or problem file")
    if quick:
        raise ProblemError("--quick: is for the published bodies; make mesh.size of the problem larger")
    given = {}
    for each in tolerances:
        name, equals, value = each.partition("=")
        if not equals:
            raise ProblemError(f'--tolerance {each}: is not a name with a value; write e.g. --tolerance "rubber=5 %"')
        given[name.strip()] = value.strip()
    # Before the body is read and made, which takes longer.
    read_tolerances(given)
    read_measured(measured)
    return design_of(Path(sources[0]), number, asking(trust)).validate(measured, task, **given)
