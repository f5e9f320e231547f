"""What stays the same during a run: the problem, its design space, its limits, and how bodies are meshed."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import numpy as np

from pneumorph.analysis import Discretisation, build_discretisation
from pneumorph.analysis.bodies import as_fine_like, mesher_of
from pneumorph.geometry import Body
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.geometry.starting import space_of
from pneumorph.limits.of_shape import ShapeLimits, build_limit_functions, limits_of
from pneumorph.limits.report import LimitReport
from pneumorph.mechanics import part_of
from pneumorph.mesh import Mesher, TetMesh
from pneumorph.optimize.dfp import PaperStepper
from pneumorph.optimize.optimality import optimality
from pneumorph.optimize.settings import LoopSettings
from pneumorph.optimize.smoothing import Smoothing, build_smoothing
from pneumorph.optimize.states import StateLimits
from pneumorph.optimize.step import Stepper
from pneumorph.optimize.subproblem import build_sequential_quadratic
from pneumorph.optimize.within import Kept, Within, within
from pneumorph.problem import Problem


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
    limits : ShapeLimits
        The limits on the shape.
    mesher : Mesher
    stepper : Stepper
        The method that finds steps, as it begins.
    settings : LoopSettings
    """

    problem: Problem
    space: DesignSpace
    smooth: Smoothing
    limits: ShapeLimits
    mesher: Mesher
    stepper: Stepper
    settings: LoopSettings = field(default_factory=LoopSettings)

    @property
    def reference(self) -> float:
        """The reference step Ξ₀, mm."""
        return self.problem.optimizer.step

    @property
    def coarse(self) -> bool:
        """Whether elements are larger than those asked for, see `coarse.py`."""
        return self.mesher.size > self.problem.mesh.size

    def discretise(self, body: Body, finest: float, like: TetMesh | None = None) -> Discretisation:
        """Mesh a body, with elements of no size below `finest` in mm, and build its model.

        Elements are divided where those of a mesh `like` it were.
        """
        P, mesher = body.control_points(), self.mesher
        morph = as_fine_like(mesher.mesh(body, finest), P, like, mesher.heights)
        return build_discretisation(self.problem, morph, P)

    def within(self, phi: np.ndarray, reach: float = np.inf, kept: Kept | None = None) -> Within | LimitReport:
        """The design nearest to Φ (n,) that satisfies every limit on the shape, see `within.within`."""
        # Steps are smooth, so bounds of the shape may be passed by them.
        start = self.space.within_bounds(phi)
        return within(self.space, self.smooth, self.limits, start, reach, self.settings.repair, kept)

    def certify(self, phi: np.ndarray) -> LimitReport:
        """The certified report of the limits on the shape of the design Φ (n,)."""
        return self.limits.certify(self.space.body(phi))

    def optimality(self, phi: np.ndarray, slope: np.ndarray, states: StateLimits) -> float:
        """First-order optimality of the design Φ (n,) where the objective has the gradient `slope` (n,)."""
        return optimality(self.space, self.smooth, self.limits, phi, slope, states)


def build_setup(problem: Problem, settings: LoopSettings | None = None) -> Setup:
    """The setup of a problem, by its own body."""
    space = space_of(problem)
    limits = limits_of(problem, space.reference)
    setup = setup_among(problem, space, limits, mesher_of(problem, part_of(problem)), settings)
    if problem.optimizer.method == "dfp":
        reach = 2.5 * setup.settings.trial.longest * setup.reference
        all_samples = build_limit_functions(space.reference, problem.limits, reach=reach)
        return replace(setup, stepper=PaperStepper(space, all_samples, setup.reference))
    return setup


def setup_among(
    problem: Problem,
    space: DesignSpace,
    limits: ShapeLimits,
    mesher: Mesher,
    settings: LoopSettings | None = None,
) -> Setup:
    """The setup of a problem among bodies of any kind, which takes steps by sequential quadratic programs.

    Parameters
    ----------
    problem : of whose body only the length and the names of chambers are asked for.
    space : of the bodies.
    limits : on their shapes.
    mesher : of the bodies, or of a part of each.
    settings : of the loop, by default the usual ones.
    """
    smooth = build_smoothing(space)
    stepper = build_sequential_quadratic(space, smooth, limits)
    return Setup(problem, space, smooth, limits, mesher, stepper, settings or LoopSettings())
