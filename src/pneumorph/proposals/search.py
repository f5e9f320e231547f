"""The search: all candidates are designed a little, the best of them further, and the best two on a finer mesh.

Successive halving (Jamieson & Talwalkar 2016) with the design loop inside: a candidate that goes on resumes its own
run. Candidates are compared by what they will have reached at the next comparison if they go on as in their last
design, and after the first one the best of every layout goes on before the second best of another one, since layouts
begin at different speeds. Where the best does not reach its target after the last one, the same body with a further
chamber is compared with it. What is wished for beside the tasks is in `by_wishes.py`.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from pathlib import Path

from pneumorph.errors import ProblemError
from pneumorph.proposals.by_wishes import designed_on, judged, measured, unbeaten_first
from pneumorph.proposals.candidates import Candidate, draw_candidates, why_none
from pneumorph.proposals.estimates import impossible
from pneumorph.proposals.further import with_further_chamber
from pneumorph.proposals.proposal import Plan, Proposal, best_first
from pneumorph.proposals.stage import Clock, Runner, Search, cut_short, member, reached_in
from pneumorph.proposals.target import Target
from pneumorph.results.targets import Reached
from pneumorph.run import open_run

KEPT = 1.0 / 3.0
"""Part of the candidates that goes on after each comparison."""

FINER, BEST = 0.65, 2
"""Size of the elements of proposals over that of candidates, and number of proposals."""

MOST_BY_WISHES = 4
"""Largest number of proposals where there are wishes that one body alone does not win."""

Lost = dict[str, tuple[str, int]]
"""Why candidates do not go on, and the stage that they reached."""


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
        If the target is out of reach by an estimate, no body is found for it, or the directory contains something else.
    """
    if words := impossible(target):
        raise ProblemError(words)
    # After the comparisons come a further chamber, the finer mesh and, where there are any, wishes.
    clock = Clock(plan.minutes, len(plan.stages) + 1 + bool(target.minimize))
    search = Search(target, plan, out, runner, workers, clock, said)
    drawn = list(draw_candidates(target, plan.candidates, plan.seed))
    lost: Lost = {each.name: (f"no body was found: {each.reason}", -1) for each in drawn if each.problem is None}
    going = [each for each in drawn if each.problem is not None]
    if not going:
        raise ProblemError(why_none(drawn))
    for stage in range(len(plan.stages)):
        going = _compared(search, going, stage, lost)
    if (added := _further(search, going)) is not None:
        drawn.append(added)
        going = _with(search, going, added, lost)
    if target.minimize:
        going = unbeaten_first(search, going)
    going, left = going[: (most := MOST_BY_WISHES if target.minimize else BEST)], going[most:]
    for each in left:
        lost[each.name] = (search.behind(each, going, plan.stages[-1], plan.stages[-1]), len(plan.stages))
    wanted = {_final(each): member(_final(each), each.posed, plan.designs, FINER, out / each.name) for each in going}
    ended = search.run(wanted, len(plan.stages) + 1, last=True)
    proposals = best_first([_proposal(search, each, ended) for each in going])
    if target.minimize:
        proposals = measured(target, proposals)
        proposals = judged(target, [*proposals, *designed_on(search, proposals, len(plan.stages) + 2)])
    rest = sorted((each for each in drawn if each.name in lost), key=lambda each: -lost[each.name][1])
    return proposals + [_loser(search, each, lost[each.name][0]) for each in rest]


def _compared(search: Search, going: list[Candidate], stage: int, lost: Lost) -> list[Candidate]:
    """The best of some candidates after the designs of a stage; why the others do not go on is added to `lost`."""
    stages = search.plan.stages
    # Beyond the last comparison candidates are compared by what they do.
    designs, coming = stages[stage], stages[min(stage + 1, len(stages) - 1)]
    wanted = {each.name: member(each.name, each.posed, designs) for each in going}
    ended = search.run(wanted, stage)
    if stage and not ended:
        # The time went into the comparison before; what it kept goes on as it is.
        return going
    for name in wanted.keys() - ended.keys():
        lost[name] = (f"there was no time for {designs} designs", stage - 1)
    ranked = search.ranked([each for each in going if each.name in ended], designs, coming, by_layout=stage == 0)
    for each in list(ranked):
        if search.standing(each.name, designs) is None:
            lost[each.name] = (ended[each.name] or f"none of {designs} designs satisfies the limits", stage)
            ranked.remove(each)
    keep = max(BEST, math.ceil(KEPT * len(ranked)))
    for each in ranked[keep:]:
        lost[each.name] = (search.behind(each, ranked[:keep], designs, coming), stage)
    best = search.best_in_words(ranked[:keep], designs)
    search.said(f"{len(ranked)} candidates compared after {designs} designs; {best}")
    return ranked[:keep]


def _further(search: Search, going: list[Candidate]) -> Candidate | None:
    """The best candidate with a further chamber; None where it reaches its target, none helps, or there is no time."""
    if not going or search.clock.late(len(search.plan.stages)):
        return None
    best, directory = going[0], search.out / going[0].name
    entry = search.standing(best.name, search.plan.stages[-1])
    if entry is None or reached_in(directory, best.posed) in (Reached.YES, Reached.NEARLY):
        return None
    return with_further_chamber(best, directory)


def _with(search: Search, going: list[Candidate], added: Candidate, lost: Lost) -> list[Candidate]:
    """As many candidates, with one more where it is better than one of them."""
    stage, designs = len(search.plan.stages), search.plan.stages[-1]
    ended = search.run({added.name: member(added.name, added.posed, designs)}, stage)
    if search.standing(added.name, designs) is None:
        none = f"none of {designs} designs satisfies the limits"
        lost[added.name] = (ended.get(added.name, f"there was no time for {designs} designs") or none, stage)
        return going
    ranked = search.ranked([*going, added], designs, designs)
    kept = ranked[: len(going)]
    lost |= {each.name: (search.behind(each, kept, designs, designs), stage) for each in ranked[len(going) :]}
    search.said(f"a further chamber, {added.name}: {search.achieved(added, designs)}")
    return kept


def _proposal(search: Search, candidate: Candidate, ended: Mapping[str, str]) -> Proposal:
    """One of the best: on the finer mesh, or if that failed or there was no time for it, as it was compared last."""
    name, coarse, plan = _final(candidate), search.out / candidate.name, search.plan
    entry, before = search.standing(name, plan.designs), search.standing(candidate.name, plan.stages[-1])
    if name in ended and entry is not None:
        better = before is None or entry.objective <= before.objective
        if better or not cut_short(open_run(search.out / name)):
            return Proposal(candidate, search.out / name, entry, True)
    why = ended.get(name) or "there was no time for the finer mesh"
    return Proposal(candidate, coarse, before, False, why)


def _final(candidate: Candidate) -> str:
    return f"{candidate.name}-fine"


def _loser(search: Search, candidate: Candidate, reason: str) -> Proposal:
    directory = search.out / candidate.name
    begun = (directory / "problem.toml").exists()
    entry = search.standing(candidate.name, search.plan.stages[-1])
    return Proposal(candidate, directory if begun else None, entry, False, reason)
