"""One design analysed: its mesh, the equilibria of its tasks, the gradient, and the results as reported and stored."""

from pneumorph.analysis.analyse import (
    Analysis,
    Discretisation,
    analyse,
    build_discretisation,
    carried_over,
    discretise,
    predicted,
    stable,
)
from pneumorph.analysis.answers import answers
from pneumorph.analysis.fields import (
    Fields,
    Inflation,
    fields_of,
    inflation_of,
    nodal_stress,
    nodal_stretch,
    sag_of,
    unpack_fields,
)
from pneumorph.analysis.gradient import GradientCheck, Probe, gradient_check, probe
from pneumorph.analysis.records import HistoryEntry, Motion, RunResult, SweepStep, TaskResult, from_json, to_json
from pneumorph.analysis.simulate import Curve, Simulation, prepare_simulation
from pneumorph.analysis.slopes import Slopes, design_gradient, design_slopes

__all__ = [
    "Analysis",
    "Curve",
    "Discretisation",
    "Fields",
    "GradientCheck",
    "HistoryEntry",
    "Inflation",
    "Motion",
    "Probe",
    "RunResult",
    "Simulation",
    "Slopes",
    "SweepStep",
    "TaskResult",
    "analyse",
    "answers",
    "build_discretisation",
    "carried_over",
    "design_gradient",
    "design_slopes",
    "discretise",
    "fields_of",
    "from_json",
    "gradient_check",
    "inflation_of",
    "nodal_stress",
    "nodal_stretch",
    "predicted",
    "prepare_simulation",
    "probe",
    "sag_of",
    "stable",
    "to_json",
    "unpack_fields",
]
