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
from pneumorph.sensitivity.lateral import lateral_slope
from pneumorph.sensitivity.margin import BEYOND, Margin, find_margin, margin_slope
from pneumorph.sensitivity.motion import MotionSlopes, motion_slopes, tip_motion_adjoints
from pneumorph.sensitivity.pressure_rate import PressureRate, pressure_rates, rate_slopes
from pneumorph.sensitivity.response import Response, measured_of, response
from pneumorph.sensitivity.taylor import TaylorTest, taylor_test, taylor_test_nearby

__all__ = [
    "BEYOND",
    "Margin",
    "MotionSlopes",
    "NodalGradient",
    "NodalJacobian",
    "PressureRate",
    "Response",
    "TaylorTest",
    "boundary_gradient",
    "by_known",
    "find_margin",
    "gradient",
    "lateral_slope",
    "margin_slope",
    "measured_of",
    "motion_slopes",
    "pressure_rates",
    "rate_slopes",
    "residual_jacobian",
    "response",
    "taylor_test",
    "taylor_test_nearby",
    "tip_motion_adjoints",
    "with_border",
]
