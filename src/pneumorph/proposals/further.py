"""A candidate with a further chamber, where the topological derivative of one that was designed says that one helps."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from pneumorph.analysis import checkpoint
from pneumorph.analysis.bodies import mesher_of
from pneumorph.analysis.insertion import Insertion, find_insertions, further_chambers, with_further
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry.starting import space_of
from pneumorph.mechanics import part_of
from pneumorph.proposals.candidates import Candidate
from pneumorph.run import open_run

HELPS = 0.05
"""Gain to first order, over the size of the objective, from which on a further chamber is tried."""

PLACES = 3


def places_in(directory: Path) -> tuple[list[Insertion], float]:
    """The best places for a further chamber in the last design of a run, on its mesh, and the value of its objective.

    Raises
    ------
    ComputationError, ProblemError
        If its states are not found again, or its tasks span a workspace.
    """
    run = open_run(directory)
    state = run.resumable()
    if state is None:
        return [], 0.0
    problem = run.problem
    heights = mesher_of(problem, part_of(problem)).heights
    disc, analysis = checkpoint.unpack(problem, space_of(problem), dict(state), heights)
    return further_chambers(problem, find_insertions(problem, disc, analysis), PLACES), analysis.value


def with_further_chamber(candidate: Candidate, directory: Path) -> Candidate | None:
    """The candidate with a further chamber at its start, and its images; None where none helps, or none has room.

    Parameters
    ----------
    candidate : which was designed.
    directory : of its run.
    """
    if candidate.posed.solid is not None:
        return None
    try:
        places, value = places_in(directory)
        places = [each for each in places if each.gain >= HELPS * abs(value)]
        if not places:
            return None
        found, chosen = with_further(candidate.posed, places)
    except (ComputationError, ProblemError):
        return None
    x, y, z = chosen.place
    images = len(found.body.chamber) - len(candidate.posed.body.chamber) > 1
    words = f"{candidate.words}, a further chamber at ({x:.1f}, {y:.1f}, {z:.1f}) mm" + " and its images" * images
    return replace(candidate, name=f"{candidate.name}-further", words=words, problem=found)
