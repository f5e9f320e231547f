"""Objectives of a design: features of the deformed body, and functions of them that are minimised."""

from pneumorph.objective.features import Features, Pressing, Slabs, equidistant, measure_features
from pneumorph.objective.kinds import build_objectives
from pneumorph.objective.kinds.match_sections import match
from pneumorph.objective.kinds.maximize import maximize
from pneumorph.objective.kinds.reach import reach
from pneumorph.objective.limited import COMPONENTS, LIMITED
from pneumorph.objective.objective import Objective
from pneumorph.objective.strain import StrainShare

__all__ = [
    "COMPONENTS",
    "LIMITED",
    "Features",
    "Objective",
    "Pressing",
    "Slabs",
    "StrainShare",
    "build_objectives",
    "equidistant",
    "match",
    "maximize",
    "measure_features",
    "reach",
]
