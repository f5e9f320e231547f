"""The force of a tip that is held."""

from __future__ import annotations

from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.objective import Objective, in_place_of_features
from pneumorph.objective.tip import HeldForce
from pneumorph.problem.objectives import Blocked


def build(asked: Blocked, scope: Scope) -> Objective:
    """The largest force along a motion that is held, N or N·mm."""
    return in_place_of_features(HeldForce(asked.component, -asked.sign))
