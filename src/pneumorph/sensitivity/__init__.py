"""Sensitivity of objectives to shape and pressures: exact gradient, the paper's boundary formula, Taylor tests."""

from pneumorph.sensitivity.adjoint import (
    NodalGradient,
    NodalJacobian,
    by_known,
    gradient,
    residual_jacobian,
    with_border,
)
from pneumorph.sensitivity.boundary import boundary_gradient
from pneumorph.sensitivity.constants import parameter_forces
from pneumorph.sensitivity.lateral import lateral_slope
from pneumorph.sensitivity.margin import BEYOND, Margin, find_margin, limit_slope, margin_slope
from pneumorph.sensitivity.motion import MotionSlopes, motion_slopes, tip_motion_adjoints
from pneumorph.sensitivity.quantities import quantities_at, quantities_of, quantity_slopes
from pneumorph.sensitivity.rate import Rate, compliance, compliance_slope, pressure_rates, rate_slopes
from pneumorph.sensitivity.response import Response, measured_of, response
from pneumorph.sensitivity.stiffer import Stiffer, by_moduli
from pneumorph.sensitivity.taylor import TaylorTest, taylor_test, taylor_test_nearby
from pneumorph.sensitivity.whole import objective_slope, objective_value, tip_stiffness, tip_stiffness_slope

__all__ = [
    "BEYOND",
    "Margin",
    "MotionSlopes",
    "NodalGradient",
    "NodalJacobian",
    "Rate",
    "Response",
    "Stiffer",
    "TaylorTest",
    "boundary_gradient",
    "by_known",
    "by_moduli",
    "compliance",
    "compliance_slope",
    "find_margin",
    "gradient",
    "lateral_slope",
    "limit_slope",
    "margin_slope",
    "measured_of",
    "motion_slopes",
    "objective_slope",
    "objective_value",
    "parameter_forces",
    "pressure_rates",
    "quantities_at",
    "quantities_of",
    "quantity_slopes",
    "rate_slopes",
    "residual_jacobian",
    "response",
    "taylor_test",
    "taylor_test_nearby",
    "tip_motion_adjoints",
    "tip_stiffness",
    "tip_stiffness_slope",
    "with_border",
]
