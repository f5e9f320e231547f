"""The design problem: body, material, tasks and limits, read from a file or built in Python, and validated."""

from pneumorph.problem.contact import BoxSpec, ContactSpec, CylinderSpec, ObstacleSpec, PlaneSpec, SphereSpec
from pneumorph.problem.fabrication import MakeSpec
from pneumorph.problem.file import load, loads, read
from pneumorph.problem.material import Material
from pneumorph.problem.models import (
    BodySpec,
    ChamberSpec,
    EndEffector,
    Envelope,
    Fold,
    Gravity,
    Limits,
    MeshSpec,
    OptimizerSpec,
    Pressure,
    Ripple,
    Spring,
    Stretch,
    Symmetry,
    Task,
)
from pneumorph.problem.objective import (
    ContactArea,
    Custom,
    MatchCurve,
    MatchSections,
    Maximize,
    ObjectiveSpec,
    Press,
    Reach,
    TargetMotion,
)
from pneumorph.problem.regions import Layer, Region, Sleeve
from pneumorph.problem.reinforcement import FibresSpec, MembraneSpec, Reinforcement, reinforcements
from pneumorph.problem.trust import Code, Trust, admit, codes_of, keep
from pneumorph.problem.whole import Problem

__all__ = [
    "BodySpec",
    "BoxSpec",
    "ChamberSpec",
    "Code",
    "ContactArea",
    "ContactSpec",
    "Custom",
    "CylinderSpec",
    "EndEffector",
    "Envelope",
    "FibresSpec",
    "Fold",
    "Gravity",
    "Layer",
    "Limits",
    "MakeSpec",
    "MatchCurve",
    "MatchSections",
    "Material",
    "Maximize",
    "MembraneSpec",
    "MeshSpec",
    "ObjectiveSpec",
    "ObstacleSpec",
    "OptimizerSpec",
    "PlaneSpec",
    "Press",
    "Pressure",
    "Problem",
    "Reach",
    "Region",
    "Reinforcement",
    "Ripple",
    "Sleeve",
    "SphereSpec",
    "Spring",
    "Stretch",
    "Symmetry",
    "TargetMotion",
    "Task",
    "Trust",
    "admit",
    "codes_of",
    "keep",
    "load",
    "loads",
    "read",
    "reinforcements",
]
