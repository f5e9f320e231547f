"""What a verification case says: a number of ours beside the one it should be."""

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
    reference, ours : the number it should be, and the one that was computed.
    error : how far apart, in the measure of `tolerance`.
    tolerance : the largest error that passes.
    """

    quantity: str
    reference: float
    ours: float
    error: float
    tolerance: float

    @property
    def passed(self) -> bool:
        # Written so that an error that is no number fails.
        return self.error <= self.tolerance


@dataclass(frozen=True)
class Case:
    """A verification case.

    Attributes
    ----------
    name : how it is asked for.
    verdicts : yields its comparisons; raises `Unavailable` where a solver it needs is not installed.
    source : where the reference comes from.
    """

    name: str
    verdicts: Callable[[], Iterator[Verdict]]
    source: str


class Unavailable(Exception):
    """A case cannot run here; the message says what is missing and how to get it."""


def relative(quantity: str, ours: float, reference: float, tolerance: float) -> Verdict:
    """The error is |ours − reference| / |reference|."""
    return Verdict(quantity, float(reference), float(ours), float(abs(ours - reference) / abs(reference)), tolerance)


def absolute(quantity: str, ours: float, reference: float, tolerance: float) -> Verdict:
    """The error is |ours − reference|."""
    return Verdict(quantity, float(reference), float(ours), float(abs(ours - reference)), tolerance)


def at_least(quantity: str, ours: float, least: float) -> Verdict:
    """The error is what is missing to `least`, of which nothing may be."""
    return Verdict(quantity, float(least), float(ours), float(np.maximum(0.0, least - ours)), 0.0)
