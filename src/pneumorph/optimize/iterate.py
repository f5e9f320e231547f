"""The current iterate of a run: an accepted design with the derivatives that the next step is computed from."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Any

import numpy as np

from pneumorph.analysis import (
    Analysis,
    Discretisation,
    MeshError,
    Slopes,
    checkpoint,
    design_slopes,
    is_estimated,
    moved,
    quick_errors,
)
from pneumorph.limits.report import LimitReport
from pneumorph.mechanics import rest
from pneumorph.optimize import crossings
from pneumorph.optimize.buckling import LateralStability, judge_closely
from pneumorph.optimize.clock import Clock
from pneumorph.optimize.crossings import Crossing, joined, measured
from pneumorph.optimize.model import Curvature, Proxy, no_curvature, unpack_curvature
from pneumorph.optimize.settings import TrialSettings
from pneumorph.optimize.setup import Setup
from pneumorph.optimize.states import StateLimits, linear_states
from pneumorph.optimize.step import Stepper
from pneumorph.problem import Problem


@dataclass(frozen=True, eq=False)
class AnalysedDesign:
    """A design within its limits on the shape, with the states of its tasks.

    Attributes
    ----------
    analysis : Analysis
    disc : Discretisation
        Its mesh and model.
    report : LimitReport
        The certified limits on its shape.
    lateral : LateralStability
        Its stability against lateral buckling.
    """

    analysis: Analysis
    disc: Discretisation
    report: LimitReport
    lateral: LateralStability


@dataclass(frozen=True, eq=False)
class Learnt:
    """What the designs so far have taught for the steps to come.

    Attributes
    ----------
    stepper : Stepper
        The method that finds steps, with what it keeps from step to step.
    curvature : Curvature
        Of the objective, along the last steps.
    radius : float
        Of the trust region, in reference steps.
    objectives : tuple of float
        Of the designs so far whose states satisfy their limits.
    stride : float
        How long the first part of the next step may be, in reference steps, see `way.follow`.
    state_curvature : float
        Of the limits on states along the last step, 1/mm².
    looked : (tasks,) or (0,) array
        How far the tip moved in every task of the design whose error of the mesh was estimated last, mm.
    at_rest : float, optional
        What tasks with targets add to the objective where nothing moves the body.
    crossings : tuple of Crossing
        Where steps would have made the body intersect itself.
    """

    stepper: Stepper
    curvature: Curvature
    radius: float
    objectives: tuple[float, ...]
    stride: float = TrialSettings.stride
    state_curvature: float = 0.0
    looked: np.ndarray = field(default_factory=lambda: np.zeros(0))
    at_rest: float | None = None
    crossings: tuple[Crossing, ...] = ()

    @property
    def first(self) -> float:
        """What objectives are measured by: the first one, or that at rest where a run has begun near its targets."""
        return max(abs(self.objectives[0]), self.at_rest or 0.0)

    def pack(self) -> dict[str, Any]:
        """Arrays and numbers from which `unpack_learnt` restores it."""
        return {
            "radius": self.radius,
            "stride": self.stride,
            "values": np.array(self.objectives),
            "looked": self.looked,
            "at_rest": self.at_rest,
            **crossings.pack(self.crossings),
            **self.stepper.pack(),
            **self.curvature.pack(),
        }


def unpack_learnt(setup: Setup, state: Mapping[str, Any]) -> Learnt:
    """What was packed; its last objective is that of the design itself, which `evaluate` adds again."""
    known = "curvature_phi" in state
    return Learnt(
        setup.stepper.unpack(dict(state)),
        unpack_curvature(state) if known else no_curvature(setup.space.n),
        float(state["radius"]),
        tuple(map(float, state["values"]))[:-1],
        float(state.get("stride", TrialSettings.stride)),
        looked=np.asarray(state.get("looked", np.zeros(0))),
        at_rest=state.get("at_rest"),
        crossings=crossings.unpack(state, (task.name for task in setup.problem.task)),
    )


@dataclass(frozen=True, eq=False)
class Iterate:
    """An accepted design with its derivatives.

    Attributes
    ----------
    number : int
        0 is the start.
    design : AnalysedDesign
    learnt : Learnt
    slopes : Slopes
        Derivatives of the objective.
    states : StateLimits
        The limits on its states, linearised.
    optimality : float
        The part of the objective's gradient that the limits do not balance.
    errors : {task: MeshError}
        By the mesh, where they are estimated.
    took : float
        Seconds in which it was found; of one that a run goes on with, those of its derivatives. 0 for the start: it is
        searched from rest and may compile kernels, which tells nothing of how long a design takes.
    """

    number: int
    design: AnalysedDesign
    learnt: Learnt
    slopes: Slopes
    states: StateLimits
    optimality: float
    errors: Mapping[str, MeshError] = field(default_factory=dict)
    took: float = 0.0

    @property
    def analysis(self) -> Analysis:
        """The states of its tasks."""
        return self.design.analysis

    @property
    def disc(self) -> Discretisation:
        """Its mesh and model."""
        return self.design.disc

    @property
    def lateral(self) -> LateralStability:
        """Its stability against lateral buckling."""
        return self.design.lateral

    @property
    def feasible(self) -> bool:
        """Whether it satisfies every limit, those on its states too."""
        return self.design.report.satisfied() and not self.states.violated

    def learning(self, **known: Any) -> Iterate:
        """The same design with other knowledge: fields of `Learnt`."""
        return replace(self, learnt=replace(self.learnt, **known))

    def proxy(self) -> Proxy:
        """The model of the objective near it."""
        return Proxy(self.slopes.total, np.concatenate([self.slopes.factors, self.learnt.curvature.factors()]))

    def predicted_gain(self, proxy: Proxy, step: np.ndarray) -> float:
        """Of a step (n,): of the objective, or of the limits on states while these are violated."""
        if self.states.violated:
            return self.states.worst() - max(self.states.worst(step), 0.0)
        return -proxy.change(step)[0]

    def pack(self) -> dict[str, Any]:
        """Arrays and numbers from which a run can be resumed."""
        return {
            "iteration": self.number,
            **self.lateral.pack(),
            **self.learnt.pack(),
            **checkpoint.pack(self.analysis, self.disc),
        }


def evaluate(setup: Setup, number: int, design: AnalysedDesign, learnt: Learnt, clock: Clock) -> Iterate:
    """Evaluate the derivatives of an accepted design.

    Parameters
    ----------
    setup : of the run.
    number : of the design.
    design : which was accepted.
    learnt : from the designs before it.
    clock : counts the time.

    Raises
    ------
    ComputationError
        If an objective has no derivative at this design.
    """
    with clock.phase("gradient"):
        slopes = design_slopes(setup.problem, setup.space, design.disc, design.analysis)
        gaps = measured(design.disc, design.analysis, learnt.crossings)
        states = linear_states(setup.problem, setup.space, design.disc, design.analysis, design.lateral, gaps)
    with clock.phase("subproblem"):
        optimality = setup.optimality(design.analysis.phi, slopes.total, states)
    # Designs are compared by their objective from the first one on that satisfies the limits on states.
    objectives = () if states.violated else (*learnt.objectives, design.analysis.value)
    at_rest = _at_rest(setup.problem, design) if learnt.at_rest is None else learnt.at_rest
    known = tuple(each.crossing for each in gaps)
    learnt = replace(learnt, objectives=objectives, at_rest=at_rest, crossings=known)
    took = clock.seconds()["total"] if number else 0.0
    return Iterate(number, design, learnt, slopes, states, optimality, took=took)


def _at_rest(problem: Problem, design: AnalysedDesign) -> float:
    """What tasks with targets add to the objective where nothing moves the body."""
    total = 0.0
    for task in problem.task:
        at, objective = design.analysis.configurations[task.name], design.disc.objectives[task.name]
        if task.objective.aimed and objective.instead is None:
            value = objective.at(at.model, at.X, rest(at.model))
            total += task.weight * value if np.isfinite(value) else 0.0
    return total


def with_errors(setup: Setup, current: Iterate, remeshed: bool = False) -> Iterate:
    """The iterate with the errors by its mesh, if it is one of those of which they are estimated."""
    now = moved(setup.problem, current.analysis)
    if not is_estimated(setup.problem, current.number, now, current.learnt.looked, remeshed):
        return current
    return looked_at(setup, current)


def looked_at(setup: Setup, current: Iterate) -> Iterate:
    """The iterate with the errors by its mesh."""
    errors = quick_errors(setup.problem, current.disc, current.analysis)
    return replace(current.learning(looked=moved(setup.problem, current.analysis)), errors=errors)


def with_lateral_stiffness(setup: Setup, current: Iterate, clock: Clock) -> Iterate:
    """The iterate with its lateral stiffness, linearised, which keeps the next step from buckling."""
    with clock.phase("equilibrium"):
        lateral = judge_closely(current.disc, current.analysis)
    return _with_rows(setup, replace(current, design=replace(current.design, lateral=lateral)), clock)


def with_gaps(setup: Setup, current: Iterate, new: Sequence[Crossing], clock: Clock) -> Iterate:
    """The iterate with gaps, linearised, which keep the next step from making the body intersect itself.

    Parameters
    ----------
    setup, current : of the run.
    new : where the body of a trial would.
    clock : counts the time.
    """
    known = joined(current.disc, current.learnt.crossings, new)
    return _with_rows(setup, current.learning(crossings=known), clock)


def _with_rows(setup: Setup, current: Iterate, clock: Clock) -> Iterate:
    """The iterate with limits on states, lateral stiffness and gaps linearised again."""
    design = current.design
    with clock.phase("gradient"):
        gaps = measured(design.disc, design.analysis, current.learnt.crossings)
        states = linear_states(setup.problem, setup.space, design.disc, design.analysis, design.lateral, gaps)
    return replace(current, states=states)
