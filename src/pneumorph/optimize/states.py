"""Limits on the states of the tasks: known once a design is solved, linearised for the next sub-problem."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np

from pneumorph.analysis import (
    Analysis,
    Discretisation,
    least_motion_rows,
    least_motions,
    margin_slopes,
    margins,
    motion_rows,
    motion_sizes,
    sensitivities,
    sensitivity_rows,
    stiffness_rows,
    stiffnesses,
    strain_shares,
    strain_slopes,
)
from pneumorph.doing import doing
from pneumorph.geometry import DesignSpace
from pneumorph.limits.kinds.states import (
    LEAST,
    MARGIN,
    MOTIONS,
    PER_KPA,
    SENSITIVITIES,
    STIFFNESSES,
    STRAIN,
    direction,
    of_tasks,
)
from pneumorph.limits.limit import ROUNDING, Limit
from pneumorph.limits.report import without_rounding
from pneumorph.optimize.buckling import LateralStability, lateral_rows
from pneumorph.optimize.crossings import MeasuredGap, gap_rows
from pneumorph.optimize.within import Kept
from pneumorph.problem import Problem
from pneumorph.sensitivity import BEYOND


@dataclass(frozen=True)
class Limited:
    """Where a limit holds: the problem, some of its tasks, and their bound."""

    problem: Problem
    tasks: tuple[str, ...]
    bound: float

    def own_motions(self, kind: str) -> dict[str, tuple[str, ...]]:
        """The motions of each task's objective that are of a kind, "length" or "angle"."""
        objectives = {task.name: task.objective for task in self.problem.task}
        return {name: tuple(objectives[name].motions_of(kind)) for name in self.tasks}

    def directions(self, motion: str) -> dict[str, float]:
        """Of each task, 1.0 or -1.0 for the direction of its least motion."""
        return {
            task.name: direction(motion, self.problem, task) for task in self.problem.task if task.name in self.tasks
        }


Values = Callable[[Discretisation, Analysis, Limited], Mapping[str, float]]
Slopes = Callable[[DesignSpace, Discretisation, Analysis, Limited], tuple[np.ndarray, np.ndarray]]


class StateKind(NamedTuple):
    """A limit on the states: its values by task; and (k,) what is not to be beyond it, with derivatives (k, n)."""

    limit: Limit
    values: Values
    slopes: Slopes


def _of_motion(name: str) -> StateKind:
    return StateKind(
        MOTIONS[name],
        lambda disc, analysis, of: motion_sizes(disc, analysis, name, of.tasks),
        lambda space, disc, analysis, of: motion_rows(space, disc, analysis, name, of.tasks),
    )


def _of_least_motion(name: str) -> StateKind:
    return StateKind(
        LEAST[name],
        lambda disc, analysis, of: least_motions(disc, analysis, name, of.directions(name)),
        lambda space, disc, analysis, of: least_motion_rows(space, disc, analysis, name, of.directions(name)),
    )


def _of_stiffness(motion: str) -> StateKind:
    return StateKind(
        STIFFNESSES[motion],
        lambda disc, analysis, of: stiffnesses(disc, analysis, motion, of.tasks),
        lambda space, disc, analysis, of: stiffness_rows(space, disc, analysis, motion, of.tasks),
    )


def _of_sensitivity(kind: str) -> StateKind:
    def values(disc: Discretisation, analysis: Analysis, of: Limited) -> dict[str, float]:
        largest = sensitivities(disc, analysis, of.own_motions(kind))
        return {task: PER_KPA * rate for task, rate in largest.items()}

    def slopes(
        space: DesignSpace, disc: Discretisation, analysis: Analysis, of: Limited
    ) -> tuple[np.ndarray, np.ndarray]:
        rates, derivatives = sensitivity_rows(space, disc, analysis, of.own_motions(kind))
        return PER_KPA * rates, PER_KPA * derivatives

    return StateKind(SENSITIVITIES[kind], values, slopes)


KINDS = (
    StateKind(
        STRAIN,
        lambda disc, analysis, of: strain_shares(disc, analysis),
        lambda space, disc, analysis, of: strain_slopes(space, disc, analysis, of.bound),
    ),
    StateKind(
        MARGIN,
        lambda disc, analysis, of: margins(disc, analysis, of.bound),
        lambda space, disc, analysis, of: margin_slopes(space, disc, analysis, of.bound),
    ),
    *map(_of_motion, MOTIONS),
    *map(_of_least_motion, LEAST),
    *map(_of_stiffness, STIFFNESSES),
    *map(_of_sensitivity, SENSITIVITIES),
)
"""All of them: their words are in `limits.kinds.states`."""

AIM = min(limit.aim for limit, _, _ in KINDS)
"""How far within its bound a step is to bring such a limit, relative to it."""

LEFT = 0.01 * AIM
"""What may be left of such a limit where a step is brought within the limits on the shape."""


@dataclass(frozen=True, eq=False)
class StateLimits:
    """c + J Ψ ≤ 0 near a design, for every limit of this kind and task; empty without such limits.

    Attributes
    ----------
    value : (k,) c relative to the bound, 0.01 is one per cent beyond it.
    jacobian : (k, n) J, by the design variables.
    limits : the limits of the first rows, and `bounds` theirs; the other rows keep the body from buckling laterally and
        from intersecting itself.
    curved : what c is expected to be beyond its linearisation at the end of the next step.
    unknown : the limits of which nothing is known: where no path could be followed as far as the margin asks.
    """

    value: np.ndarray
    jacobian: np.ndarray
    limits: tuple[Limit, ...]
    bounds: tuple[float, ...]
    curved: float = 0.0
    unknown: tuple[Limit, ...] = ()

    def worst(self, step: np.ndarray | None = None) -> float:
        """The largest c, as predicted after a step (n,); −∞ without a limit."""
        value = self.value if step is None else self.value + self.jacobian @ step
        return float(value.max(initial=-np.inf))

    @property
    def violated(self) -> bool:
        """Whether one is beyond its bound."""
        return self.worst() > ROUNDING

    def values(self) -> dict[str, float | None]:
        """The worst value of every limit by its key in the history; None for strain and margin without a limit."""
        values: dict[str, float | None] = {limit.key: None for limit in (STRAIN, MARGIN) if limit.key}
        for limit, bound in dict(zip(self.limits, self.bounds, strict=True)).items():
            worst = max(c for c, own in zip(self.value, self.limits, strict=False) if own == limit)
            values[limit.key or limit.name] = float(bound * (1.0 + limit.sign * worst))
        return values

    @property
    def excess(self) -> np.ndarray:
        """c (k,) for the next step, with what it is to leave: a design that is nearer to its bound may stay there."""
        aimed = self.value + AIM
        return aimed if self.violated else np.minimum(aimed, np.maximum(self.value, 0.0) + LEFT) + self.curved

    def kept(self, phi: np.ndarray, step: np.ndarray) -> Kept | None:
        """What a step (n,) from the design Φ (n,) gains for them, or what it leaves them; None without a limit."""
        if not len(self.value):
            return None
        excess = self.excess
        return Kept(phi, excess - np.maximum(excess + self.jacobian @ step, 0.0), self.jacobian, LEFT)

    def to_meet(self, phi: np.ndarray) -> Kept:
        """What a step from the design Φ (n,) is to leave for them."""
        return Kept(phi, self.excess, self.jacobian, LEFT)

    def bent(self, curvature: float, length: float) -> StateLimits:
        """The same for steps of a length (mm), at the end of which c is larger by the curvature (1/mm²) times ½ℓ²."""
        return self.missing(0.5 * curvature * length**2)

    def missing(self, curved: float) -> StateLimits:
        """The same for a step at the end of which c is larger by so much."""
        return replace(self, curved=curved)

    def curvature(self, worst: float, step: np.ndarray) -> float:
        """The curvature with which a step (n,) led to c = `worst`; 0 without a limit."""
        if not len(self.value):
            return 0.0
        return 2.0 * max(worst - self.worst(step), 0.0) / max(float(np.abs(step).max()), 1e-9) ** 2


def no_states(variables: int) -> StateLimits:
    """Those of a problem without such limits."""
    return StateLimits(np.zeros(0), np.zeros((0, variables)), (), ())


def limited(problem: Problem) -> Iterator[tuple[Limit, Limited, StateKind]]:
    """The limits of a problem on the states of its tasks: as they are called, where they hold, and what they are."""
    for kind in KINDS:
        for limit, bound, tasks in of_tasks(kind.limit, problem):
            yield limit, Limited(problem, tasks, bound), kind


def linear_states(
    problem: Problem,
    space: DesignSpace,
    disc: Discretisation,
    analysis: Analysis,
    lateral: LateralStability | None = None,
    gaps: Sequence[MeasuredGap] = (),
) -> StateLimits:
    """The limits on the states of an analysed design, linearised by an adjoint or a few for each task.

    And what keeps it from buckling laterally and from intersecting itself, where that is known.

    Parameters
    ----------
    problem : Problem
    space : DesignSpace
    disc : Discretisation
        Of the design.
    analysis : Analysis
    lateral : LateralStability, optional
        How it stands lateral motions.
    gaps : sequence of MeasuredGap
        Where steps would have made it intersect itself.
    """
    states = no_states(space.n)
    for limit, of, kind in limited(problem):
        with doing(f"limits.{limit.name}"):
            value, slope = kind.slopes(space, disc, analysis, of)
        states = StateLimits(
            np.concatenate([states.value, limit.sign * (value / of.bound - 1.0)]),
            np.concatenate([states.jacobian, limit.sign * slope / of.bound]),
            (*states.limits, *[limit] * len(value)),
            (*states.bounds, *[of.bound] * len(value)),
            unknown=states.unknown if len(value) else (*states.unknown, limit),
        )
    rows = [gap_rows(space, disc, analysis, gaps)]
    if lateral is not None:
        rows.insert(0, lateral_rows(space, disc, analysis, lateral))
    values, slopes = zip((states.value, states.jacobian), *rows, strict=True)
    return replace(states, value=np.concatenate(values), jacobian=np.concatenate(slopes))


def is_least_known(limit: Limit, value: float, bound: float) -> bool:
    """Whether a limit's worst value is only known to be this or more: a path was followed so far without a limit point.

    That is so of margins alone.
    """
    return limit == MARGIN and value >= BEYOND * bound * (1.0 - ROUNDING)


def in_words(limit: Limit, value: float, bound: float) -> str:
    """The worst value of a limit on states, with its unit."""
    number = f"{limit.told * without_rounding(value):.3g}{limit.suffix}"
    return f"at least {number}" if is_least_known(limit, value, bound) else number


def worst_state(problem: Problem, disc: Discretisation, analysis: Analysis) -> tuple[float, str]:
    """The largest c of an analysed design, −∞ without a limit, and the name of that limit."""
    worst, name = -np.inf, ""
    for limit, of, kind in limited(problem):
        values = kind.values(disc, analysis, of).values()
        excess = max((limit.excess(value, of.bound) for value in values), default=-np.inf)
        if excess > worst:
            worst, name = excess, limit.name
    return worst, name
