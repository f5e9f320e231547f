"""Objectives of a design: features of the deformed body, and functions of them that are minimised."""

from pneumorph.objective.features import Features, Pressing, Slabs, equidistant, measure_features
from pneumorph.objective.strain import StrainShare
from pneumorph.objective.target import Objective, build_objectives, match, maximize, reach

__all__ = [
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
