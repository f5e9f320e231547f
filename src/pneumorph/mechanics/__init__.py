"""Hyperelastic equilibrium under follower pressure, gravity and an end-effector, on any quadratic tetrahedral mesh."""

from pneumorph.mechanics.assembly.model import Model, model
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.material.rubber import Rubber, rubber
from pneumorph.mechanics.setup import held_of, loads_of, model_of, rubber_of
from pneumorph.mechanics.solve.equilibrium import Equilibrium, NoEquilibrium, configuration, loads, rest, solve
from pneumorph.mechanics.solve.mirror import Whole, mirror_of, whole_of
from pneumorph.mechanics.solve.path import Path, PathPoint, explained, follow
from pneumorph.mechanics.solve.prediction import predict

__all__ = [
    "Configuration",
    "Equilibrium",
    "Model",
    "NoEquilibrium",
    "Path",
    "PathPoint",
    "Rubber",
    "Tangent",
    "Whole",
    "configuration",
    "explained",
    "follow",
    "held_of",
    "loads",
    "loads_of",
    "mirror_of",
    "model",
    "model_of",
    "predict",
    "rest",
    "rubber",
    "rubber_of",
    "solve",
    "whole_of",
]
