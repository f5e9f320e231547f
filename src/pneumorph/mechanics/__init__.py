"""Hyperelastic equilibrium under follower pressure, gravity and an end-effector, on any quadratic tetrahedral mesh."""

from pneumorph.mechanics.equilibrium import Equilibrium, NoEquilibrium, configuration, loads, predict, rest, solve
from pneumorph.mechanics.material import Rubber, rubber
from pneumorph.mechanics.model import Model, model
from pneumorph.mechanics.setup import held_of, loads_of, model_of, rubber_of
from pneumorph.mechanics.tangent import Configuration, Tangent

__all__ = [
    "Configuration",
    "Equilibrium",
    "Model",
    "NoEquilibrium",
    "Rubber",
    "Tangent",
    "configuration",
    "held_of",
    "loads",
    "loads_of",
    "model",
    "model_of",
    "predict",
    "rest",
    "rubber",
    "rubber_of",
    "solve",
]
