"""Geometric limits: distances, curvature, fairness, envelope; smooth for the optimiser, finer for the report."""

from pneumorph.constraint.limits import Limits, Pairs, limits_of
from pneumorph.constraint.report import LimitReport, Reading, report

__all__ = ["LimitReport", "Limits", "Pairs", "Reading", "limits_of", "report"]
