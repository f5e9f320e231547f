"""The limit points ahead of the states of a design: estimated while far, and found by following the path where near."""

from __future__ import annotations

import math
from collections.abc import Iterable, Mapping
from dataclasses import replace

import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.analysis.castings import TaskState, casting_name
from pneumorph.doing import doing
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import Configuration, Tangent, limit_ahead
from pneumorph.mechanics.solve.border import given_pressures
from pneumorph.sensitivity import BEYOND, Margin, find_margin, margin_slope

NEAR = 1.1
"""Estimates below this multiple of the bound are near: there the path is followed."""

FASTEST = 2.5
"""How much smaller a design may make the distance from λ = 1 to the estimate: most make it smaller by less than 1.7."""

FARTHEST = 5.0
"""Estimates above are taken for this one: no design is far from ballooning because one long before was."""


def _states(disc: Discretisation, analysis: Analysis) -> dict[str, tuple[str, TaskState]]:
    """The states that must not balloon, each with its task, by names: those of the tasks, and of castings."""
    states = {}
    for task in analysis.configurations:
        states[task] = task, analysis.state(disc, task)
        for number, off in enumerate(analysis.castings.get(task, ())):
            states[casting_name(task, number)] = task, off
    return states


def limit_points(disc: Discretisation, analysis: Analysis, bound: float) -> Mapping[str, Margin]:
    """The limit point ahead of every task: without a state where it is beyond `BEYOND` times the bound, or none is.

    And of perturbed castings, each under a name of its own. Under vacuum alone nothing balloons.

    Parameters
    ----------
    disc : the mesh of the design.
    analysis : of the design, which keeps what was found.
    bound : of the margin.
    """
    states = _states(disc, analysis)
    for name, (task, own) in states.items():
        if name in analysis.limit_points:
            continue
        with doing(f"looking for ballooning in task {name}"):
            # A given volume does not grow by itself, and what is sealed not without end.
            inflated = float(np.max(given_pressures(own.at))) > 0.0
            estimate = limit_ahead(own.at, own.tangent, own.equilibrium.state) if inflated else math.inf
            ahead = Margin(BEYOND * bound, None)
            if estimate < NEAR * bound:
                others = ((states[each][1].at, found) for each, found in analysis.limit_points.items())
                # With another solver: those of the tasks keep the factorisations from which the next design starts.
                near = analysis.nearby.get(name) or analysis.limit_points.get(task)
                ahead = _on_the_path_of(own.at, others, bound) or find_margin(
                    own.at, Tangent(disc.model), own.equilibrium, bound, near
                )
            analysis.limit_points[name] = replace(ahead, estimate=estimate)
    return analysis.limit_points


def _on_the_path_of(at: Configuration, others: Iterable[tuple[Configuration, Margin]], bound: float) -> Margin | None:
    """The limit point ahead where the path of another state is the same: its pressures are in the same ratio."""
    for there, ahead in others:
        ratio = _ratio(at, there)
        if ratio is None or not ahead.known:
            continue
        if ahead.state is not None and ratio * ahead.load > 1.0:
            return replace(ahead, load=ratio * ahead.load)
        if ahead.state is None and ratio * ahead.load >= BEYOND * bound:
            return Margin(BEYOND * bound, None)
    return None


def _ratio(at: Configuration, other: Configuration) -> float | None:
    """The pressures of another configuration over those of one, if nothing else differs."""
    if at.enclosed is not None or other.enclosed is not None or not np.array_equal(at.blocked, other.blocked):
        return None
    alike = [at.X, *at.loads._replace(pressure=0.0)], [other.X, *other.loads._replace(pressure=0.0)]
    if not all(np.array_equal(one, two) for one, two in zip(*alike, strict=True)):
        return None
    own, others = np.asarray(at.loads.pressure), np.asarray(other.loads.pressure)
    ratio = float(own @ others) / float(own @ own)
    return ratio if ratio > 0.0 and np.allclose(others, ratio * own, rtol=1e-9, atol=0.0) else None


def expect_limit_points(before: Analysis, analysis: Analysis, bound: float) -> None:
    """Take over from the design before that the limit points of this one are far, where that one's were farther still.

    Parameters
    ----------
    before, analysis : of the two designs.
    bound : of the margin.
    """
    for name, known in before.limit_points.items():
        least = 1.0 + (min(known.estimate, FARTHEST) - 1.0) / FASTEST
        if least >= NEAR * bound:
            analysis.limit_points[name] = Margin(BEYOND * bound, None, least)


def remember_limit_points(before: Analysis, analysis: Analysis) -> None:
    """Have the limit points of a design looked for near those of another one on the same mesh first."""
    analysis.nearby.update({name: known for name, known in before.limit_points.items() if known.state is not None})


def near_margins(disc: Discretisation, analysis: Analysis, bound: float) -> tuple[dict[str, float], dict[str, float]]:
    """The margins of the tasks whose limit point is near; and how far the others were followed where that is not known.

    All estimates are made again, paths are followed from the states, and perturbed castings do not count.

    Parameters
    ----------
    disc : the mesh of the design.
    analysis : of the design.
    bound : of the margin; `BEYOND` times it is the farthest that counts as near.
    """
    points = limit_points(disc, replace(analysis, limit_points={}, castings={}, nearby={}), bound)
    near = {name: ahead.load for name, ahead in points.items() if ahead.state is not None}
    return near, {name: ahead.load for name, ahead in points.items() if not ahead.known}


def margins(disc: Discretisation, analysis: Analysis, bound: float) -> dict[str, float]:
    """The pressures of the limit point ahead of every task over its own, where known; see `sensitivity.margin`.

    With perturbed castings, the least of them.
    """
    points, least = limit_points(disc, analysis, bound), {}
    for name, (task, _) in _states(disc, analysis).items():
        if points[name].known:
            least[task] = min(points[name].load, least.get(task, math.inf))
    return least


def margin_slopes(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, bound: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same (k,), and the derivatives (k, n) with respect to Φ.

    Parameters
    ----------
    space, disc : the design space and the mesh of the design.
    analysis : of the design.
    bound : of the margin.
    """
    values, rows = [], []
    points = limit_points(disc, analysis, bound)
    for name, (task, own) in _states(disc, analysis).items():
        ahead = points[name]
        if not ahead.known:
            continue
        values.append(ahead.load)
        if ahead.state is None:
            rows.append(np.zeros(space.n))
            continue
        by_X, by_pressure, by_reinforcement = margin_slope(own.at, Tangent(disc.model), ahead)
        by_pressure, by_reinforcement = own.by_design(by_pressure, by_reinforcement)
        rows.append(space.pullback(disc.morph.pullback(by_X), {task: by_pressure}, by_reinforcement))
    return np.array(values), np.array(rows).reshape(-1, space.n)
