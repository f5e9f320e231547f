"""`pneumorph check`: what a problem file says, and whether the gradient of its objective is right."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import numpy as np
import typer
from rich.console import Console
from rich.text import Text

from pneumorph.constraint import report
from pneumorph.errors import ComputationError
from pneumorph.geometry import DesignSpace, adjusted_columns, design_space, starting_body
from pneumorph.mechanics import NoEquilibrium
from pneumorph.mechanics.solve.equilibrium import TOLERANCE
from pneumorph.optimize.analysis import Analysis, Discretisation, analyse, design_gradient, discretise
from pneumorph.optimize.history import answers
from pneumorph.output.words import analysed, motion_of
from pneumorph.output.words import pressures as in_words
from pneumorph.problem import Pressure, Problem, load
from pneumorph.run import open_run
from pneumorph.sensitivity import TaylorTest, taylor_test

FIRST_STEP = 0.05
"""The tests' first step: largest motion of a control point in mm; a pressure moves by this part of itself."""

LEAST_PRESSURE = 0.01
"""A chamber without pressure is tested with steps of this one, MPa."""

NOISE = 1e-8
"""Remainders below this part of the largest displacement are the solver's tolerance and say nothing."""


def check(problem: Annotated[Path, typer.Argument(help="A problem file (TOML), or a run directory.")]) -> None:
    """Validate a problem, describe it, and test the gradient of its objective on its start or a run's last design."""
    run = open_run(problem) if problem.is_dir() else None
    asked = load(problem) if run is None else run.problem
    console = Console()

    def say(text: str, style: str = "") -> None:
        console.print(Text(text, style=style), soft_wrap=True)

    latest = None if run is None else run.latest()
    start = starting_body(asked.body) if run is None or latest is None else run.load_design(latest).body(asked)
    space = design_space(_with_free_pressures(asked), start)
    disc = discretise(asked, start)
    for line in _description(asked, space, disc):
        say(line)
    for sentence in adjusted_columns(asked.body):
        say(f"symmetry  {sentence}")
    analysis = _analysed(asked, space, disc, space.start)
    told = answers(disc, analysis)
    for task in asked.task:
        motion = motion_of(task, told[task.name])
        say(f"task      {task.name}: {motion.word} {motion} at {in_words(analysis.pressures[task.name])}")
    limits = report(start, asked.limits)
    for reading in limits.readings:
        # Sure for every point of the surfaces, and what the worst point that was seen has.
        say(f"limit     {reading}, seen {reading.seen:.3g}", "red" if reading in limits.violated() else "")

    passed = True
    noise = NOISE * max(float(np.abs(found.u).max()) for found in analysis.equilibria.values())
    for name, test in _gradient_tests(asked, space, disc, analysis).items():
        if test.remainders.max() < noise:
            say(f"gradient  {name}: right, with no remainder to speak of")
            continue
        rates = ", ".join(f"{rate:.3f}" for rate in test.rates)
        verdict = "right" if test.passed else "WRONG"
        say(f"gradient  {name}: {verdict}, the remainder falls with order {rates}", "" if test.passed else "red")
        passed = passed and test.passed
    if not passed:
        raise ComputationError("the gradient is not right to second order; try a finer mesh")
    say("The problem is sound and its gradient is exact.")


def _description(problem: Problem, space: DesignSpace, disc: Discretisation) -> list[str]:
    told, model = problem.model_dump(), disc.model
    body, rubber, springs = told["body"], told["material"], told["end_effector"]["spring"]
    chambers = "; ".join(
        f"{chamber['name']}, radius {chamber['radius']}, z from {chamber['span'][0]} to {chamber['span'][1]}"
        for chamber in body["chamber"]
    )
    effector = problem.end_effector
    held = [f"{name} spring {springs[name]}" for name, value in effector.spring if value > 0]
    pulled = [f"{key} {told['end_effector'][key]}" for key in ("force", "moment") if any(getattr(effector, key))]
    gravity = told.get("gravity")
    valid = model.rubber.valid_stretch
    reach = "valid for stretches not stated" if valid is None else f"valid to a stretch of {valid:.3g}"
    chosen = ""
    if problem.mesh.element == "auto" and model.mixed:
        chosen = f" (bulk modulus {model.rubber.bulk_modulus / model.rubber.shear_modulus:.3g} times the shear modulus)"
    free = sum(pressure.free for task in problem.task for pressure in task.pressure.values())
    return [
        f"problem   {problem.title or 'without a title'}",
        f"body      length {body['length']}, radius {body['radius']}; chambers: {chambers}",
        f"variables {space.n_shape} of the shape, {free} of the pressures",
        f"mesh      {model.elements} {model.element} tetrahedra{chosen}, {model.size} degrees of freedom"
        + analysed(model.mirror),
        f"rubber    {rubber['name']}: {rubber['model']}, initial shear modulus {model.rubber.shear_modulus:.4g} MPa, "
        f"bulk modulus {rubber['bulk_modulus']}, {reach}",
        f"tip       {', '.join([effector.kind, *held, *pulled])}",
        "gravity   " + (f"{gravity['acceleration']} along {gravity['direction']}" if gravity else "none"),
    ]


def _with_free_pressures(problem: Problem) -> Problem:
    """The problem with every pressure designed, 1 mm of Φ being as much as the pressure itself, to test them all."""

    def freed(pressure: Pressure) -> Pressure:
        width = max(abs(pressure.start), LEAST_PRESSURE)
        return pressure.model_copy(update={"min": pressure.start - width, "max": pressure.start + width})

    tasks = [
        task.model_copy(update={"pressure": {name: freed(pressure) for name, pressure in task.pressure.items()}})
        for task in problem.task
    ]
    return problem.model_copy(update={"task": tuple(tasks)})


def _analysed(
    problem: Problem, space: DesignSpace, disc: Discretisation, phi: np.ndarray, near: Analysis | None = None
) -> Analysis:
    starts = None if near is None else {task: found.state for task, found in near.equilibria.items()}
    found = analyse(problem, space, disc, phi, starts, TOLERANCE, explain=near is None)
    if isinstance(found, NoEquilibrium):
        raise ComputationError(f"the design cannot be analysed: {found.reason}")
    return found


def _gradient_tests(
    problem: Problem, space: DesignSpace, disc: Discretisation, analysis: Analysis
) -> dict[str, TaylorTest]:
    """Taylor tests along two random motions of all control points and along a change of all pressures."""
    slope = design_gradient(problem, space, disc, analysis)
    random = np.random.default_rng(1)
    directions = {}
    for name in ("control points, first direction", "control points, second direction"):
        directions[name] = np.zeros(space.n)
        directions[name][: space.n_shape] = random.uniform(-1.0, 1.0, space.n_shape)
    directions["pressures"] = np.zeros(space.n)
    directions["pressures"][space.n_shape :] = random.uniform(0.5, 1.0, space.n - space.n_shape)

    def value(phi: np.ndarray) -> float:
        return _analysed(problem, space, disc, phi, analysis).value

    return {
        name: taylor_test(value, space.start, slope, direction, FIRST_STEP) for name, direction in directions.items()
    }
