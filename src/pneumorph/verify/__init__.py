"""Verification: closed forms, other solvers, and balances that the mechanics must keep."""

from pneumorph.verify.suite import cases
from pneumorph.verify.verdict import Case, Unavailable, Verdict

__all__ = ["Case", "Unavailable", "Verdict", "cases"]
