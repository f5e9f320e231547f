"""The table of limits: a line for each kind; everything else about a limit is in the file of its kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pneumorph.limits.kinds.fold import Folds
from pneumorph.limits.kinds.kind import Kind
from pneumorph.limits.kinds.region import ENDS, ENVELOPE, PLANES, Inside, between_ends, within_envelope
from pneumorph.limits.kinds.states import MARGIN, STRAIN
from pneumorph.limits.kinds.wall import Walls
from pneumorph.limits.limit import Limit
from pneumorph.limits.tube.rim import Rims
from pneumorph.limits.tube.shape import Shapes

if TYPE_CHECKING:
    from pneumorph.problem import Limits

KINDS: tuple[Kind[Any, Any, Any], ...] = (
    Walls(),
    Inside(PLANES, between_ends, cavities=True),
    Folds(),
    Rims(),
    Shapes(),
    Inside(ENDS, between_ends, cavities=False, ends=False),
    Inside(ENVELOPE, within_envelope, cavities=False),
)
"""The kinds of limits that the shape alone decides, in the order in which they are shown."""

OF_STATES = (STRAIN, MARGIN)
"""The limits that the states of the tasks decide, see `optimize.states`."""

OF_SHAPE = tuple(limit for kind in KINDS for limit in kind.limits)

BY_NAME = {limit.name: limit for limit in (*OF_SHAPE, *OF_STATES)}

ROWS = tuple(limit.name for limit in sorted(OF_SHAPE, key=lambda limit: limit not in Shapes().limits))
"""Names of the limits by the number of their rows. It is stored in checkpoints, and so is the order."""


def in_history(limits: Limits) -> list[tuple[Limit, str, float]]:
    """The limits of a problem that its history contains, in the order they are shown: limit, key and bound."""
    found = ((limit, limit.key, limit.read(limits)) for limit in BY_NAME.values())
    return [(limit, key, bound) for limit, key, bound in found if key is not None and bound is not None]
