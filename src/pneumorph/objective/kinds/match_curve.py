"""The shape of a curve."""

from __future__ import annotations

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.objective.curve import section_targets
from pneumorph.objective.features import equidistant
from pneumorph.objective.kinds.kind import Scope, Target
from pneumorph.objective.kinds.match_sections import match
from pneumorph.objective.objective import Objective
from pneumorph.problem import MatchCurve

FINE = 200
"""Points along the target."""


def build(asked: MatchCurve, scope: Scope) -> Objective:
    """See `Kind`.

    Raises
    ------
    ProblemError
        If the curve has no direction at some point.
    """
    slabs = equidistant(asked.sections, scope.length)
    try:
        targets = section_targets(np.array(asked.control_points), asked.degree, slabs.middle / scope.length)
    except ValueError as error:
        raise ProblemError(f"{scope.key}.control_points: {error}") from None
    return match(slabs, *targets, asked.orientation_weight, asked.position_weight)


def target(asked: MatchCurve, length: float, motion: np.ndarray | None) -> Target:
    """The curve, and its sections."""
    points, fractions = np.array(asked.control_points), equidistant(asked.sections, length).middle / length
    line, _ = section_targets(points, asked.degree, np.linspace(0.0, 1.0, FINE))
    sections, _ = section_targets(points, asked.degree, fractions)
    return Target(line, sections)
