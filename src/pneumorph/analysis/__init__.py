"""Analysis of one design: mesh, equilibria of its tasks, gradient, and the results as reported and stored."""

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
from pneumorph.analysis.explore import Explored, Explorer, Stopped
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
from pneumorph.analysis.gradient import AnalysedBody, GradientCheck, analyse_body, gradient_check
from pneumorph.analysis.records import HistoryEntry, Motion, RunResult, SweepStep, TaskResult, from_json, to_json
from pneumorph.analysis.simulate import Curve, Simulation, prepare_simulation
from pneumorph.analysis.slopes import Slopes, design_gradient, design_slopes
from pneumorph.analysis.task_results import task_results

__all__ = [
    "AnalysedBody",
    "Analysis",
    "Curve",
    "Discretisation",
    "Explored",
    "Explorer",
    "Fields",
    "GradientCheck",
    "HistoryEntry",
    "Inflation",
    "Motion",
    "RunResult",
    "Simulation",
    "Slopes",
    "Stopped",
    "SweepStep",
    "TaskResult",
    "analyse",
    "analyse_body",
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
    "sag_of",
    "stable",
    "task_results",
    "to_json",
    "unpack_fields",
]
