"""Keep designs from buckling laterally where part of the body is solved, whose states know of no such motion.

Designs are judged by their pivots against all motions of the whole body, which costs a factorisation for each kind of
motion. Where a design would bear several times its loads, the next few are not factorised, unless one before has come
nearer to buckling: the multiple is known to first order only, and a body that buckles soon may seem to become stiffer
with more load. The last design of a run is: before it is accepted where the number of designs ends the run (`trial`),
else after (`analysis.check_stability`). Once a step would have buckled, all are, and the steps after it are told how
stiff the body is (`mechanics.solve.lateral`) and how this changes.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from pneumorph.analysis import Analysis, Discretisation, buckling_loads, lateral_slope_of, lateral_stiffness
from pneumorph.errors import ProblemError
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import Softest

Stiffnesses = Mapping[str, Sequence[float]]


@dataclass(frozen=True)
class LateralSettings:
    """How much lateral stiffness a step is to leave, once a step would have buckled."""

    left: float = 0.1
    """Of the stiffness at rest: the margin against buckling."""

    share: float = 0.5
    """Of the stiffness that there is, if that is more: stiffness is known to first order only."""

    far: float = 0.5
    """Above this part of the stiffness at rest a body is far from buckling, and steps need no row for it."""

    safe: float = 3.0
    """A design that would buckle at more than this multiple of its loads is far enough for the next ones not to be
    judged: a column before its first step that buckles is at 1.25 and 1.06 times."""

    unjudged: int = 4
    """Most designs in a row that are not judged."""


LATERAL = LateralSettings()


@dataclass(frozen=True, eq=False)
class LateralStability:
    """The stability of an analysed design against lateral motions.

    Attributes
    ----------
    stable : {task: flags}
        Whether it is stable against every kind of them.
    softest : {task: motions}
        The softest of every kind, once a step would have buckled.
    at_rest : {task: stiffnesses}
        Those at rest of the first design of which a step would have buckled; nothing before.
    load : float
        The least multiple of the loads at which the last design that was judged would buckle, to first order, or one
        before it that was nearer to buckling than is safe; 1 once a step would have.
    unjudged : int
        How many designs have not been judged since.
    """

    stable: Mapping[str, Sequence[bool]]
    softest: Mapping[str, Sequence[Softest]]
    at_rest: Stiffnesses
    load: float = 1.0
    unjudged: int = 0

    def pack(self) -> dict[str, Any]:
        """Arrays from which `recall` restores the stiffnesses at rest and the load."""
        at_rest = {f"at rest {name}": np.array(kinds) for name, kinds in self.at_rest.items()}
        return at_rest | {"buckling load": np.array(self.load)}

    def near(self) -> list[tuple[str, Softest, float]]:
        """The task, the motion, and the stiffness at rest of all that a step may make buckle."""
        return [
            (name, soft, at_rest)
            for name, motions in self.softest.items()
            for soft, at_rest in zip(motions, self.at_rest[name], strict=True)
            if soft.stable and soft.stiffness < LATERAL.far * at_rest
        ]


def judge(disc: Discretisation, analysis: Analysis, at_rest: Stiffnesses) -> LateralStability:
    """The lateral stability of a design; with its stiffness, if stiffnesses at rest are given."""
    softest = lateral_stiffness(disc, analysis)
    stable = {name: [each.stable for each in motions] for name, motions in softest.items()}
    if at_rest:
        return LateralStability(stable, softest, at_rest)
    if not disc.lateral:
        return LateralStability(stable, {}, {}, math.inf)
    return LateralStability(stable, {}, {}, min(buckling_loads(disc, analysis, softest).values()))


def judge_after(disc: Discretisation, analysis: Analysis, before: LateralStability) -> LateralStability:
    """The lateral stability of a design a step after another, which is as that one's where it was far from buckling.

    Parameters
    ----------
    disc, analysis : the mesh of the design, perhaps a new one, and its states.
    before : of the design before the step.
    """
    if before.load > LATERAL.safe and before.unjudged < LATERAL.unjudged:
        return replace(before, unjudged=before.unjudged + 1)
    return rejudge(disc, analysis, before.at_rest, before.load)


def rejudge(disc: Discretisation, analysis: Analysis, at_rest: Stiffnesses, load: float) -> LateralStability:
    """The lateral stability of a design, of which a design before would have borne a multiple `load` of its loads."""
    after = judge(disc, analysis, at_rest)
    return replace(after, load=min(after.load, load)) if load <= LATERAL.safe else after


def recall(disc: Discretisation, analysis: Analysis, arrays: Mapping[str, Any]) -> LateralStability:
    """The lateral stability of a design, with what is known of it by the arrays of `LateralStability.pack`.

    Raises
    ------
    ProblemError
        If they do not fit the body.
    """
    at_rest = {name: list(map(float, arrays.get(f"at rest {name}", ()))) for name in disc.tangents}
    if not any(at_rest.values()):
        at_rest = {}
    kinds, load = len(disc.lateral), np.asarray(arrays.get("buckling load", np.inf))
    if any(len(each) != kinds or min(each, default=1.0) <= 0.0 for each in at_rest.values()) or load.shape:
        raise ProblemError(
            "the checkpoint does not fit its problem (stiffnesses at rest); start the run again in another directory"
        )
    return rejudge(disc, analysis, at_rest, float(load))


def judge_closely(disc: Discretisation, analysis: Analysis) -> LateralStability:
    """The same, with stiffnesses at rest of this design."""
    at_rest = lateral_stiffness(disc, analysis, at_rest=True)
    return judge(disc, analysis, {name: [each.stiffness for each in kinds] for name, kinds in at_rest.items()})


def buckles(now: LateralStability, after: LateralStability) -> bool:
    """Whether a design buckles by a kind of motion against which the one before is stable."""
    pairs = [pair for name, flags in now.stable.items() for pair in zip(flags, after.stable[name], strict=True)]
    return any(old and not new for old, new in pairs)


def lateral_rows(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, lateral: LateralStability
) -> tuple[np.ndarray, np.ndarray]:
    """Rows c (k,) and J (k, n) of c + J Ψ ≤ 0, over stiffnesses at rest: c is what a step is to leave, less λ.

    Parameters
    ----------
    space, disc : the design space and the mesh of the design.
    analysis : of the design.
    lateral : its stability, from which no rows follow unless stiffnesses at rest are known.
    """
    near = lateral.near()
    slopes = [-lateral_slope_of(space, disc, analysis, name, soft) / at_rest for name, soft, at_rest in near]
    values = [_to_leave(soft.stiffness / at_rest) - soft.stiffness / at_rest for _, soft, at_rest in near]
    return np.array(values), np.reshape(slopes, (-1, space.n))


def lateral_excess(now: LateralStability, after: LateralStability) -> float:
    """The largest c of these rows after a step; −∞ if there is none."""
    excesses = [
        (_to_leave(old.stiffness / at_rest) - new.stiffness / at_rest)
        for name in after.softest
        for old, new, at_rest in zip(now.softest[name], after.softest[name], now.at_rest[name], strict=True)
        if old.stable
    ]
    return max(excesses, default=-np.inf)


def _to_leave(share: float) -> float:
    """What a step has to leave of a share of the stiffness at rest: at most that, for there must be such a step."""
    return max(LATERAL.share * share, min(LATERAL.left, share))
