"""The design problem: body, material, tasks and limits, read from a file or built in Python, and validated."""

from pneumorph.problem.body import BodySpec, ChamberSpec, Ripple, Symmetry
from pneumorph.problem.contact import (
    BoxSpec,
    ContactSpec,
    CylinderSpec,
    FreeSpec,
    ObstacleSpec,
    PlaneSpec,
    SphereSpec,
    TriangulatedSpec,
)
from pneumorph.problem.design import DesignSpec
from pneumorph.problem.designed import reinforcements
from pneumorph.problem.envelope import Envelope, HalfSpace
from pneumorph.problem.fabrication import MakeSpec
from pneumorph.problem.fewer import with_fewer_chambers
from pneumorph.problem.file import load, loads, read
from pneumorph.problem.further import with_further_chamber
from pneumorph.problem.material import Material
from pneumorph.problem.models import (
    EndEffector,
    Fold,
    Gravity,
    Limits,
    MeshSpec,
    OptimizerSpec,
    Pressure,
    Spring,
    Stretch,
    Task,
)
from pneumorph.problem.objectives import (
    ContactArea,
    Custom,
    MatchCurve,
    MatchSections,
    Maximize,
    Minimize,
    ObjectiveSpec,
    Press,
    Reach,
    TargetMotion,
    TargetPose,
)
from pneumorph.problem.regions import Layer, Region, Sleeve
from pneumorph.problem.reinforcement import FibresSpec, MembraneSpec, Reinforcement
from pneumorph.problem.robust import RobustSpec
from pneumorph.problem.solid import SolidSpec
from pneumorph.problem.task_limits import MotionLimits, SensitivityLimits, TaskLimits
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
    "DesignSpec",
    "EndEffector",
    "Envelope",
    "FibresSpec",
    "Fold",
    "FreeSpec",
    "Gravity",
    "HalfSpace",
    "Layer",
    "Limits",
    "MakeSpec",
    "MatchCurve",
    "MatchSections",
    "Material",
    "Maximize",
    "MembraneSpec",
    "MeshSpec",
    "Minimize",
    "MotionLimits",
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
    "RobustSpec",
    "SensitivityLimits",
    "Sleeve",
    "SolidSpec",
    "SphereSpec",
    "Spring",
    "Stretch",
    "Symmetry",
    "TargetMotion",
    "TargetPose",
    "Task",
    "TaskLimits",
    "TriangulatedSpec",
    "Trust",
    "admit",
    "codes_of",
    "keep",
    "load",
    "loads",
    "read",
    "reinforcements",
    "with_fewer_chambers",
    "with_further_chamber",
]
