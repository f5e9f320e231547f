"""Verification cases, and their verdicts: a computed number beside its reference."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np


@dataclass(frozen=True)
class Verdict:
    """One comparison.

    Attributes
    ----------
    quantity : what is compared, with its unit.
    reference, ours : the reference value, and the computed one.
    error : their difference, relative or absolute.
    tolerance : the largest error that passes.
    """

    quantity: str
    reference: float
    ours: float
    error: float
    tolerance: float

    @property
    def passed(self) -> bool:
        """Whether the error is within the tolerance."""
        # Written so that NaN fails.
        return self.error <= self.tolerance


@dataclass(frozen=True)
class Case:
    """A verification case.

    Attributes
    ----------
    name : its name in the table and on the command line.
    verdicts : yields its comparisons; raises `Unavailable` if a solver it needs is not installed.
    source : where the reference comes from.
    """

    name: str
    verdicts: Callable[[], Iterator[Verdict]]
    source: str


class Unavailable(Exception):
    """The case cannot run here; the message says what is missing and how to install it."""


def relative(quantity: str, ours: float, reference: float, tolerance: float) -> Verdict:
    """A verdict with the error |ours − reference| / |reference|.

    Parameters
    ----------
    quantity : str
        Its name and unit.
    ours, reference : float
        In that unit.
    tolerance : float
        Largest error.
    """
    return Verdict(quantity, float(reference), float(ours), float(abs(ours - reference) / abs(reference)), tolerance)


def absolute(quantity: str, ours: float, reference: float, tolerance: float) -> Verdict:
    """A verdict with the error |ours − reference|.

    Parameters
    ----------
    quantity : str
        Its name and unit.
    ours, reference : float
        In that unit.
    tolerance : float
        Largest error.
    """
    return Verdict(quantity, float(reference), float(ours), float(abs(ours - reference)), tolerance)


def at_least(quantity: str, ours: float, least: float) -> Verdict:
    """A verdict that passes if `ours` is not below `least`; the error is what it lacks."""
    return Verdict(quantity, float(least), float(ours), float(np.maximum(0.0, least - ours)), 0.0)
