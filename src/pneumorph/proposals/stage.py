"""Candidates run for some designs, as far as time allows, and what has come of them."""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Protocol

from pneumorph.optimize.settings import LoopSettings
from pneumorph.optimize.stopping import TIME_IS_UP
from pneumorph.problem import Problem
from pneumorph.proposals.candidates import Candidate
from pneumorph.proposals.proposal import Plan, Proposal
from pneumorph.proposals.target import Target
from pneumorph.results import HistoryEntry
from pneumorph.results.targets import Reached, targets_reached
from pneumorph.run import RunDirectory, open_run
from pneumorph.study import Member
from pneumorph.study.members import MemberEnd, finished


class Runner(Protocol):
    """Runs members in their directories under a folder, drawn or not, and yields their ends as they come.

    Each is taken with the settings of its loop when it begins.
    """

    def __call__(self, members: Iterable[tuple[Member, LoopSettings]], drawn: bool) -> Iterator[MemberEnd]: ...


class Clock:
    """Time of a search: a third for the first comparison, and the rest in equal parts for what follows it."""

    def __init__(self, minutes: float, following: int):
        self._start, self._seconds, self._following = time.time(), 60.0 * minutes, following

    def until(self, part: int) -> float:
        """When the time of a part and of those before it is up (s, of `time.time`); 0 is the first comparison."""
        return self._start + (1.0 / 3.0 + 2.0 / 3.0 * part / self._following) * self._seconds

    def late(self, part: int) -> bool:
        """Whether it is."""
        return time.time() > self.until(part)


@dataclass(frozen=True)
class Search:
    """What a search consists of.

    Attributes
    ----------
    target, plan : what is asked, and how much is searched.
    out : its directory; every candidate has its run directory in it.
    runner, workers : what runs so many members at once.
    clock : its time.
    said : called with a line after each comparison.
    """

    target: Target
    plan: Plan
    out: Path
    runner: Runner
    workers: int
    clock: Clock
    said: Callable[[str], None]

    def run(self, members: Mapping[str, Member], part: int, last: bool = False) -> dict[str, str]:
        """The reasons for which members failed, empty for those that did not; those without time are missing.

        Those that have begun end with the design that they are at when their time is up. Of what is left of it, each
        may take its share: one whose states are hard to find does not keep others from being tried.

        Parameters
        ----------
        members : what is to be run.
        part : of the time, see `Clock`.
        last : whether they are those of the proposals.
        """
        if self.clock.late(part):
            return {}
        todo = {name: each for name, each in members.items() if not _done(self.out / name, each.problem)}
        ended = {name: "" for name in members if name not in todo}
        for end in self.runner(self._in_time(list(todo.values()), self.clock.until(part), last), last) if todo else ():
            ended[end.name] = "" if end.completed else end.reason
        return ended

    def _in_time(self, todo: Sequence[Member], until: float, last: bool) -> Iterator[tuple[Member, LoopSettings]]:
        """Members, each with its share of what is left of the time when it begins, as long as there is some."""
        for k, each in enumerate(todo):
            left = until - time.time()
            if left < 0.0:
                return
            share = left * min(1.0, self.workers / len(todo[k:]))
            yield each, LoopSettings(looked_at=last, until=until, seconds=share)

    def entries(self, name: str, designs: int) -> list[HistoryEntry]:
        """Those of so many designs of a run that satisfy the limits."""
        directory = self.out / name
        if not (directory / "problem.toml").exists():
            return []
        return [entry for entry in open_run(directory).history() if entry.iteration <= designs and entry.held]

    def standing(self, name: str, designs: int) -> HistoryEntry | None:
        """The last of so many designs of a run, if it satisfies the limits."""
        entries = self.entries(name, designs)
        return entries[-1] if entries else None

    def value(self, candidate: Candidate, designs: int) -> float:
        """The objective of the last of so many designs of a candidate; infinite where none satisfies the limits."""
        entry = self.standing(candidate.name, designs)
        return math.inf if entry is None else entry.objective

    def achieved(self, candidate: Candidate, designs: int) -> str:
        """What that design does, in words."""
        return Proposal(candidate, None, self.standing(candidate.name, designs), False).achieved

    def promise(self, candidate: Candidate, designs: int, coming: int) -> tuple[float, float]:
        """What a candidate is compared by: its objective after `coming` designs as its first ones promise, and now."""
        history = self.entries(candidate.name, designs)
        if not history:
            return math.inf, math.inf
        least = 0.0 if all(task.objective.aimed for task in candidate.posed.task) else -math.inf
        return promised([each.objective for each in history], coming - designs, least), history[-1].objective

    def ranked(self, going: Sequence[Candidate], designs: int, coming: int, by_layout: bool = False) -> list[Candidate]:
        """Candidates by what they promise, the best first.

        Parameters
        ----------
        going : the candidates.
        designs : that they have.
        coming : that the best of them will have.
        by_layout : whether the best of each layout come first, then the second best of each, and on.
        """
        values = {each.name: self.promise(each, designs, coming) for each in going}
        best = sorted(going, key=lambda each: values[each.name])
        if not by_layout:
            return best
        alike = {each.layout: [other.name for other in best if other.layout == each.layout] for each in best}
        # Sorting keeps the order of what is alike.
        return sorted(best, key=lambda each: (values[each.name][0] == math.inf, alike[each.layout].index(each.name)))

    def behind(self, candidate: Candidate, going: Sequence[Candidate], designs: int, coming: int) -> str:
        """Why others went on: one of the same layout promised more, or else the last of those that did."""
        alike = [each for each in going if each.layout == candidate.layout]
        least = max(alike or going, key=lambda each: self.promise(each, designs, coming))
        own, other = self.achieved(candidate, designs), self.achieved(least, designs)
        entry = self.standing(candidate.name, designs)
        ahead = self.value(candidate, designs) < self.value(least, designs)
        gaining = " and gained more in its last one" if ahead else ""
        return f"after {entry.iteration if entry else 0} designs {own}, where {least.name} had {other}{gaining}"

    def best_in_words(self, going: Sequence[Candidate], designs: int) -> str:
        """The best of some candidates, and what it does."""
        if not going:
            return "none satisfies the limits"
        best = min(going, key=lambda each: self.value(each, designs))
        return f"the best is {best.name}: {self.achieved(best, designs)}"


def promised(objectives: Sequence[float], more: int, least: float = -math.inf) -> float:
    """The objective after so many more designs, if each gains as much as the last one did.

    Folds grow from almost nothing, at first by a factor in every design, and bodies that bend by themselves hardly gain
    any more: objectives after two designs say less of those after six than this does.

    Parameters
    ----------
    objectives : of the designs, in order.
    more : how many there are to be.
    least : that the objective can be.
    """
    last = objectives[-1]
    gain = max(objectives[-2] - last, 0.0) if len(objectives) > 1 else 0.0
    return max(last - more * gain, least)


def member(name: str, problem: Problem, designs: int, finer: float = 1.0, begin: Path | None = None) -> Member:
    """A run of so many designs.

    Parameters
    ----------
    name, problem, designs : of the run.
    finer : a factor for the size of elements.
    begin : the directory of a run with whose last design it begins.
    """
    changes: dict[str, Any] = {"optimizer.iterations": designs}
    if finer != 1.0:
        changes["mesh.size"] = f"{finer * problem.mesh.size:.3g} mm"
    return Member(name, changes, problem.with_changes(changes), None if begin is None else str(begin.absolute()))


def reached_in(directory: Path, problem: Problem) -> Reached | None:
    """How near the last design of a run is to the targets of its tasks; None where none was stated."""
    found = targets_reached(problem, open_run(directory).history()).values()
    order = (Reached.NO, Reached.NEARLY, Reached.YES)
    return min(found, key=order.index) if found else None


def _done(directory: Path, problem: Problem) -> bool:
    """Whether a run has all the designs that are asked for, or has ended by itself."""
    if not (directory / "problem.toml").exists():
        return False
    run = open_run(directory)
    designs = (run.latest() or 0) >= problem.optimizer.iterations
    return designs or _ended_before(run) or (finished(directory, problem) and not cut_short(run))


def _ended_before(run: RunDirectory) -> bool:
    """Whether a run has ended with fewer designs than were asked for: nothing changes if it goes on."""
    result = run.result()
    return result is not None and result.iterations < run.problem.optimizer.iterations and not cut_short(run)


def cut_short(run: RunDirectory) -> bool:
    """Whether a run has ended because its time was up."""
    result = run.result()
    return result is not None and result.reason.startswith(TIME_IS_UP)
