"""Geometric limits: distances, curvature, fairness, envelope; smooth for the optimiser, certified for the report."""

from pneumorph.constraint.limits import Limits, Pairs, limits_of
from pneumorph.constraint.report import LimitReport, Places, Reading, report

__all__ = ["LimitReport", "Limits", "Pairs", "Places", "Reading", "limits_of", "report"]
