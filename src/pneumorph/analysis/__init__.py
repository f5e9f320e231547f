"""Analysis of one design: mesh, equilibria of its tasks, gradient, and the results as reported and stored."""

from pneumorph.analysis.analyse import (
    Analysis,
    Discretisation,
    analyse,
    build_discretisation,
    carry_over,
    check_stability,
    discretise,
    predict_states,
)
from pneumorph.analysis.explore import Explored, Explorer, Stopped
from pneumorph.analysis.fields import (
    Fields,
    Inflation,
    collect_fields,
    compute_inflation,
    compute_sag,
    nodal_stress,
    nodal_stretch,
    unpack_fields,
)
from pneumorph.analysis.gradient import AnalysedBody, GradientCheck, analyse_body, run_gradient_check
from pneumorph.analysis.records import HistoryEntry, Motion, RunResult, SweepStep, TaskResult, from_json, to_json
from pneumorph.analysis.simulate import Curve, Simulation, prepare_simulation
from pneumorph.analysis.slopes import (
    Slopes,
    design_gradient,
    design_slopes,
    margin_slopes,
    margins,
    strain_shares,
    strain_slopes,
)
from pneumorph.analysis.task_results import collect_task_results

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
    "carry_over",
    "check_stability",
    "collect_fields",
    "collect_task_results",
    "compute_inflation",
    "compute_sag",
    "design_gradient",
    "design_slopes",
    "discretise",
    "from_json",
    "margin_slopes",
    "margins",
    "nodal_stress",
    "nodal_stretch",
    "predict_states",
    "prepare_simulation",
    "run_gradient_check",
    "strain_shares",
    "strain_slopes",
    "to_json",
    "unpack_fields",
]
