"""Run the design loop to its end and store its designs in a run directory."""

from __future__ import annotations

import contextlib
import platform
import sys
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from importlib.metadata import PackageNotFoundError, version

import pneumorph
from pneumorph.errors import ComputationError, NotWritten
from pneumorph.optimize import DesignAccepted, Event, Finished, design
from pneumorph.optimize.settings import LoopSettings
from pneumorph.problem import Problem
from pneumorph.results import FineResult, HistoryEntry, Motion, MotionRates, RunResult
from pneumorph.results.chambers import chamber_uses
from pneumorph.results.targets import targets_reached
from pneumorph.run import RunDirectory, StoredDesign, locked


@dataclass(frozen=True)
class Outcome:
    """How a run ended.

    Attributes
    ----------
    reason : why it ended, as a sentence.
    completed : whether the loop ended by itself, and did not fail.
    stable : {task: bool}
        If completed, whether the last state of each task is stable, against all motions of the whole body.
    rates : {task: MotionRates}
        If completed, of the last states.
    margins : {task: float}
        If completed, of those that are near ballooning.
    followed : {task: float}
        If completed, of those of which that is not known.
    finer : {task: FineResult}
        If completed, see `RunResult`.
    """

    reason: str
    completed: bool
    stable: Mapping[str, bool] = field(default_factory=dict)
    rates: Mapping[str, MotionRates] = field(default_factory=dict)
    margins: Mapping[str, float] = field(default_factory=dict)
    followed: Mapping[str, float] = field(default_factory=dict)
    finer: Mapping[str, FineResult] = field(default_factory=dict)


def complete(run: RunDirectory, show: Callable[[Event], None], settings: LoopSettings | None = None) -> Outcome:
    """Run the design loop, from the checkpoint if there is one, and write ``result.json`` at its end.

    Parameters
    ----------
    run : the directory.
    show : called with every event, for an accepted design once it is on disk.
    settings : of the loop, by default the usual ones.

    Raises
    ------
    ComputationError
        If the loop fails; ``result.json`` then has the results so far. If the directory cannot be written, NotWritten.
    ProblemError
        If another run goes on in the directory, or what is in it is damaged.
    """
    with contextlib.ExitStack() as stack:
        try:
            stack.enter_context(locked(run.path))
        except OSError as error:
            raise NotWritten(f"{run.path}: cannot be written ({error.strerror}); make it writable") from None
        return _complete(run, show, settings)


def _complete(run: RunDirectory, show: Callable[[Event], None], settings: LoopSettings | None) -> Outcome:
    state, begun = run.resumable(), False
    begin = run.begun_from() if state is None else None
    try:
        for event in design(run.problem, state, settings, begin):
            if not begun:
                # Only now is it sure that the state can be resumed from: what is refused changes nothing.
                run.begin()
                begun = True
            if isinstance(event, DesignAccepted):
                run.record(event.entry, StoredDesign.of(event.body, event.pressures), event.fields, event.state)
            if isinstance(event, Finished):
                run.write_fields(event.iteration, event.fields)
                run.amend(event.finer)
            show(event)
            if isinstance(event, Finished):
                outcome = Outcome(
                    event.reason, True, event.stable, event.rates, event.margins, event.followed, event.finer
                )
                _conclude(run, outcome)
                return outcome
    except NotWritten:
        raise
    except ComputationError as error:
        if begun:
            _conclude(run, Outcome(f"the computation failed: {error}", completed=False))
        raise
    raise ComputationError("the design loop ended without a reason")


def _conclude(run: RunDirectory, outcome: Outcome) -> None:
    history = run.history()
    if history:
        run.write_result(result(run.problem, history, outcome))


def result(problem: Problem, history: list[HistoryEntry], outcome: Outcome) -> RunResult:
    """The contents of ``result.json``."""
    last = history[-1]
    motions = {task.name: task.objective.achieved(last.tasks[task.name]) for task in problem.task}
    return RunResult(
        title=problem.title,
        completed=outcome.completed,
        reason=outcome.reason,
        iterations=last.iteration,
        # Every design is better than its predecessor.
        best=last.iteration,
        objective=last.objective,
        optimality=last.optimality,
        motions={name: Motion(motion.value, motion.unit) for name, motion in motions.items()},
        tasks={name: replace(done, stable=outcome.stable.get(name, done.stable)) for name, done in last.tasks.items()},
        limits=last.limits,
        held=last.held,
        seconds={phase: sum(entry.seconds[phase] for entry in history) for phase in last.seconds},
        peak_memory=peak_memory(),
        versions={
            "pneumorph": pneumorph.__version__,
            "python": platform.python_version(),
            **{name: _version(name) for name in ("numpy", "scipy", "jax", "netgen-mesher")},
        },
        reinforcements=last.reinforcements,
        rates=outcome.rates,
        margins=outcome.margins,
        followed=outcome.followed,
        finer=outcome.finer,
        chambers=chamber_uses(problem, last.tasks, outcome.rates) if outcome.completed else {},
        targets={name: each.value for name, each in targets_reached(problem, history).items()},
    )


def _version(package: str) -> str | None:
    try:
        return version(package)
    except PackageNotFoundError:
        return None


def peak_memory() -> float | None:
    """Peak memory of this process in MB; None if the system does not report it."""
    try:
        import resource
    except ImportError:
        return None
    used = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    return used / (1e6 if sys.platform == "darwin" else 1e3)
