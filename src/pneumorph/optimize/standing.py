"""Where a run stands: its last design with the derivatives; and how it begins, or goes on from a checkpoint."""

from __future__ import annotations

from collections.abc import Generator
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any

import numpy as np

from pneumorph.analysis import Analysis, Discretisation, Slopes, analyse, checkpoint, design_slopes, discretise
from pneumorph.errors import ComputationError
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.limits.certify import LimitReport, certify
from pneumorph.limits.rows.functions import build_limit_functions
from pneumorph.limits.rows.samples import LimitSamples, sample_limits
from pneumorph.mechanics import NoEquilibrium
from pneumorph.optimize.buckling import LateralStability, Stiffnesses, judge, unpack_at_rest
from pneumorph.optimize.curvature import Curvature, no_curvature, unpack_curvature
from pneumorph.optimize.dfp import FIRST_ITERATIONS, PaperStepper
from pneumorph.optimize.events import BroughtWithin, Event
from pneumorph.optimize.history import Clock
from pneumorph.optimize.optimality import optimality
from pneumorph.optimize.smoothing import Smoothing, build_smoothing
from pneumorph.optimize.states import StateLimits, linear_states
from pneumorph.optimize.step import Stepper
from pneumorph.optimize.subproblem import build_sequential_quadratic
from pneumorph.optimize.within import Within, within
from pneumorph.problem import Problem
from pneumorph.symmetry.operations import operations

LARGEST = 3.0
"""Largest trust region, in reference steps."""


class Setting:
    """What stays the same during a run."""

    def __init__(self, problem: Problem):
        body = starting_body(problem.body)
        self.problem = problem
        self.space: DesignSpace = build_design_space(problem, body)
        self.smooth: Smoothing = build_smoothing(self.space)
        self.limits: LimitSamples = sample_limits(body, problem.limits, operations(problem.body.symmetry))
        self.stepper: Stepper = build_sequential_quadratic(self.space, self.smooth, self.limits)
        if problem.optimizer.method == "dfp":
            reference = problem.optimizer.step
            all_samples = build_limit_functions(body, problem.limits, reach=2.5 * LARGEST * reference)
            self.stepper = PaperStepper(self.space, all_samples, reference, FIRST_ITERATIONS, np.zeros(0))

    def within(self, phi: np.ndarray, reach: float = np.inf) -> Within | LimitReport:
        # Steps are smooth, so bounds of the shape may be passed by them.
        return within(self.space, self.smooth, self.limits, np.clip(phi, self.space.lower, self.space.upper), reach)

    def optimality(self, phi: np.ndarray, slope: np.ndarray, states: StateLimits) -> float:
        return optimality(self.space, self.smooth, self.limits, phi, slope, states)


@dataclass(frozen=True, eq=False)
class Standing:
    """Where a run stands after an accepted design.

    `values` are the objectives so far, of designs whose states keep their limits; `bend` is the curvature of the limits
    on states along the last step, 1/mm².
    """

    iteration: int
    analysis: Analysis
    slopes: Slopes
    states: StateLimits
    lateral: LateralStability
    optimality: float
    report: LimitReport
    disc: Discretisation
    stepper: Stepper
    memory: Curvature
    radius: float
    values: tuple[float, ...]
    bend: float


def standing(
    setting: Setting,
    iteration: int,
    analysis: Analysis,
    disc: Discretisation,
    kept: LimitReport,
    clock: Clock,
    stepper: Stepper,
    memory: Curvature,
    radius: float,
    values: tuple[float, ...],
    bend: float = 0.0,
    lateral: LateralStability | None = None,
    at_rest: Stiffnesses = MappingProxyType({}),
) -> Standing:
    """Evaluate the derivatives of an accepted design."""
    with clock.phase("equilibrium"):
        lateral = lateral or judge(disc, analysis, at_rest)
    with clock.phase("gradient"):
        slopes = design_slopes(setting.problem, setting.space, disc, analysis)
        states = linear_states(setting.problem, setting.space, disc, analysis, lateral)
    with clock.phase("subproblem"):
        left = setting.optimality(analysis.phi, slopes.total, states)
    # Designs are compared by their objective from the first one on that keeps the limits on states.
    values = () if states.broken else (*values, analysis.value)
    return Standing(
        iteration, analysis, slopes, states, lateral, left, kept, disc, stepper, memory, radius, values, bend
    )


def first_standing(setting: Setting, clock: Clock) -> Generator[Event, None, Standing]:
    """Where a run begins: the starting design, brought within its limits, with its derivatives."""
    problem, space = setting.problem, setting.space
    with clock.phase("geometry"):
        start, moved = _start(setting)
        if moved is not None:
            yield moved
        disc = discretise(problem, space.body(start.phi))
    with clock.phase("equilibrium"):
        analysis = analyse(problem, space, disc, start.phi, explain=True)
    if isinstance(analysis, NoEquilibrium):
        raise ComputationError(f"the starting design cannot be analysed: {analysis.reason}")
    _touches(problem, disc, analysis)
    return standing(setting, 0, analysis, disc, start.report, clock, setting.stepper, no_curvature(space.n), 1.0, ())


def _touches(problem: Problem, disc: Discretisation, analysis: Analysis) -> None:
    """Refuse a start that does not touch what it is to press on or to move: nothing would say which way to go."""
    for task in problem.task:
        if (name := task.objective.touched) is None:
            continue
        state = analysis.equilibria[task.name].state
        if float(disc.objectives[task.name].features(disc.model, analysis.X, state).contact[name].normal) == 0.0:
            raise ComputationError(
                f'task {task.name}: the start does not touch obstacle "{name}"; put that nearer or raise the pressure'
            )


def _start(setting: Setting) -> tuple[Within, BroughtWithin | None]:
    """The starting design, moved to keep the limits if it breaks any."""
    asked = setting.space.start
    before = certify(setting.space.body(asked), setting.problem.limits, own=setting.limits.own_spans)
    if before.satisfied():
        return Within(asked, before), None
    start = setting.within(asked)
    if not isinstance(start, Within):
        broken = "; ".join(map(str, start.violated()))
        raise ComputationError(
            f"the start breaks limits that no design near it keeps together: {broken}; widen one of them, or change "
            "the body"
        )
    moved = float(np.abs(start.phi - asked).max())
    return start, BroughtWithin(tuple(map(str, before.violated())), moved)


def resumed(setting: Setting, state: dict[str, Any]) -> Standing:
    """Where a run stood when its last design was accepted, by the state that was stored with it."""
    disc, analysis = checkpoint.unpack(setting.problem, setting.space, state)
    values = tuple(map(float, state["values"]))
    return standing(
        setting,
        int(state["iteration"]),
        analysis,
        disc,
        certify(setting.space.body(analysis.phi), setting.problem.limits, own=setting.limits.own_spans),
        Clock(),
        setting.stepper.unpack(state),
        unpack_curvature(state) if "curvature_phi" in state else no_curvature(setting.space.n),
        float(state["radius"]),
        values[:-1],
        at_rest=unpack_at_rest(disc, state),
    )
