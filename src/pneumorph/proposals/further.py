"""A candidate with a further chamber, where the topological derivative of one that was designed says that one helps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pneumorph.analysis.insertion import further_chambers, with_further
from pneumorph.analysis.near import analyse_near
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.mechanics import part_of
from pneumorph.problem.designed import starting_at, starting_from
from pneumorph.proposals.candidates import Candidate
from pneumorph.results import HistoryEntry
from pneumorph.run import open_run

HELPS = 0.05
"""Gain to first order, over the size of the objective, from which on a further chamber is tried."""

PLACES = 3


def with_further_chamber(candidate: Candidate, directory: Path, entry: HistoryEntry) -> Candidate | None:
    """The candidate with a further chamber at its start, and its images; None where none helps, or none has room.

    Parameters
    ----------
    candidate : which was designed.
    directory, entry : its run, and the last design of that.
    """
    if candidate.posed.solid is not None:
        return None
    run = open_run(directory)
    stored = run.load_design(entry.iteration)
    problem = starting_at(starting_from(run.problem, entry.reinforcements), stored.pressures)
    try:
        near = analyse_near(
            problem, stored.body(run.problem), part_of(problem), run.fields(entry.iteration), entry.tasks
        )
        places = [each for each in further_chambers(near, PLACES) if each.gain >= HELPS * abs(near.analysis.value)]
        if not places:
            return None
        found, chosen = with_further(candidate.posed, places)
    except (ComputationError, ProblemError):
        return None
    x, y, z = chosen.place
    images = len(found.body.chamber) - len(candidate.posed.body.chamber) > 1
    words = f"{candidate.words}, a further chamber at ({x:.1f}, {y:.1f}, {z:.1f}) mm" + " and its images" * images
    return replace(candidate, name=f"{candidate.name}-further", words=words, problem=found)
