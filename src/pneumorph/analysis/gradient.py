"""Check the gradient of a problem's objective by Taylor tests on one of its bodies."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pneumorph.analysis.analyse import (
    Analysis,
    Discretisation,
    analyse,
    carry_over,
    discretise,
)
from pneumorph.analysis.slopes import design_gradient
from pneumorph.analysis.starting import analyse_start, coarser
from pneumorph.doing import doing
from pneumorph.errors import ComputationError
from pneumorph.geometry import Body, DesignSpace
from pneumorph.geometry.starting import space_of
from pneumorph.mechanics import TOLERANCE, NoEquilibrium
from pneumorph.problem import Pressure, Problem
from pneumorph.problem.designed import designed
from pneumorph.problem.variable import Variable
from pneumorph.sensitivity import TaylorTest, taylor_test_nearby

FIRST_STEP = 0.05
"""First step of the tests: largest motion of a control point in mm, the fraction by which pressures, stiffnesses
and coverages change, and the change of winding angles in rad."""

LEAST_PRESSURE = 0.01
"""The pressure, in MPa, of which steps are fractions where the chamber's own is smaller."""

NOISE = 1e-8
"""Remainders below this fraction of the largest displacement are rounding errors and the solver's tolerance."""

FLAT = 1e-5
"""An objective that changes by less than this fraction of the largest displacement may be zero by symmetry."""

LEAST_MOTION = 1e-3
"""The displacement, in mm, of which they are fractions where the largest is smaller."""

ENOUGH = 1500
"""Elements that are enough for a Taylor test: the gradient is that of the discrete problem, exact on every mesh, and a
test takes up to a dozen equilibria."""


@dataclass(frozen=True)
class GradientCheck:
    """Taylor tests of a gradient.

    Attributes
    ----------
    tests : {direction: TaylorTest}
        Along two random motions of all control points, along a change of all pressures, and along one of what is
        designed of sheets and fibres.
    noise : float
        Remainders below it are rounding errors and the solver's tolerance.
    elements : int
        Of the mesh on which they were made.
    nothing : {direction: reason}
        Directions along which there is nothing to test, and why, as a sentence.
    """

    tests: Mapping[str, TaylorTest]
    noise: float
    elements: int
    nothing: Mapping[str, str] = field(default_factory=dict)

    def is_right(self, name: str) -> bool:
        """Whether one test is passed, or its remainders are below `noise`."""
        return self.is_exact(name) or self.tests[name].passed

    def is_exact(self, name: str) -> bool:
        """Whether all remainders of one test are below `noise`."""
        return bool(self.tests[name].remainders.max() <= self.noise)

    @property
    def passed(self) -> bool:
        """Whether all tests are passed."""
        return all(map(self.is_right, self.tests))

    def __str__(self) -> str:
        return "\n".join(map(self.line, (*self.tests, *self.nothing)))

    def line(self, name: str) -> str:
        """The outcome along one direction, as a line of text."""
        if name in self.nothing:
            return f"{name}: nothing to test, {self.nothing[name]}"
        if self.is_exact(name):
            return f"{name}: right, with no remainder above rounding"
        rates = ", ".join(f"{rate:.3f}" for rate in self.tests[name].rates)
        verdict = "right" if self.tests[name].passed else "WRONG"
        return f"{name}: {verdict}, the remainder falls with order {rates}"


@dataclass(frozen=True, eq=False)
class AnalysedBody:
    """A body of a problem, solved to full precision, with every pressure as a design variable."""

    problem: Problem
    body: Body
    space: DesignSpace
    disc: Discretisation
    analysis: Analysis


def analyse_body(problem: Problem, body: Body) -> AnalysedBody:
    """Mesh a body of a problem and analyse it with every pressure as a design variable.

    Raises
    ------
    ComputationError
        If it cannot be meshed or has no equilibrium.
    """
    space = space_of(_with_scales_of_tests(problem), body)
    disc = discretise(problem, body)
    return AnalysedBody(problem, body, space, disc, analyse_start(problem, space, disc, space.start, TOLERANCE))


def run_gradient_check(at: AnalysedBody) -> GradientCheck:
    """Test the gradient at an analysed body by Taylor remainders, on a coarser mesh if it has more than `ENOUGH`."""
    at = _coarser(at)
    problem, space, disc = at.problem, at.space, at.disc
    slope = design_gradient(problem, space, disc, at.analysis)
    random = np.random.default_rng(1)
    directions, nothing, tests = {}, {}, {}
    for name in ("control points, first direction", "control points, second direction"):
        directions[name] = np.zeros(space.n)
        directions[name][: space.n_shape] = random.uniform(-1.0, 1.0, space.n_shape)
    if any(pressure.free for task in problem.task for pressure in task.pressure.values()):
        directions["pressures"] = np.zeros(space.n)
        count = len(space.free_pressures)
        directions["pressures"][space.n_shape : space.n_shape + count] = random.uniform(0.5, 1.0, count)
    else:
        nothing["pressures"] = "no pressure is designed"
    if count := len(space.free_data):
        directions["sheets and fibres"] = np.zeros(space.n)
        directions["sheets and fibres"][-count:] = random.uniform(0.5, 1.0, count)
    motion = max(float(np.abs(equilibrium.u).max()) for equilibrium in at.analysis.equilibria.values())
    scale = max(motion, LEAST_MOTION)

    def value(phi: np.ndarray) -> float:
        return _analysed(problem, space, disc, phi, at.analysis).value

    for number, (name, direction) in enumerate(directions.items(), start=1):
        if motion == 0.0 and name != "pressures":
            nothing[name] = "the body does not move: no task has a pressure or a load"
            continue
        with doing(f"direction {number} of {len(directions)}, {name}"):
            test = taylor_test_nearby(value, space.start, slope, direction, FIRST_STEP, start=at.analysis.value)
        if not test.passed and is_flat(test, float(slope @ direction), scale):
            nothing[name] = "the objective does not change along it"
        else:
            tests[name] = test
    return GradientCheck(tests, NOISE * scale, disc.model.elements, nothing)


def _coarser(at: AnalysedBody) -> AnalysedBody:
    """The body on a mesh of about `ENOUGH` elements; the same where it has no more, or none can be analysed."""
    problem, body, old = at.problem, at.body, at.disc
    disc = coarser(problem, body, old, ENOUGH)
    if disc is old:
        return at
    states = {task: equilibrium.state for task, equilibrium in at.analysis.equilibria.items()}
    starts = carry_over(old, at.analysis.X, states, disc, disc.morph.mesh.points)
    analysis = analyse(problem, at.space, disc, at.space.start, starts, tolerance=TOLERANCE)
    return at if isinstance(analysis, NoEquilibrium) else AnalysedBody(problem, body, at.space, disc, analysis)


def is_flat(test: TaylorTest, slope: float, scale: float) -> bool:
    """Whether the objective changes so little along a direction that it is zero but for an unsymmetric mesh.

    Parameters
    ----------
    test, slope : its Taylor test and its derivative along the direction.
    scale : the largest displacement, mm.
    """
    return bool(test.steps[0] * abs(slope) + test.remainders.max() < FLAT * scale)


def _with_scales_of_tests(problem: Problem) -> Problem:
    """The problem with every pressure as a design variable, so scaled that 1 mm of Φ is the pressure itself.

    For a stiffness that is designed 1 mm is the stiffness itself, for an angle 1 rad.
    """

    def scaled(variable: Variable, width: float) -> Variable:
        return variable.model_copy(update={"min": variable.start - width, "max": variable.start + width})

    def freed(pressure: Pressure) -> Variable:
        return scaled(pressure, max(abs(pressure.start), LEAST_PRESSURE))

    tasks = [
        task.model_copy(update={"pressure": {name: freed(pressure) for name, pressure in task.pressure.items()}})
        for task in problem.task
    ]
    widths = dict.fromkeys(("stiffness", "coverage"), lambda datum: datum.start) | {"winding": lambda datum: 1.0}
    data = designed(problem)
    reinforced = {
        table: tuple(
            each.model_copy(
                update={key: scaled(datum, widths[key](datum)) for key, datum in data.get(each.name, {}).items()}
            )
            for each in getattr(problem, table)
        )
        for table in ("membrane", "fibres")
    }
    return problem.model_copy(update={"task": tuple(tasks), **reinforced})


def _analysed(problem: Problem, space: DesignSpace, disc: Discretisation, phi: np.ndarray, near: Analysis) -> Analysis:
    starts = {task: equilibrium.state for task, equilibrium in near.equilibria.items()}
    analysis = analyse(problem, space, disc, phi, starts, tolerance=TOLERANCE)
    if isinstance(analysis, NoEquilibrium):
        raise ComputationError(f"a design near it cannot be analysed: {analysis.reason}")
    return analysis
