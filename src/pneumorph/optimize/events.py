"""Events of a design run, for whoever follows it: a screen, a run directory, a test."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

from pneumorph.geometry import Body
from pneumorph.results import Fields, FineResult, HistoryEntry, MotionRates
from pneumorph.symmetry.part import Part


@dataclass(frozen=True)
class Started:
    """The loop begins; after design `iteration` if it was resumed.

    `part` of the body is analysed. Where it begins on larger elements than asked for, `larger` is their size in mm.
    """

    iteration: int
    iterations: int
    variables: int
    larger: float | None
    elements: int
    element: str
    dofs: int
    part: Part


@dataclass(frozen=True)
class BroughtWithin:
    """The start violated limits, one sentence for each; moving points by up to `moved_mm` repaired that."""

    violated: tuple[str, ...]
    moved_mm: float


@dataclass(frozen=True)
class BegunLower:
    """The start has no state at the pressures asked for and begins at lower ones, by task and chamber in MPa."""

    pressures: Mapping[str, Mapping[str, float]]


@dataclass(frozen=True)
class BegunBeyond:
    """States of the start violate limits, which designs reduce first; one sentence for each."""

    violated: tuple[str, ...]


@dataclass(frozen=True)
class Remeshed:
    """The body, or the `part` of it that is analysed, was remeshed; `reason` is a sentence."""

    iteration: int
    reason: str
    elements: int
    quality: float
    part: Part


@dataclass(frozen=True)
class Divided:
    """Elements were divided where the error of the mesh came from, of which `share` is relative to the motion.

    `elements` are those of the body, or of the `part` of it that is analysed.
    """

    iteration: int
    share: float
    elements: int
    part: Part


@dataclass(frozen=True)
class NotDivided:
    """The error of the mesh, relative to the motion, is more than asked for, but elements stay; `reason` says why."""

    iteration: int
    share: float
    reason: str


@dataclass(frozen=True)
class Served:
    """Larger elements than asked for have served with design `iteration`; `reason` is a sentence."""

    iteration: int
    reason: str


@dataclass(frozen=True)
class Refined:
    """Design `iteration` is on elements of the size asked for, `size` in mm; those before it were on larger ones.

    It has the shape of design `shape`. `elements` are those of the body, or of the `part` of it that is analysed.
    """

    iteration: int
    shape: int
    size: float
    elements: int
    part: Part


@dataclass(frozen=True)
class NotRefined:
    """Design `iteration` does not go on with elements of the size asked for; `reason` is a sentence."""

    iteration: int
    reason: str


@dataclass(frozen=True)
class MeshKept:
    """A poor mesh is kept, since no new one could be made; `reason` is a sentence."""

    iteration: int
    reason: str
    quality: float


@dataclass(frozen=True)
class DesignRejected:
    """A step was rejected; `reason` is a sentence. The next step is at most `step_mm` long."""

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
        Its line in the history.
    body : Body
    pressures : by task, then by chamber, MPa.
    fields : Fields
        Its mesh with displacements and stretches.
    state : arrays and JSON values from which the loop can be resumed.
    """

    iteration: int
    entry: HistoryEntry
    body: Body
    pressures: dict[str, dict[str, float]]
    fields: Fields
    state: dict[str, Any]


@dataclass(frozen=True)
class Finished:
    """The loop has ended; `reason` is a sentence.

    The last design is the best: each is better than its predecessor, compared on one mesh. `held` says whether it
    satisfies every limit; `stable`, by task, whether its state is stable, also where a part was analysed; `rates` how
    fast its motions change; `margins`, of tasks that are near ballooning, `followed`, of those of which that is not
    known, and `finer`, see `RunResult`. `fields` are those of the last design, with its sag under weight alone and its
    inflation.
    """

    iteration: int
    reason: str
    held: bool
    stable: dict[str, bool]
    rates: Mapping[str, MotionRates]
    margins: Mapping[str, float]
    followed: Mapping[str, float]
    finer: Mapping[str, FineResult]
    fields: Fields


Event = (
    Started
    | BroughtWithin
    | BegunLower
    | BegunBeyond
    | Remeshed
    | Divided
    | NotDivided
    | Served
    | Refined
    | NotRefined
    | MeshKept
    | DesignRejected
    | DesignAccepted
    | Finished
)
