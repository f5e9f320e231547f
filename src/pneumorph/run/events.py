"""What happens in a design run, told to whoever watches: a screen, a log, a test."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any


@dataclass(frozen=True)
class Started:
    """The loop begins, after `iteration` designs when it was resumed."""

    iteration: int
    iterations: int
    variables: int
    elements: int
    dofs: int


@dataclass(frozen=True)
class SubproblemDone:
    """A step has been found on the proxy; its equilibrium is next."""

    iteration: int
    evaluations: int
    step_mm: float
    seconds: float


@dataclass(frozen=True)
class DesignAccepted:
    """A design was accepted; `line` is its line of the history."""

    iteration: int
    line: Mapping[str, Any]


@dataclass(frozen=True)
class DesignRejected:
    """A step was taken back for a reason given as a sentence; the next one is at most `step_mm` long."""

    iteration: int
    reason: str
    step_mm: float


@dataclass(frozen=True)
class Remeshed:
    """The body was meshed anew for a reason given as a sentence."""

    iteration: int
    reason: str
    elements: int
    quality: float


@dataclass(frozen=True)
class Finished:
    """The loop has ended for a reason given as a sentence."""

    iteration: int
    reason: str


Event = Started | SubproblemDone | DesignAccepted | DesignRejected | Remeshed | Finished
