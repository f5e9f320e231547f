"""`pneumorph verify`: compare the mechanics with closed forms, balances and other solvers."""

from __future__ import annotations

import platform
from collections.abc import Iterator, Mapping
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from rich.console import Console
from rich.markup import escape
from rich.progress import Progress
from rich.table import Table
from rich.text import Text

from pneumorph import atomic
from pneumorph.doing import doing
from pneumorph.errors import ComputationError, ProblemError, writing
from pneumorph.verify import Case, Unavailable, Verdict, calculix, cases

PACKAGES = ("pneumorph", "jax", "numpy", "scipy", "netgen-mesher", "ngsolve")

HEADINGS = ("case", "quantity", "reference", "ours", "error", "allowed", "verdict")

WIDTH = 160
"""Width of the table in a file, characters."""

Outcome = Verdict | Unavailable | ComputationError


def verify(only: list[str], write: Path | None) -> None:
    """Run the chosen cases, all by default, and print and write their table.

    Raises
    ------
    ProblemError
        If no case has one of the names.
    ComputationError
        If a case fails.
    """
    chosen = _chosen(cases(), only)
    console = Console()
    if not console.is_terminal:
        console.width = WIDTH
    outcomes: dict[str, list[Outcome]] = {}
    with Progress(console=console, transient=True) as progress:
        task = progress.add_task("", total=len(chosen))
        for case in chosen:
            progress.update(task, description=case.name)
            with doing(case.name):
                outcomes[case.name] = list(_outcomes(case))
            progress.advance(task)
    console.print(_table(outcomes))
    if write is not None:
        _write(write, markdown(chosen, outcomes))
    failed = [name for name, results in outcomes.items() if any(_verdict(outcome) == "FAILED" for outcome in results)]
    if failed:
        raise ComputationError(f"{len(failed)} of {len(chosen)} cases failed: {', '.join(failed)}")


def _chosen(known: tuple[Case, ...], names: list[str]) -> tuple[Case, ...]:
    for name in names:
        if not any(name.lower() in case.name.lower() for case in known):
            every = "; ".join(case.name for case in known)
            raise ProblemError(f'--only: no case has "{name}" in its name; the cases are {every}')
    return tuple(case for case in known if not names or any(name.lower() in case.name.lower() for name in names))


def _outcomes(case: Case) -> Iterator[Outcome]:
    try:
        yield from case.verdicts()
    except (Unavailable, ComputationError) as reason:
        yield reason


def _verdict(outcome: Outcome) -> str:
    match outcome:
        case Verdict():
            return "passed" if outcome.passed else "FAILED"
        case Unavailable():
            return "skipped"
        case _:
            return "FAILED"


def _cells(outcome: Outcome) -> list[str]:
    """Quantity, reference, ours, error, allowed error, verdict."""
    if not isinstance(outcome, Verdict):
        return [str(outcome), "", "", "", "", _verdict(outcome)]
    return [
        outcome.quantity,
        f"{outcome.reference:.8g}",
        f"{outcome.ours:.8g}",
        f"{outcome.error:.1e}",
        f"{outcome.tolerance:.0e}",
        _verdict(outcome),
    ]


def _table(outcomes: Mapping[str, list[Outcome]]) -> Table:
    table = Table(*HEADINGS)
    styles = {"passed": "green", "skipped": "yellow", "FAILED": "bold red"}
    for name, results in outcomes.items():
        for index, outcome in enumerate(results):
            *cells, verdict = _cells(outcome)
            table.add_row("" if index else name, *map(escape, cells), Text(verdict, style=styles[verdict]))
        table.add_section()
    return table


def markdown(chosen: tuple[Case, ...], outcomes: Mapping[str, list[Outcome]]) -> str:
    """The page in Markdown: the table, the sources of the references, and the versions of the packages."""
    lines = [
        "# Verification",
        "",
        "Written by `pneumorph verify --write docs/verification.md`. An error is relative where the quantity has no",
        "natural zero, and absolute elsewhere. [Theory](theory/verification.md) gives the purpose of each case.",
        "",
        f"| {' | '.join(HEADINGS)} |",
        f"|{' --- |' * len(HEADINGS)}",
    ]
    for name, results in outcomes.items():
        for index, outcome in enumerate(results):
            lines.append(f"| {' | '.join(['' if index else name, *_cells(outcome)])} |")
    lines += ["", "## References", ""]
    lines += [f"- {case.name}: {case.source}." for case in chosen]
    lines += ["", "## Versions", ""]
    lines += [f"- {name} {number}" for name, number in versions().items()]
    return "\n".join([*lines, ""])


def versions() -> dict[str, str]:
    """Versions of the packages and programs that the numbers depend on, where they are installed."""
    installed = {"Python": platform.python_version()}
    for name in PACKAGES:
        try:
            installed[name] = version(name)
        except PackageNotFoundError:
            continue
    if number := calculix.version():
        installed["CalculiX"] = number
    return installed


def _write(path: Path, text: str) -> None:
    with writing(f"--write {path}"):
        path.parent.mkdir(parents=True, exist_ok=True)
        atomic.write_bytes(path, text.encode())
