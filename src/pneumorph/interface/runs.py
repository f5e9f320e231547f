"""Run the design loop: as a run in a directory, or design by design in memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

from pneumorph import run
from pneumorph.analysis.sized import sized
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import space_of
from pneumorph.interface.design import Design
from pneumorph.objective import build_objectives
from pneumorph.optimize import DesignAccepted, Event
from pneumorph.optimize import design as events_of
from pneumorph.problem import Problem, Trust, admit, codes_of, load
from pneumorph.problem.designed import starting_from
from pneumorph.results import HistoryEntry, RunResult
from pneumorph.run.complete import Outcome, complete

ROUNDING = 1e-6
"""Largest distance in mm of a stored design from the shapes of its problem; designs as they are stored have 1e-12."""


@dataclass(frozen=True, repr=False)
class Run:
    """A run of a problem in a directory.

    Attributes
    ----------
    directory : RunDirectory
        Its files.

    Examples
    --------
    >>> import pneumorph as pm
    >>> run = pm.open_run("runs/small")
    >>> [entry.iteration for entry in run.history]
    [0, 1, 2]
    >>> run.best.iteration, run.result.completed
    (2, True)
    """

    directory: run.RunDirectory

    @property
    def path(self) -> Path:
        """The directory."""
        return self.directory.path

    @property
    def problem(self) -> Problem:
        """The problem as run."""
        return self.directory.problem

    @property
    def history(self) -> list[HistoryEntry]:
        """Every accepted design, the start first."""
        return self.directory.history()

    @property
    def result(self) -> RunResult | None:
        """How the run ended; None if it has not ended."""
        return self.directory.result()

    @property
    def latest(self) -> int | None:
        """Number of the last design; None before the first."""
        return self.directory.latest()

    @property
    def best(self) -> Design:
        """The best design, which is the last: each is better than its predecessor.

        Raises
        ------
        ProblemError
            If there is none yet.
        """
        return self.design()

    def design(self, iteration: int | None = None) -> Design:
        """A design by its number, by default the last.

        Raises
        ------
        ProblemError
            If there is no design with this number, or it is not one of the run's problem.
        """
        latest = self.latest
        if latest is None:
            raise ProblemError(f"{self.path}: has no finished design yet; run pneumorph design first")
        number = latest if iteration is None else iteration
        if not 0 <= number <= latest:
            raise ProblemError(f"design {number}: {self.path} has designs 0 to {latest} only; use one of them")
        stored = self.directory.load_design(number)
        entry = next((entry for entry in self.history if entry.iteration == number), None)
        if entry is None:
            raise ProblemError(f"design {number}: is not in {self.path / 'history.jsonl'}; use another one")
        body = stored.body(self.problem)
        if (departure := space_of(self.problem).departure(body)) > ROUNDING:
            raise ProblemError(
                f"design {number} of {self.path}: its control points are up to {departure:.2g} mm from where the "
                "symmetry, ends and regions of the problem have them; run the design again"
            )
        problem = starting_from(self.problem, entry.reinforcements)
        return Design(problem, body, stored.pressures, number, entry, self.directory.fields(number))

    def __repr__(self) -> str:
        from pneumorph.interface.text import run_text

        return run_text(self.problem, self.path, self.history, self.result)

    def _repr_html_(self) -> str:
        from pneumorph.interface.html import run_html

        return run_html(self.problem, self.problem.title or str(self.path), self.history, self.result)

    def report(self, path: str | Path | None = None, model: str | Path | None = None) -> Path:
        """Write the page of the run: one file to open in a browser, which needs no network. Nothing is solved for it.

        Parameters
        ----------
        path : Path, by default ``report.html`` in the run directory
            Where to; a file of this name is replaced.
        model : Path, by default ``model.npz`` in the run directory, if it is there
            A fast model of a design of the run, by which pressures are set on the page.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ProblemError
            When there is no finished design yet, the model is none of the run, or the file cannot be written.

        Examples
        --------
        >>> import pneumorph as pm
        >>> pm.open_run("runs/small").report().name
        'report.html'
        """
        # Loads the libraries that draw.
        from pneumorph.output.report import write_report

        return write_report(self.directory, *(None if each is None else Path(each) for each in (path, model)))

    def draw(
        self,
        picture: str = "body",
        path: str | Path | None = None,
        design: int | None = None,
        cut: Literal["yz", "xz", "xy", "none"] | None = None,
        at: Any = None,
        task: str | None = None,
        format: str | None = None,
    ) -> Path:
        """Draw one picture of the run, which may be still running or have been stopped.

        Parameters
        ----------
        picture : "body", "history", "profile", "shape", "pressures", "evolution" or "inflation"
            The last two move.
        path : by default in the folder ``pictures`` of the run, named by what it shows
            Where to; a file of this name is replaced.
        design : number of the design, by default the last; profile and shape compare the start with it.
        cut, at : as in `Design.plot`.
        task : the only task shown of body, shape or inflation; of the last two by default the first that fits.
        format : "png", "pdf" or "svg", by default "png"; "gif" for the pictures that move.

        Returns
        -------
        Path
            The file.

        Raises
        ------
        ProblemError
            If there is nothing of the kind to draw, an argument does not fit the picture, or the file cannot be
            written.
        ComputationError
            If this machine cannot draw off-screen, or the fields of a design, stored for the first and the last only,
            cannot be computed.

        Examples
        --------
        >>> import pneumorph as pm
        >>> pm.open_run("runs/small").draw("history", format="pdf").name
        'history.pdf'
        """
        # Loads the libraries that draw.
        from pneumorph.interface.pictures import RequestedPicture, draw

        asked = RequestedPicture(picture, design, cut, at, task, format)
        file = asked.file(self.path, None if path is None else Path(path))
        return draw(self.directory, self.design(design), asked, file)

    def complete(self, show: Callable[[Event], None] | None = None) -> Outcome:
        """Run the design loop to its end, from the last stored design.

        Parameters
        ----------
        show : called with every event of the loop, for an accepted design once it is on disk.

        Raises
        ------
        ComputationError
            If the loop fails; the designs so far are then stored.
        """
        return complete(self.directory, show or (lambda event: None))


def design(
    problem: Problem | str | Path,
    out: str | Path,
    resume: bool = False,
    show: Callable[[Event], None] | None = None,
    trust: Trust = False,
    begin: str | Path | None = None,
) -> Run:
    """Design a body for a problem, and store the run in a directory.

    Parameters
    ----------
    problem : Problem, or the path of a problem file
    out : Path
        The run directory.
    resume : bool
        Resume an interrupted run of this problem; without one, start a new run.
    show : called with every event of the design loop.
    trust : bool
        Whether code in the problem file is trusted; see `load`.
    begin : Path
        The directory of a run of the same body, with whose last design this one begins; what its tasks ask for, limits
        on motions and the table [optimizer] may be others.

    Raises
    ------
    ProblemError
        If the problem has a mistake, or the directory contains something else, or another run goes on in it.
    ComputationError
        If the loop fails; the designs so far are then stored.

    Examples
    --------
    >>> import pneumorph as pm
    >>> run = pm.design("examples/small.toml", out="runs/small", resume=True)
    >>> run.history[-1].tasks["extend"].translation[2] > run.history[0].tasks["extend"].translation[2]  # mm
    True
    """
    prepared = prepare_run(problem, out, resume, trust, begin)
    prepared.complete(show)
    return prepared


def prepare_run(
    problem: Problem | str | Path,
    out: str | Path,
    resume: bool = False,
    trust: Trust = False,
    begin: str | Path | None = None,
) -> Run:
    """Make a new run of a problem in a directory, or prepare one for resuming.

    Parameters
    ----------
    problem : Problem, or the path of a problem file
    out : the run directory.
    resume : whether an interrupted run of this problem may be in it.
    trust : whether code in the problem file is trusted; see `load`.
    begin : the directory of a run with whose last design it begins; see `design`.

    Raises
    ------
    ProblemError
        If the problem has a mistake, or the directory contains something else.
    """
    asked = _problem(problem, trust)
    # A mistake in a target is reported before the directory is made.
    build_objectives(asked)
    return Run((run.resume if resume else run.create)(out, _with_size(asked, Path(out) if resume else None), begin))


def _with_size(problem: Problem, stored: Path | None) -> Problem:
    """A problem with the size of elements that `mesh.error` asks for; that of a run that is stored, if there is one."""
    if problem.mesh.error is None:
        return problem
    if stored is not None and (stored / "problem.toml").exists():
        begun = run.open_run(stored).problem
        if begun.mesh.error == problem.mesh.error:
            return problem.with_changes({"mesh.size": f"{begun.mesh.size!r} mm"})
    return sized(problem)


def designs(problem: Problem | str | Path, trust: Trust = False) -> Iterator[Design]:
    """Yield every accepted design for a problem as it is found, the start first; nothing is written.

    For `trust` see `load`.

    Raises
    ------
    ComputationError
        If the loop fails.

    Examples
    --------
    >>> import pneumorph as pm
    >>> for design in pm.designs("examples/small.toml"):
    ...     if design.iteration == 1:
    ...         break
    >>> design.entry.held
    True
    """
    asked = _with_size(_problem(problem, trust), None)
    for event in events_of(asked):
        if isinstance(event, DesignAccepted):
            problem = starting_from(asked, event.entry.reinforcements)
            yield Design(problem, event.body, event.pressures, event.iteration, event.entry, event.fields)


def open_run(path: str | Path, trust: Trust = False) -> Run:
    """Open a run for reading; nothing in it is changed.

    Parameters
    ----------
    path : Path
    trust : bool
        Whether code in its problem is trusted; see `load`. Not needed for runs that were made here.

    Raises
    ------
    ProblemError
        If the directory does not contain a run, or one with code that is not trusted.

    Examples
    --------
    >>> import pneumorph as pm
    >>> pm.open_run("runs/small").problem.title
    'Small linear actuator'
    """
    opened = Run(run.open_run(path))
    admit(codes_of(opened.problem), str(path), trust)
    return opened


def _problem(given: Problem | str | Path, trust: Trust) -> Problem:
    return given if isinstance(given, Problem) else load(given, trust)
