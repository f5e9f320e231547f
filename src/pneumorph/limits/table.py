"""The table of limits: a line for each kind; everything else about a limit is in the file of its kind."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from pneumorph.limits.kinds.fold import Folds
from pneumorph.limits.kinds.kind import Kind
from pneumorph.limits.kinds.region import ENDS, ENVELOPE, PLANES, Inside, between_ends, within_envelope
from pneumorph.limits.kinds.states import OF_STATES, of_tasks
from pneumorph.limits.kinds.wall import Walls
from pneumorph.limits.lattice.bending import Bendings
from pneumorph.limits.lattice.scaling import Scalings
from pneumorph.limits.lattice.space import Spaces
from pneumorph.limits.lattice.volume import Volumes
from pneumorph.limits.limit import Limit
from pneumorph.limits.obstacles import OBSTACLES, Obstacles
from pneumorph.limits.tube.rim import Rims
from pneumorph.limits.tube.shape import Shapes

if TYPE_CHECKING:
    from pneumorph.problem import Problem

TUBE_KINDS: tuple[Kind[Any, Any, Any], ...] = (
    Walls(),
    Inside(PLANES, between_ends, cavities=True),
    Folds(),
    Rims(),
    Shapes(),
    Inside(ENDS, between_ends, cavities=False, ends=False),
    Inside(ENVELOPE, within_envelope, cavities=False),
)
"""The kinds of limits that the shape of a body of tubes decides, in the order in which they are shown."""

LATTICE_KINDS: tuple[Kind[Any, Any, Any], ...] = (
    Walls(),
    Folds(),
    Scalings(),
    Inside(ENVELOPE, within_envelope, cavities=False),
    Spaces(),
    Bendings(),
    Volumes(),
)
"""The same of a body from a file. Its exterior contains base and tip, so walls there need no limit of their own."""

OF_SHAPE = tuple(dict.fromkeys(limit for kind in (*TUBE_KINDS, *LATTICE_KINDS, Obstacles()) for limit in kind.limits))
"""Those on obstacles are of problems that have some, see `limits_of`."""

BY_NAME = {limit.name: limit for limit in (*OF_SHAPE, *OF_STATES)}

ROWS = tuple(limit.name for limit in sorted(OF_SHAPE, key=lambda limit: limit not in Shapes().limits))
"""Names of the limits by the number of their rows. It is stored in checkpoints, and so is the order."""


def in_history(problem: Problem) -> list[tuple[Limit, str, float]]:
    """The limits of a problem that its history contains, in the order they are shown: limit, key and bound."""
    kinds = TUBE_KINDS if problem.limits.scaling is None else LATTICE_KINDS
    beside = (OBSTACLES,) if problem.obstacle else ()
    limits = (*(limit for kind in kinds for limit in kind.limits), *beside)
    of_shape = [(limit, limit.read(problem.limits)) for limit in limits]
    of_states = [(limit, bound) for each in OF_STATES for limit, bound, _ in of_tasks(each, problem)]
    known = [(limit, limit.key, bound) for limit, bound in (*of_shape, *of_states)]
    return [(limit, key, bound) for limit, key, bound in known if key is not None and bound is not None]
