"""Analysis of one design: mesh, equilibria of its tasks, gradient, and what is reported and stored of it."""

from pneumorph.analysis.accuracy import MeshError, quick_errors
from pneumorph.analysis.analyse import (
    Analysis,
    Discretisation,
    analyse,
    buckling_loads,
    build_discretisation,
    carry_over,
    check_stability,
    discretise,
    lateral_stability,
    lateral_stiffness,
    predict_states,
    with_castings,
)
from pneumorph.analysis.ballooning import (
    expect_limit_points,
    limit_points,
    margin_slopes,
    margins,
    near_margins,
    remember_limit_points,
)
from pneumorph.analysis.collect import (
    collect_castings,
    collect_fields,
    collect_task_results,
    compute_inflation,
    compute_sag,
)
from pneumorph.analysis.explore import Explored, Explorer, Stopped
from pneumorph.analysis.graded import divided, joined, to_divide
from pneumorph.analysis.gradient import AnalysedBody, GradientCheck, analyse_body, run_gradient_check
from pneumorph.analysis.limited import (
    least_motion_rows,
    least_motions,
    motion_rows,
    motion_sizes,
    sensitivities,
    sensitivity_rows,
    stiffness_rows,
    stiffnesses,
)
from pneumorph.analysis.rates import motion_rates
from pneumorph.analysis.simulate import Curve, Simulation, prepare_simulation
from pneumorph.analysis.sized import is_estimated, largest_share, moved, recorded_share, result_share
from pneumorph.analysis.slopes import (
    Slopes,
    design_gradient,
    design_slopes,
    lateral_slope_of,
    strain_shares,
    strain_slopes,
)
from pneumorph.analysis.starting import analyse_start
from pneumorph.analysis.thickening import thickenings

__all__ = [
    "AnalysedBody",
    "Analysis",
    "Curve",
    "Discretisation",
    "Explored",
    "Explorer",
    "GradientCheck",
    "MeshError",
    "Simulation",
    "Slopes",
    "Stopped",
    "analyse",
    "analyse_body",
    "analyse_start",
    "buckling_loads",
    "build_discretisation",
    "carry_over",
    "check_stability",
    "collect_castings",
    "collect_fields",
    "collect_task_results",
    "compute_inflation",
    "compute_sag",
    "design_gradient",
    "design_slopes",
    "discretise",
    "divided",
    "expect_limit_points",
    "is_estimated",
    "joined",
    "largest_share",
    "lateral_slope_of",
    "lateral_stability",
    "lateral_stiffness",
    "least_motion_rows",
    "least_motions",
    "limit_points",
    "margin_slopes",
    "margins",
    "motion_rates",
    "motion_rows",
    "motion_sizes",
    "moved",
    "near_margins",
    "predict_states",
    "prepare_simulation",
    "quick_errors",
    "recorded_share",
    "remember_limit_points",
    "result_share",
    "run_gradient_check",
    "sensitivities",
    "sensitivity_rows",
    "stiffness_rows",
    "stiffnesses",
    "strain_shares",
    "strain_slopes",
    "thickenings",
    "to_divide",
    "with_castings",
]
