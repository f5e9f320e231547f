"""The stiffness of the tip against a motion."""

from __future__ import annotations

from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.objective import Objective, in_place_of_features
from pneumorph.objective.tip import TipStiffness
from pneumorph.problem.objectives import StiffnessOfTip


def build(asked: StiffnessOfTip, scope: Scope) -> Objective:
    """The stiffest or the softest tip, N/mm or N·mm/rad."""
    return in_place_of_features(TipStiffness(asked.motion, asked.sign))
