"""The problem file: what is designed, from what, for which tasks, within which limits."""

from pneumorph.problem.file import load, loads
from pneumorph.problem.material import Material
from pneumorph.problem.models import (
    BodySpec,
    ChamberSpec,
    EndEffector,
    Envelope,
    Fold,
    Gravity,
    Limits,
    Maximize,
    MeshSpec,
    OptimizerSpec,
    Pressure,
    Problem,
    Ripple,
    Spring,
    Stretch,
    Symmetry,
    Task,
)

__all__ = [
    "BodySpec",
    "ChamberSpec",
    "EndEffector",
    "Envelope",
    "Fold",
    "Gravity",
    "Limits",
    "Material",
    "Maximize",
    "MeshSpec",
    "OptimizerSpec",
    "Pressure",
    "Problem",
    "Ripple",
    "Spring",
    "Stretch",
    "Symmetry",
    "Task",
    "load",
    "loads",
]
