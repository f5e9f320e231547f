"""The largest workspace of several tasks."""

from __future__ import annotations

from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.objective import Objective, in_place_of_features
from pneumorph.objective.workspace import Workspace
from pneumorph.problem.objectives import LargestWorkspace


def build(asked: LargestWorkspace, scope: Scope) -> Objective:
    """Minus the length, area or volume, mm, mm² or mm³."""
    return in_place_of_features(Workspace(tuple("xyz".index(axis) for axis in asked.axes)))
