"""How much is searched, and what is found: candidates with how they ended."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

from pneumorph.proposals.candidates import Candidate
from pneumorph.results import HistoryEntry


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


def best_first(proposals: Sequence[Proposal]) -> list[Proposal]:
    """Proposals by their objectives, on whichever mesh: bodies differ by more than the few per cent that it changes."""
    return sorted(proposals, key=lambda each: each.entry.objective if each.entry else math.inf)
