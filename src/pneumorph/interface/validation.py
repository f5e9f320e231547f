"""Predictions beside measurements: the published ones of the package, or a curve of a body of one's own."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from pneumorph import atomic
from pneumorph.analysis.tolerances import of_sources
from pneumorph.errors import ProblemError, writing
from pneumorph.geometry import Body
from pneumorph.interface.calibration import as_measured, curve_in
from pneumorph.interface.tolerance import read_tolerances
from pneumorph.output.compared import compared_figure, csv_lines, grouped, markdown, points, row
from pneumorph.output.figures import save
from pneumorph.problem import Problem, Task
from pneumorph.validation import BODIES, Comparison, compared
from pneumorph.validation import published as predict_published


@dataclass(frozen=True, eq=False, repr=False)
class Validation:
    """Predicted curves beside measured ones.

    Attributes
    ----------
    comparisons : tuple of Comparison

    Examples
    --------
    >>> import pneumorph as pm
    >>> found = pm.validate("beam", quick=True)  # doctest: +SKIP
    >>> [round(each.normalised, 2) for each in found.comparisons]  # doctest: +SKIP
    [0.62, 0.01, 0.05]
    """

    comparisons: tuple[Comparison, ...]

    def write(self, folder: str | Path) -> list[Path]:
        """Write the table (``table.md``), all points (``points.csv``), and a picture of each body with each rubber.

        Raises
        ------
        ProblemError
            If a file cannot be written.
        """
        folder = Path(folder)
        table, values = folder / "table.md", folder / "points.csv"
        with writing(folder, "name another folder"):
            folder.mkdir(parents=True, exist_ok=True)
            atomic.write_bytes(table, markdown(self.comparisons).encode())
            atomic.write_bytes(values, ("\n".join(csv_lines(self.comparisons)) + "\n").encode())
            pictures = {folder / f"{name}.png": curves for name, curves in grouped(self.comparisons).items()}
            for path, curves in pictures.items():
                save(compared_figure(curves), path)
        return [table, values, *pictures]

    def __str__(self) -> str:
        return "\n".join(line for one in self.comparisons for line in lines(one))

    __repr__ = __str__


def lines(one: Comparison) -> list[str]:
    """What is printed of a comparison: its points, and how far they are apart."""
    body, rubber, quantity, counted, rms, share, _, _, within = row(one)
    head = f"{body}, {rubber}: {quantity}"
    if one.rms is None:
        return [f"{head}: {within}"]
    told = f"  root mean square of the differences: {rms}, {share} of the largest; points: {counted}"
    return [head, *points(one), told, f"  within two standard deviations of both: {within}"]


def validate(
    names: str | Iterable[str] = (), quick: bool = False, show: Callable[[Comparison], None] | None = None
) -> Validation:
    """Predict the measured bodies that come with the package.

    Parameters
    ----------
    names : some of "balloon", "beam" and "disc"; by default all.
    quick : with large elements and steps.
    show : called with every comparison as soon as it is known.

    Raises
    ------
    ProblemError
        If a name is unknown.
    ComputationError
        If a state is not found that a comparison cannot do without.

    Examples
    --------
    >>> import pneumorph as pm
    >>> found = pm.validate("beam", quick=True)
    >>> len(found.comparisons)
    3
    """
    chosen = [names] if isinstance(names, str) else list(names)
    require_bodies(chosen)
    found = []
    for one in predict_published(chosen or list(BODIES), quick):
        found.append(one)
        if show is not None:
            show(one)
    return Validation(tuple(found))


def require_bodies(names: Iterable[str]) -> None:
    """Refuse names of bodies whose measurements do not come with the package."""
    for name in names:
        if name not in BODIES:
            raise ProblemError(
                f'"{name}" is not a measured body of the package; use {", ".join(BODIES)}, or give a run or a problem '
                "file with --measured curve.csv"
            )


def validated(
    problem: Problem, body: Body, task: Task, pressures: Mapping[str, float], path: Path, given: Mapping[str, Any]
) -> Validation:
    """The curve in a file beside the prediction of a body.

    Parameters
    ----------
    problem, body : the body is one of the problem's.
    task : whose loads act.
    pressures : {chamber: MPa} of chambers without a column.
    path : the file.
    given : tolerances other than the usual ones, as text, see `read_tolerances`.

    Raises
    ------
    ProblemError
        If the file has no curve, a tolerance is not one, or pressures of the body are not given.
    ComputationError
        If a state is not found.
    """
    tolerances = of_sources(read_tolerances(given), problem, rubbers="rubber" not in given)
    measured, curve = curve_in(path, problem, pressures)
    held = as_measured(problem, task, measured.quantity)
    return Validation((compared(problem, body, held, curve, list(measured.pressures), tolerances),))
