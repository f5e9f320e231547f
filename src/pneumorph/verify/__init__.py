"""Verification of the mechanics against closed forms, other solvers, and balances of energy and force."""

from pneumorph.verify.suite import cases
from pneumorph.verify.verdict import Case, Unavailable, Verdict

__all__ = ["Case", "Unavailable", "Verdict", "cases"]
