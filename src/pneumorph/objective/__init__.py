"""Objectives of a design: features of the deformed body, and functions of them that are minimised."""

from pneumorph.objective.features import Features, Slabs, equidistant, measure_features
from pneumorph.objective.target import Objective, match, maximize, objectives, reach

__all__ = [
    "Features",
    "Objective",
    "Slabs",
    "equidistant",
    "match",
    "maximize",
    "measure_features",
    "objectives",
    "reach",
]
