"""Keep designs from buckling to a side where part of the body is solved, whose states know of no such motion.

Every design is judged by its pivots against all motions of the whole body. Once a step would have buckled, the steps
after it are told how stiff the body still is (`mechanics.solve.lateral`) and how this changes.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.analysis import Analysis, Discretisation, lateral_slope_of, lateral_stability, lateral_stiffness
from pneumorph.errors import ComputationError
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import Softest

Kinds = Mapping[str, Sequence[float]]

LEFT, SHARE, STIFF = 0.1, 0.5, 0.5
"""A step is to leave the first of the stiffness at rest or, if that is more, the second of what there is. Above the
last, over that at rest, a body is far from buckling."""


@dataclass(frozen=True, eq=False)
class Lateral:
    """How an analysed design stands motions to a side.

    Attributes
    ----------
    stable : {task: flags}
        Whether it is stable against every kind of them.
    softest : {task: motions}
        The softest of every kind, once a step would have buckled.
    still : {task: stiffnesses}
        Those at rest of the design that this step began from.
    """

    stable: Mapping[str, Sequence[bool]]
    softest: Mapping[str, Sequence[Softest]]
    still: Kinds

    def pack(self) -> dict[str, Any]:
        """Arrays from which `unpack_still` restores the stiffnesses at rest."""
        return {f"still {name}": np.array(kinds) for name, kinds in self.still.items()}

    def near(self) -> list[tuple[str, Softest, float]]:
        """The task, the motion, and the stiffness at rest of all that a step may make buckle."""
        return [
            (name, soft, still)
            for name, motions in self.softest.items()
            for soft, still in zip(motions, self.still[name], strict=True)
            if soft.stable and soft.stiffness < STIFF * still
        ]


def unpack_still(disc: Discretisation, arrays: Mapping[str, Any]) -> Kinds:
    """The stiffnesses at rest from the arrays of `Lateral.pack`; none where no step would have buckled.

    Raises
    ------
    ComputationError
        If they do not fit the body.
    """
    found = {name: list(map(float, arrays.get(f"still {name}", ()))) for name in disc.tangents}
    if not any(found.values()):
        return {}
    if any(len(kinds) != len(disc.lateral) or min(kinds, default=1.0) <= 0.0 for kinds in found.values()):
        raise ComputationError(
            "the checkpoint does not fit its problem (stiffnesses at rest); start the run again in another directory"
        )
    return found


def look(disc: Discretisation, analysis: Analysis, still: Kinds) -> Lateral:
    """How a design stands motions to a side; closely, if stiffnesses at rest are given."""
    if not still:
        return Lateral(lateral_stability(disc, analysis), {}, {})
    found = lateral_stiffness(disc, analysis)
    return Lateral({name: [each.stable for each in motions] for name, motions in found.items()}, found, still)


def look_closely(disc: Discretisation, analysis: Analysis) -> Lateral:
    """The same, with stiffnesses at rest of this design."""
    at_rest = lateral_stiffness(disc, analysis, at_rest=True)
    return look(disc, analysis, {name: [each.stiffness for each in kinds] for name, kinds in at_rest.items()})


def buckles(now: Lateral, after: Lateral) -> bool:
    """Whether a design buckles by a kind of motion against which the one before is stable."""
    pairs = [pair for name, flags in now.stable.items() for pair in zip(flags, after.stable[name], strict=True)]
    return any(old and not new for old, new in pairs)


def lateral_rows(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, lateral: Lateral
) -> tuple[np.ndarray, np.ndarray]:
    """Rows c (k,) and J (k, n) of c + J Ψ ≤ 0, over stiffnesses at rest: c is what a step is to leave, less λ."""
    near = lateral.near()
    slopes = [-lateral_slope_of(space, disc, analysis, name, soft) / still for name, soft, still in near]
    values = [_to_leave(soft.stiffness / still) - soft.stiffness / still for _, soft, still in near]
    return np.array(values), np.reshape(slopes, (-1, space.n))


def lateral_excess(now: Lateral, after: Lateral) -> float:
    """The largest c of these rows after a step; −∞ if there is none."""
    found = [
        (_to_leave(old.stiffness / still) - new.stiffness / still)
        for name in after.softest
        for old, new, still in zip(now.softest[name], after.softest[name], now.still[name], strict=True)
        if old.stable
    ]
    return max(found, default=-np.inf)


def _to_leave(share: float) -> float:
    """What a step has to leave of a share of the stiffness at rest: at most that, for there must be such a step."""
    return max(SHARE * share, min(LEFT, share))
