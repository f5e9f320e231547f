"""Certified worst values of all limits on a body: enclosures on whole surfaces, and the report of them."""

from pneumorph.limits.certify.report import LimitReading, LimitReport, Places, certify, without_rounding

__all__ = ["LimitReading", "LimitReport", "Places", "certify", "without_rounding"]
