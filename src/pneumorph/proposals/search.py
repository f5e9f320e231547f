"""The search: all candidates are designed a little, the best of them further, and the best two on a finer mesh.

Successive halving (Jamieson & Talwalkar 2016) with the design loop inside: a candidate that goes on resumes its own
run. After the first comparison the best of every layout goes on before the second best of another one, since layouts
begin at different speeds.
"""

from __future__ import annotations

import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Protocol

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.problem import Problem
from pneumorph.proposals.candidates import Candidate, draw_candidates
from pneumorph.proposals.estimates import impossible
from pneumorph.proposals.target import Target
from pneumorph.proposals.wishes import amount, best_of, minimised
from pneumorph.results import HistoryEntry
from pneumorph.results.targets import Reached, targets_reached
from pneumorph.run import RunDirectory, open_run
from pneumorph.study import Member
from pneumorph.study.members import MemberEnd, finished

KEPT = 1.0 / 3.0
"""Part of the candidates that goes on after each comparison."""

FINER, BEST = 0.65, 2
"""Size of the elements of proposals over that of candidates, and number of proposals."""


MOST_BY_WISHES = 4
"""Largest number of proposals where there are wishes that one body alone does not win."""


@dataclass(frozen=True)
class Plan:
    """How much is searched.

    Attributes
    ----------
    candidates : int
        Number of bodies that are drawn.
    seed : int
        Of the draws.
    minutes : float
        How long it may take. A stage that has begun is ended.
    stages : tuple of int
        Designs after which candidates are compared.
    designs : int
        Designs of the proposals.
    """

    candidates: int = 24
    seed: int = 0
    minutes: float = 30.0
    stages: tuple[int, ...] = (2, 6, 14)
    designs: int = 20


@dataclass(frozen=True)
class Proposal:
    """A candidate and how it ended.

    Attributes
    ----------
    candidate : Candidate
    run : Path or None
        Its run directory: that of the finer mesh for those that were designed to the end.
    entry : HistoryEntry or None
        Its best design.
    final : bool
        Whether it was designed to the end.
    lost : str
        Why it did not go on, as a sentence; empty for those that were designed to the end.
    amounts : {wish: float}
        Of what the target minimises, see `wishes.amount`; of those that went on to the end, or nearly.
    wins : tuple of str
        The wishes in which no other of these is better.
    unbeaten : bool
        Whether no other of these is as good in all wishes and better in one.
    """

    candidate: Candidate
    run: Path | None
    entry: HistoryEntry | None
    final: bool
    lost: str = ""
    amounts: Mapping[str, float] = field(default_factory=dict)
    wins: tuple[str, ...] = ()
    unbeaten: bool = False

    @property
    def achieved(self) -> str:
        """What its design does in each task, in words."""
        if self.entry is None:
            return ""
        tasks = self.candidate.posed.task
        return ", ".join(each.objective.achieved(self.entry.tasks[each.name]).beside_target for each in tasks)


class Runner(Protocol):
    """Runs members in their directories under a folder, and yields their ends as they come."""

    def __call__(self, members: Mapping[str, Member], drawn: bool) -> Iterator[MemberEnd]: ...


def propose(
    target: Target, out: Path, plan: Plan, runner: Runner, workers: int, said: Callable[[str], None] = lambda text: None
) -> list[Proposal]:
    """Search bodies for a target.

    What is on disk is not computed again, so that a search that was stopped goes on.

    Parameters
    ----------
    target : what is asked.
    out : the directory of the search; every candidate has its run directory in it.
    plan : how much is searched.
    runner : runs members.
    workers : how many it runs at once.
    said : called with a line after each comparison.

    Returns
    -------
    list of Proposal
        All candidates, the best first.

    Raises
    ------
    ProblemError
        If the target is out of reach by an estimate, or the directory contains something else.
    """
    if words := impossible(target):
        raise ProblemError(words)
    clock = _Clock(plan)
    drawn = list(draw_candidates(target, plan.candidates, plan.seed))
    # (reason, and the stage that was reached) of those that do not go on.
    lost = {each.name: (f"no body was found: {each.reason}", -1) for each in drawn if each.problem is None}
    going = [each for each in drawn if each.problem is not None]
    for stage, designs in enumerate(plan.stages):
        wanted = {each.name: _member(each.name, each.posed, designs) for each in going}
        ended = _run(wanted, out, runner, workers, clock.until(stage), drawn=False)
        for name in wanted.keys() - ended.keys():
            lost[name] = (f"there was no time for {designs} designs", stage - 1)
        ranked = _ranked([each for each in going if each.name in ended], out, designs, by_layout=stage == 0)
        for each in list(ranked):
            if _standing(out / each.name, designs) is None:
                lost[each.name] = (ended[each.name] or f"none of {designs} designs satisfies the limits", stage)
                ranked.remove(each)
        keep = max(BEST, math.ceil(KEPT * len(ranked)))
        going = ranked[:keep]
        for each in ranked[keep:]:
            lost[each.name] = (_behind(each, going, out, designs), stage)
        said(f"{len(ranked)} candidates compared after {designs} designs; {_words(going, out, designs)}")
    if target.minimize:
        going = _by_wishes(target, going, out, plan.stages[-1])
    chosen = going[: MOST_BY_WISHES if target.minimize else BEST]
    for each in going[len(chosen) :]:
        lost[each.name] = (_behind(each, chosen, out, plan.stages[-1]), len(plan.stages))
    going = chosen
    wanted = {_final(each): _member(_final(each), each.posed, plan.designs, FINER) for each in going}
    ended = _run(wanted, out, runner, workers, clock.until(len(plan.stages)), drawn=True)
    proposals = [_proposal(each, out, plan, ended) for each in going]
    proposals.sort(key=lambda each: (not each.final, each.entry.objective if each.entry else math.inf))
    if target.minimize:
        proposals = _judged(target, proposals)
    rest = sorted((each for each in drawn if each.name in lost), key=lambda each: -lost[each.name][1])
    return proposals + [_loser(each, out, plan.stages[-1], lost[each.name][0]) for each in rest]


def _by_wishes(target: Target, going: Sequence[Candidate], out: Path, designs: int) -> list[Candidate]:
    """Candidates, first those that do their tasks and that none of these beats in all wishes, then as they were."""
    doing = [each for each in going if _does(out / each.name, each.posed)] or list(going)
    if len(doing) < 2:
        return list(going)
    found = [_amounts(target, each.posed, out / each.name, _standing(out / each.name, designs)) for each in doing]
    unbeaten, _ = best_of(target.minimize, found)
    first = [each for each, kept in zip(doing, unbeaten, strict=True) if kept]
    return first + [each for each in going if each not in first]


def _judged(target: Target, proposals: Sequence[Proposal]) -> list[Proposal]:
    """Proposals with their amounts, those that do their tasks and are beaten by none first, by their mean places."""
    standing = [each for each in proposals if each.run is not None and each.entry is not None]
    does = [each.run is not None and _does(each.run, each.candidate.posed) for each in standing]
    compared = [each for each, done in zip(standing, does, strict=True) if done] or standing
    if not compared:
        return list(proposals)
    found = [_amounts(target, each.candidate.posed, each.run, each.entry) for each in compared]
    unbeaten, wins = best_of(target.minimize, found)
    values = np.array([[minimised(wish, each[wish]) for wish in target.minimize] for each in found])
    places = (values[None] < values[:, None]).sum(axis=1).mean(axis=1)
    judged = [
        replace(each, amounts=own, wins=tuple(won), unbeaten=bool(front))
        for each, own, won, front in zip(compared, found, wins, unbeaten, strict=True)
    ]
    order = sorted(range(len(judged)), key=lambda k: (not judged[k].final, not judged[k].unbeaten, places[k]))
    return [judged[k] for k in order] + [each for each in proposals if each not in compared]


def _does(directory: Path, problem: Problem) -> bool:
    """Whether the last design of a run reaches the targets of its tasks, nearly at least; true without any."""
    return Reached.NO not in targets_reached(problem, open_run(directory).history()).values()


def _amounts(target: Target, problem: Problem, run: Path | None, entry: HistoryEntry | None) -> dict[str, float]:
    assert run is not None and entry is not None, "only designs are compared"
    body = open_run(run).load_design(entry.iteration).body(problem)
    return {wish: amount(wish, problem, body, entry) for wish in target.minimize}


def _proposal(candidate: Candidate, out: Path, plan: Plan, ended: Mapping[str, str]) -> Proposal:
    """One of the best: on the finer mesh, or if that failed or there was no time for it, as it was compared last."""
    name, coarse = _final(candidate), out / candidate.name
    entry = _standing(out / name, plan.designs) if name in ended else None
    if entry is not None:
        return Proposal(candidate, out / name, entry, True)
    why = ended.get(name) or "there was no time for the finer mesh"
    return Proposal(candidate, coarse, _standing(coarse, plan.stages[-1]), False, why)


class _Clock:
    """Time of a search: a third for the first comparison, and the rest in equal parts."""

    def __init__(self, plan: Plan):
        self._start, self._seconds, self._stages = time.monotonic(), 60.0 * plan.minutes, len(plan.stages)

    def until(self, stage: int) -> Callable[[], bool]:
        """Whether the time of a stage and of those before it is used up."""
        share = 1.0 / 3.0 + 2.0 / 3.0 * stage / self._stages
        return lambda: time.monotonic() - self._start > share * self._seconds


def _final(candidate: Candidate) -> str:
    return f"{candidate.name}-fine"


def _member(name: str, problem: Problem, designs: int, finer: float = 1.0) -> Member:
    changes: dict[str, Any] = {"optimizer.iterations": designs}
    if finer != 1.0:
        changes["mesh.size"] = f"{finer * problem.mesh.size:.3g} mm"
    return Member(name, changes, problem.with_changes(changes))


def _run(
    members: Mapping[str, Member], out: Path, runner: Runner, workers: int, late: Callable[[], bool], drawn: bool
) -> dict[str, str]:
    """The reasons for which members failed, empty for those that did not; those for which there is no time are missing.

    Parameters
    ----------
    members, out : what is to be run, and the directory of the search.
    runner, workers : what runs so many at once.
    late : whether there is no time left.
    drawn : whether pictures are drawn.
    """
    ended: dict[str, str] = {}
    waiting = list(members.values())
    for first in range(0, len(waiting), 2 * workers):
        if late():
            break
        batch = waiting[first : first + 2 * workers]
        todo = {each.name: each for each in batch if not _done(out / each.name, each.problem)}
        ended |= {each.name: "" for each in batch if each.name not in todo}
        for end in runner(todo, drawn) if todo else ():
            ended[end.name] = "" if end.completed else end.reason
    return ended


def _done(directory: Path, problem: Problem) -> bool:
    """Whether a run has all the designs that are asked for, or has ended by itself."""
    if not (directory / "problem.toml").exists():
        return False
    run = open_run(directory)
    designs = (run.latest() or 0) >= problem.optimizer.iterations
    return designs or _ended_before(run) or finished(directory, problem)


def _ended_before(run: RunDirectory) -> bool:
    """Whether a run has ended with fewer designs than were asked for: nothing changes if it goes on."""
    result = run.result()
    return result is not None and result.iterations < run.problem.optimizer.iterations


def _standing(directory: Path, designs: int) -> HistoryEntry | None:
    """The last of so many designs, if it satisfies the limits."""
    if not (directory / "problem.toml").exists():
        return None
    entries = [entry for entry in open_run(directory).history() if entry.iteration <= designs and entry.held]
    return entries[-1] if entries else None


def _ranked(going: Sequence[Candidate], out: Path, designs: int, by_layout: bool) -> list[Candidate]:
    """Candidates, the best first; by layout the best of each come first, then the second best of each, and so on."""

    def value(each: Candidate) -> float:
        entry = _standing(out / each.name, designs)
        return math.inf if entry is None else entry.objective

    best = sorted(going, key=value)
    if not by_layout:
        return best
    place = {each.name: [other.name for other in best if other.layout == each.layout].index(each.name) for each in best}
    # Sorting keeps the order of what is alike.
    return sorted(best, key=lambda each: (value(each) == math.inf, place[each.name]))


def _behind(candidate: Candidate, going: Sequence[Candidate], out: Path, designs: int) -> str:
    """Why others went on: one of the same layout was better, or else the last of those that did."""
    own = Proposal(candidate, None, _standing(out / candidate.name, designs), False).achieved
    alike = [each for each in going if each.layout == candidate.layout]
    entries = {each.name: _standing(out / each.name, designs) for each in going}
    values = {name: math.inf if entry is None else entry.objective for name, entry in entries.items()}
    least = max(alike or going, key=lambda each: values[each.name])
    other = Proposal(least, None, entries[least.name], False).achieved
    return f"after {designs} designs {own}, where {least.name} had {other}"


def _words(going: Sequence[Candidate], out: Path, designs: int) -> str:
    if not going:
        return "none satisfies the limits"
    best = min(going, key=lambda each: entry.objective if (entry := _standing(out / each.name, designs)) else math.inf)
    achieved = Proposal(best, None, _standing(out / best.name, designs), False).achieved
    return f"the best is {best.name}: {achieved}"


def _loser(candidate: Candidate, out: Path, designs: int, reason: str) -> Proposal:
    directory = out / candidate.name
    begun = (directory / "problem.toml").exists()
    entry = _standing(directory, designs) if begun else None
    return Proposal(candidate, directory if begun else None, entry, False, reason)
