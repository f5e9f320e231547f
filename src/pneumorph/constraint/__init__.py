"""Geometric limits: distances, curvature, fairness, envelope; smooth for the optimiser, certified for the report."""

import pneumorph.numerics  # noqa: F401 (before anything of jax)
from pneumorph.constraint.limits import Limits, Pairs, limits_of
from pneumorph.constraint.report import LimitReading, LimitReport, Places, certify

__all__ = ["LimitReading", "LimitReport", "Limits", "Pairs", "Places", "certify", "limits_of"]
