"""Hyperelastic equilibrium under follower pressure, gravity and an end-effector, on any quadratic tetrahedral mesh."""

import pneumorph.kept
import pneumorph.numerics  # noqa: F401 (before anything of jax and of the linear solver)
from pneumorph.mechanics.assembly.build import build_model
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.constants import parameters_by_constants, with_rubbers
from pneumorph.mechanics.contact.skin import Skin
from pneumorph.mechanics.elements.kinematics import Guess, State, deformation_gradients, gradients_after
from pneumorph.mechanics.elements.plate import COMPONENTS, rotation, rotation_vector
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mechanics.material.rubber import Rubber, neo_hookean_rubber
from pneumorph.mechanics.setup import enclosed_of, guided_of, loads_of, model_of, rubber_of, rubbers_of
from pneumorph.mechanics.solve.ahead import limit_ahead
from pneumorph.mechanics.solve.border import negative_motions
from pneumorph.mechanics.solve.equilibrium import (
    TOLERANCE,
    Equilibrium,
    NoEquilibrium,
    build_loads,
    configure,
    exerted_on_blocks,
    rest,
    settled,
)
from pneumorph.mechanics.solve.forces import ContactForces, contact_forces
from pneumorph.mechanics.solve.friction_sweep import sweep_with_friction
from pneumorph.mechanics.solve.lateral import (
    Softest,
    buckling_load,
    lateral_models,
    masses_of,
    softest,
    softest_of_kinds,
    stable_against_kinds,
)
from pneumorph.mechanics.solve.memory_sweep import sweep_with_memory
from pneumorph.mechanics.solve.mirror import breaking_loads, mirrors_of, sealed
from pneumorph.mechanics.solve.part import part_of
from pneumorph.mechanics.solve.path import Path, diagnose, follow
from pneumorph.mechanics.solve.place import PathPoint, limit_near
from pneumorph.mechanics.solve.prediction import along_path, predict, predict_change
from pneumorph.mechanics.solve.restore import restored
from pneumorph.mechanics.solve.search import solve
from pneumorph.mechanics.solve.sweep import secant_start, sweep
from pneumorph.mechanics.solve.whole import Whole, whole_of

__all__ = [
    "COMPONENTS",
    "TOLERANCE",
    "Configuration",
    "ContactForces",
    "Equilibrium",
    "Guess",
    "Loads",
    "Model",
    "NoEquilibrium",
    "Path",
    "PathPoint",
    "Rubber",
    "Skin",
    "Softest",
    "State",
    "Tangent",
    "Whole",
    "along_path",
    "breaking_loads",
    "buckling_load",
    "build_loads",
    "build_model",
    "configure",
    "contact_forces",
    "deformation_gradients",
    "diagnose",
    "displacement",
    "enclosed_of",
    "exerted_on_blocks",
    "follow",
    "gradients_after",
    "guided_of",
    "lateral_models",
    "limit_ahead",
    "limit_near",
    "loads_of",
    "masses_of",
    "mirrors_of",
    "model_of",
    "negative_motions",
    "neo_hookean_rubber",
    "parameters_by_constants",
    "part_of",
    "predict",
    "predict_change",
    "rest",
    "restored",
    "rotation",
    "rotation_vector",
    "rubber_of",
    "rubbers_of",
    "sealed",
    "secant_start",
    "settled",
    "softest",
    "softest_of_kinds",
    "solve",
    "stable_against_kinds",
    "sweep",
    "sweep_with_friction",
    "sweep_with_memory",
    "whole_of",
    "with_rubbers",
]
