"""What happens in a design run, told to whoever watches: a screen, a run directory, a test."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pneumorph.analysis import Fields, HistoryEntry
from pneumorph.geometry import Body


@dataclass(frozen=True)
class Started:
    """The loop begins, after design `iteration` when it was resumed.

    With a `mirror` plane it is half the body that is analysed.
    """

    iteration: int
    iterations: int
    variables: int
    elements: int
    element: str
    dofs: int
    mirror: str | None


@dataclass(frozen=True)
class BroughtWithin:
    """The start broke the limits in `broken`, one sentence each; moving points by up to `moved_mm` repaired that."""

    broken: tuple[str, ...]
    moved_mm: float


@dataclass(frozen=True)
class Remeshed:
    """The body was meshed anew for a reason given as a sentence."""

    iteration: int
    reason: str
    elements: int
    quality: float


@dataclass(frozen=True)
class MeshKept:
    """A mesh that has become poor goes on, since no new one could be made for a reason given as a sentence."""

    iteration: int
    reason: str
    quality: float


@dataclass(frozen=True)
class DesignRejected:
    """A step was taken back for a reason given as a sentence; the next is at most `step_mm` long."""

    iteration: int
    reason: str
    step_mm: float


@dataclass(frozen=True)
class DesignAccepted:
    """A design was accepted.

    Attributes
    ----------
    iteration : int
        0 is the starting design.
    entry : HistoryEntry
        Its line of the history.
    body : Body
    pressures : by task, then by chamber, MPa.
    fields : Fields
        Its mesh with displacements and stretches.
    state : arrays and JSON values from which the loop goes on.
    """

    iteration: int
    entry: HistoryEntry
    body: Body
    pressures: dict[str, dict[str, float]]
    fields: Fields
    state: dict[str, Any]


@dataclass(frozen=True)
class Finished:
    """The loop has ended for a reason given as a sentence.

    The last design is the best: each is better than the one before, measured on one mesh. `held` tells whether it keeps
    every limit, `stable` by task whether its state is stable, as a whole body too where half of it was analysed. The
    `fields` are those of the last design, with what its weight alone does.
    """

    iteration: int
    reason: str
    held: bool
    stable: dict[str, bool]
    fields: Fields


Event = Started | BroughtWithin | Remeshed | MeshKept | DesignRejected | DesignAccepted | Finished
