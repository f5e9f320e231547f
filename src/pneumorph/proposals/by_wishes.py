"""What a search does about wishes: it prefers what no other body beats, designs on for each, and ranks by them."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.proposals.candidates import Candidate
from pneumorph.proposals.driven import driven
from pneumorph.proposals.proposal import Proposal
from pneumorph.proposals.stage import Search, reached_in
from pneumorph.proposals.target import Target
from pneumorph.proposals.wishes import amount, best_of, minimised
from pneumorph.results.targets import Reached
from pneumorph.run import open_run
from pneumorph.study import Member


def unbeaten_first(search: Search, going: list[Candidate]) -> list[Candidate]:
    """Candidates, first those that do their tasks and that none of these beats in all wishes, then as they were."""
    designs, wishes = search.plan.stages[-1], search.target.minimize
    found = [Proposal(each, search.out / each.name, search.standing(each.name, designs), False) for each in going]
    doing = [each for each in found if _does(each)] or found
    if len(doing) < 2:
        return going
    unbeaten, _ = best_of(wishes, [_amounts(each, wishes) for each in doing])
    first = [each.candidate for each, kept in zip(doing, unbeaten, strict=True) if kept]
    return first + [each for each in going if each not in first]


def measured(target: Target, proposals: Sequence[Proposal]) -> list[Proposal]:
    """Proposals, those that do their tasks with their amounts: a blocked force costs as much as some designs."""
    return [replace(each, amounts=_amounts(each, target.minimize)) if _does(each) else each for each in proposals]


def designed_on(search: Search, proposals: Sequence[Proposal], part: int) -> list[Proposal]:
    """For each wish the proposal that has the least of it, designed on for less of it with its motions held.

    Parameters
    ----------
    search, proposals : what is asked, and what was designed to the end, with amounts.
    part : of the time, see `Clock`.
    """
    able = [each for each in proposals if each.final and _does(each)]
    begun: dict[str, tuple[Proposal, Member]] = {}
    for wish in search.target.minimize if able else ():
        best = able[int(np.argmin([minimised(wish, each.amounts[wish]) for each in able]))]
        assert best.run is not None and best.entry is not None, "it does its tasks"
        word, reason = wish.removeprefix("-"), "a task asks for something else than motions, or hardly moves its tip"
        try:
            problem = driven(open_run(best.run).problem, best.entry.tasks, wish)
        except ProblemError as error:
            problem, reason = None, str(error)
        if problem is None:
            search.said(f"{word} is compared, and not designed for: {reason}")
            continue
        name, words = f"{best.candidate.name}-{word}", ("much " if wish != word else "little ") + word
        begun[name] = best, Member(name, {"objective": words}, problem, str(best.run.absolute()))
    ended = search.run({name: own for name, (_, own) in begun.items()}, part, last=True)
    found = []
    for name, (best, own) in begun.items():
        entry = search.standing(name, search.plan.designs) if name in ended else None
        if entry is None or not entry.iteration:
            why = ended.get(name, "there was no time for it") or "no design is better with the same motions"
            search.said(f"{name}: {why}")
            continue
        words = f"{best.candidate.words}, designed for {own.changes['objective']}"
        candidate = replace(best.candidate, name=name, words=words)
        found.append(Proposal(candidate, search.out / name, entry, True))
    return found


def judged(target: Target, proposals: Sequence[Proposal]) -> list[Proposal]:
    """Proposals with their amounts, those that do their tasks and are beaten by none first, by their mean places."""
    standing = [each for each in proposals if each.run is not None and each.entry is not None]
    compared = [each for each in standing if _does(each)] or standing
    if not compared:
        return list(proposals)
    found = [each.amounts or _amounts(each, target.minimize) for each in compared]
    unbeaten, wins = best_of(target.minimize, found)
    values = np.array([[minimised(wish, each[wish]) for wish in target.minimize] for each in found])
    places = (values[None] < values[:, None]).sum(axis=1).mean(axis=1)
    told = [
        replace(each, amounts=own, wins=tuple(won), unbeaten=bool(front))
        for each, own, won, front in zip(compared, found, wins, unbeaten, strict=True)
    ]
    order = sorted(range(len(told)), key=lambda k: (not told[k].final, not told[k].unbeaten, places[k]))
    return [told[k] for k in order] + [each for each in proposals if each not in compared]


def _does(proposal: Proposal) -> bool:
    """Whether a design reaches the targets of its tasks, nearly at least; true without any."""
    if proposal.run is None or proposal.entry is None:
        return False
    return reached_in(proposal.run, proposal.candidate.posed) is not Reached.NO


def _amounts(proposal: Proposal, wishes: Sequence[str]) -> dict[str, float]:
    assert proposal.run is not None and proposal.entry is not None, "only designs are compared"
    problem = proposal.candidate.posed
    body = open_run(proposal.run).load_design(proposal.entry.iteration).body(problem)
    return {wish: amount(wish, problem, body, proposal.entry) for wish in wishes}
