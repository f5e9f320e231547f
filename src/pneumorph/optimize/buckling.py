"""Keep designs from buckling to a side where part of the body is solved, whose states know of no such motion.

Every design is judged by its pivots against all motions of the whole body. Once a step would have buckled, the steps
after it are told what stiffness is left (`mechanics.solve.lateral`) and how it changes. Not before: thin walls may be
soft, and still far from buckling.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.analysis import (
    Analysis,
    Discretisation,
    lateral_slope_of,
    lateral_stability,
    lateral_stiffness,
)
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import Softest

LEFT, SHARE, STIFF = 0.02, 0.5, 0.5
"""A step is to leave the first of the stiffness at rest or, if that is more, the second of what there is. Above the last
a body is far from buckling."""


@dataclass(frozen=True, eq=False)
class Lateral:
    """How an analysed design stands motions to a side.

    Attributes
    ----------
    stable : {task: flags}
        Whether it is stable against every kind of them.
    softest : {task: motions} or None
        The softest of every kind, once a step would have buckled.
    """

    stable: Mapping[str, Sequence[bool]]
    softest: Mapping[str, Sequence[Softest]] | None = None


def look(disc: Discretisation, analysis: Analysis, closely: bool) -> Lateral:
    """How a design stands motions to a side; closely, with the softest of them."""
    if not closely:
        return Lateral(lateral_stability(disc, analysis))
    found = lateral_stiffness(disc, analysis)
    return Lateral({name: [each.stable for each in motions] for name, motions in found.items()}, found)


def buckles(now: Lateral, after: Lateral) -> bool:
    """Whether a design buckles by a kind of motion against which the one before is stable."""
    return any(
        old and not new
        for name, flags in now.stable.items()
        for old, new in zip(flags, after.stable[name], strict=True)
    )


def lateral_rows(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, lateral: Lateral
) -> tuple[np.ndarray, np.ndarray]:
    """Rows c (k,) and J (k, n) of c + J Ψ ≤ 0 that keep a step from buckling: c is the stiffness to leave less r."""
    found = [(name, soft) for name, motions in (lateral.softest or {}).items() for soft in motions if _is_near(soft)]
    slopes = [-lateral_slope_of(space, disc, analysis, name, soft) for name, soft in found]
    return np.array([_to_leave(soft) - soft.ratio for _, soft in found]), np.reshape(slopes, (-1, space.n))


def lateral_excess(now: Lateral, after: Lateral) -> float:
    """The largest c of these rows after a step; −∞ if they are not known."""
    if now.softest is None or after.softest is None:
        return -np.inf
    found = [
        _to_leave(old) - new.ratio
        for name, motions in now.softest.items()
        for old, new in zip(motions, after.softest[name], strict=True)
        if _is_near(old)
    ]
    return max(found, default=-np.inf)


def _is_near(soft: Softest) -> bool:
    return soft.stable and soft.ratio < STIFF


def _to_leave(soft: Softest) -> float:
    """What a step has to leave of a stiffness; at most what there is, so that there is a step which does."""
    return max(SHARE * soft.ratio, min(LEFT, soft.ratio))
