"""Propose bodies for a target, on processes of this machine."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator
from pathlib import Path

from pneumorph.errors import writing
from pneumorph.optimize.settings import LoopSettings
from pneumorph.proposals import Plan, Proposal, Target, load_target
from pneumorph.proposals import propose as search
from pneumorph.results import HistoryEntry
from pneumorph.study import Member
from pneumorph.study.cluster import connected, run_members
from pneumorph.study.in_turn import threads_of
from pneumorph.study.members import MemberEnd


def propose(
    target: Target | str | Path,
    out: str | Path,
    plan: Plan | None = None,
    workers: int | None = None,
    said: Callable[[str], None] = lambda text: None,
    on_design: Callable[[str, HistoryEntry], None] = lambda name, entry: None,
) -> list[Proposal]:
    """Propose bodies for a target: layouts are tried, and the best of them designed.

    What is in the directory is not computed again, so a search that was stopped goes on.

    Parameters
    ----------
    target : Target, or the path of a target file
    out : the directory of the search; every candidate has its run directory in it.
    plan : how much is searched; by default 24 candidates in 30 minutes.
    workers : number of processes, by default one for every core and every 2 GB.
    said : called with a line after every comparison of candidates.
    on_design : called with the name of a candidate and the history entry of every design.

    Returns
    -------
    list of Proposal
        All candidates, those that were designed to the end first, the best of them at the head. The run of one is
        `pm.open_run(each.run)`.

    Raises
    ------
    ProblemError
        If the target has a mistake, or the directory contains something else.

    Examples
    --------
    >>> import pneumorph as pm
    >>> proposals = pm.propose("lift.toml", out="runs/lift")  # doctest: +SKIP
    >>> pm.open_run(proposals[0].run).best.plot()  # doctest: +SKIP
    """
    asked = target if isinstance(target, Target) else load_target(target)
    folder = Path(out)
    with writing(f"out {folder}", "name another"):
        folder.mkdir(parents=True, exist_ok=True)
    with connected(None, workers) as client:

        def run(members: Iterable[tuple[Member, LoopSettings]], drawn: bool) -> Iterator[MemberEnd]:
            return run_members(client, members, folder, on_design, drawn)

        return search(asked, folder, plan or Plan(), run, threads_of(client), said)
