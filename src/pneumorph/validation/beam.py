"""A beam of Dragon Skin 10 that hangs down under its own weight and loads at its tip (Dubied and others 2022)."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import numpy as np

from pneumorph.analysis import analyse_start, discretise
from pneumorph.analysis.accuracy import mesh_errors
from pneumorph.analysis.near import Solved
from pneumorph.analysis.scatter import scatter_of
from pneumorph.analysis.tolerances import Tolerances, of_sources
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.problem import Problem
from pneumorph.validation.comparison import Comparison
from pneumorph.validation.tables import problem_of, table_of

AT_TIP, ON_MOUNT = (0, 1), (3, 4, 5)
"""Markers on the tip, and on the mount, which gives way a little."""

FITTED: Mapping[str, tuple[str, ...]] = {
    "first_pull": (),
    "authors": ("gravity", "load101"),
    "own_weight": ("gravity",),
}
"""The rubbers of the problem files, and by which cases of the beam itself they were found."""

SIZE, QUICK = 8.0, 14.0
"""Of elements, mm."""

EDGE = 15.0
"""mm above the axis: the edge of the tip at which the load hangs."""

TURNS = 2
"""Iterations: the moment of that load depends on how far the tip has turned."""

WEIGHED = 0.01
"""Standard deviation of loads and weights, which were weighed."""


def beams(quick: bool = False) -> Iterator[Comparison]:
    """Deflections of the tip with every rubber.

    Parameters
    ----------
    quick : with large elements.
    """
    known = measured()
    for rubber, fitted in FITTED.items():
        problem = problem_of("beam", rubber, QUICK if quick else SIZE)
        found = predicted(problem)
        seen, half = np.array([known[case] for case in found]).T
        values, errors = np.array(list(found.values())).T
        yield Comparison(
            body="beam",
            rubber=problem.material.name,
            quantity="deflection of the tip",
            unit="mm",
            case="",
            along="load at the tip, N",
            at=np.array([0.0 if task.force is None else -task.force[0] for task in problem.task]),
            measured=seen,
            scatter=half,
            predicted=values,
            error=errors,
            fitted=np.array([case in fitted for case in found]),
        )


def measured() -> dict[str, tuple[float, float]]:
    """Deflections of the tip by case, mm: means over markers and runs, less the mount's, and half the range."""
    table = table_of("beam")
    down, marker = -table["dx_mm(vertical)"], table["marker"]
    found = {}
    for case in map(str, np.unique(table["case"])):
        own = table["case"] == case
        tip = down[own & np.isin(marker, AT_TIP)] - down[own & np.isin(marker, ON_MOUNT)].mean()
        found[case] = float(tip.mean()), float(np.ptp(tip) / 2)
    return found


def predicted(problem: Problem) -> dict[str, tuple[float, float]]:
    """Deflections of the tip by task without the error of the mesh, mm, and their standard deviations.

    The deviation has the tolerances of rubber, sizes and loads, and what the mesh is off.

    Raises
    ------
    ComputationError
        If the beam has no equilibrium.
    """
    body = body_of(problem)
    disc, space = discretise(problem, body), space_of(problem, body)
    under = problem
    analysis = analyse_start(under, space, disc, space.start)
    for _ in range(TURNS):
        turns = np.array([float(analysis.equilibria[task.name].plate[4]) for task in problem.task])
        under = _with_moments(problem, turns)
        analysis = analyse_start(under, space, disc, space.start)
    errors = mesh_errors(under, disc, analysis)
    tolerances = of_sources(Tolerances(load=WEIGHED), problem)
    scatters = scatter_of(Solved(under, disc, analysis), tolerances)
    return {
        name: (
            -float(error.corrected[0]),
            float(np.hypot(scatters[name].deviations[0], error.missing[0])),
        )
        for name, error in errors.items()
    }


def _with_moments(problem: Problem, turns: np.ndarray) -> Problem:
    """The loads at the edge of a tip that has turned by angles about y, as forces and moments on its middle."""
    tasks = []
    for task, turn in zip(problem.task, turns, strict=True):
        if task.force is not None:
            moment = (0.0, -task.force[0] * EDGE * float(np.sin(turn)), 0.0)
            task = task.model_copy(update={"moment": moment})
        tasks.append(task)
    return problem.model_copy(update={"task": tuple(tasks)})
