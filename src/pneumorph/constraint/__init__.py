"""Geometric limits: distances, curvature, skew, stretch, envelope; smooth for the optimiser, certified for reports."""

import pneumorph.numerics  # noqa: F401 (before anything of jax)
from pneumorph.constraint.limits import LimitFunctions, Partners, build_limit_functions
from pneumorph.constraint.report import LimitReading, LimitReport, Places, certify, without_rounding

__all__ = [
    "LimitFunctions",
    "LimitReading",
    "LimitReport",
    "Partners",
    "Places",
    "build_limit_functions",
    "certify",
    "without_rounding",
]
