"""A given motion of a free obstacle."""

from __future__ import annotations

from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.objective import Objective, components
from pneumorph.problem import TargetPose
from pneumorph.problem.components import POSE


def build(asked: TargetPose, scope: Scope) -> Objective:
    """Target components of a free obstacle's displacement and rotation vector, each in the sum if it is given."""
    weights = asked.position_weight, asked.rotation_weight
    return components(asked.targets, lambda f: (f.pose[asked.obstacle][:3], f.pose[asked.obstacle][3:]), POSE, weights)
