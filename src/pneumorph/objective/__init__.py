"""Objectives of a design: features of the deformed body, and functions of them that are minimised."""

from pneumorph.objective.features import Features, Pressing, Slabs, equidistant, measure_features
from pneumorph.objective.gap import Gap
from pneumorph.objective.kinds import build_objectives
from pneumorph.objective.kinds.match_sections import match
from pneumorph.objective.kinds.maximize import TIP_MOTIONS, maximize
from pneumorph.objective.kinds.reach import reach
from pneumorph.objective.limited import COMPONENTS, LIMITED
from pneumorph.objective.objective import Objective
from pneumorph.objective.strain import StrainShare
from pneumorph.objective.tip import HeldForce, TipStiffness
from pneumorph.objective.workspace import Workspace

__all__ = [
    "COMPONENTS",
    "LIMITED",
    "TIP_MOTIONS",
    "Features",
    "Gap",
    "HeldForce",
    "Objective",
    "Pressing",
    "Slabs",
    "StrainShare",
    "TipStiffness",
    "Workspace",
    "build_objectives",
    "equidistant",
    "match",
    "maximize",
    "measure_features",
    "reach",
]
