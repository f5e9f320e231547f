"""What stays the same during a run: the problem, its design space, its limits, and how bodies are meshed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from functools import partial

import numpy as np

from pneumorph.analysis import Discretisation, discretise
from pneumorph.geometry import Body
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.variables import build_design_space
from pneumorph.limits.certify import LimitReport, certify
from pneumorph.limits.rows.functions import build_limit_functions
from pneumorph.limits.rows.samples import LimitSamples, sample_limits
from pneumorph.optimize.dfp import PaperStepper
from pneumorph.optimize.optimality import optimality
from pneumorph.optimize.settings import LoopSettings
from pneumorph.optimize.smoothing import Smoothing, build_smoothing
from pneumorph.optimize.states import StateLimits
from pneumorph.optimize.step import Stepper
from pneumorph.optimize.subproblem import build_sequential_quadratic
from pneumorph.optimize.within import Within, within
from pneumorph.problem import Problem
from pneumorph.symmetry.operations import operations


@dataclass(frozen=True, eq=False)
class Setup:
    """What stays the same during a run.

    Attributes
    ----------
    problem : Problem
        Of which the loop itself reads the tasks, the limits and the table of the optimiser.
    space : DesignSpace
    smooth : Smoothing
        Of steps.
    limits : LimitSamples
        The limits on the shape.
    stepper : Stepper
        The method that finds steps, as it begins.
    discretise : (Body, float) -> Discretisation
        Meshes a body and builds its model, with no elements smaller than a size in mm.
    settings : LoopSettings
    """

    problem: Problem
    space: DesignSpace
    smooth: Smoothing
    limits: LimitSamples
    stepper: Stepper
    discretise: Callable[[Body, float], Discretisation]
    settings: LoopSettings = field(default_factory=LoopSettings)

    @property
    def reference(self) -> float:
        """The reference step Ξ₀, mm."""
        return self.problem.optimizer.step

    def within(self, phi: np.ndarray, reach: float = np.inf) -> Within | LimitReport:
        """The design nearest to Φ (n,) that satisfies every limit on the shape, see `within.within`."""
        # Steps are smooth, so bounds of the shape may be passed by them.
        return within(self.space, self.smooth, self.limits, np.clip(phi, self.space.lower, self.space.upper), reach)

    def certify(self, phi: np.ndarray) -> LimitReport:
        """The certified report of the limits on the shape of the design Φ (n,)."""
        return certify(self.space.body(phi), self.problem.limits, own=self.limits.own_spans)

    def optimality(self, phi: np.ndarray, slope: np.ndarray, states: StateLimits) -> float:
        """First-order optimality of the design Φ (n,) where the objective has the gradient `slope` (n,)."""
        return optimality(self.space, self.smooth, self.limits, phi, slope, states)


def build_setup(problem: Problem, settings: LoopSettings | None = None) -> Setup:
    """The setup of a problem whose body is made of tubes."""
    settings = settings or LoopSettings()
    body = starting_body(problem.body)
    space = build_design_space(problem, body)
    smooth = build_smoothing(space)
    limits = sample_limits(body, problem.limits, operations(problem.body.symmetry))
    if problem.optimizer.method == "dfp":
        reference = problem.optimizer.step
        all_samples = build_limit_functions(body, problem.limits, reach=2.5 * settings.radius.largest * reference)
        stepper = PaperStepper(space, all_samples, reference)
    else:
        stepper = build_sequential_quadratic(space, smooth, limits)
    return Setup(problem, space, smooth, limits, stepper, partial(discretise, problem), settings)
