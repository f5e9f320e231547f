"""The limit points ahead of the states of a design: estimated for every one, followed to where the estimate is near."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import Tangent, limit_ahead
from pneumorph.sensitivity import BEYOND, Margin, find_margin, margin_slope

NEAR = 1.1
"""Estimates below this multiple of the bound are near: there the path is followed."""


def limit_points(disc: Discretisation, analysis: Analysis, bound: float) -> Mapping[str, Margin]:
    """The limit point ahead of every task: without a state where it is beyond `BEYOND` times the bound, or none is.

    Under vacuum alone nothing balloons.

    Parameters
    ----------
    disc : the mesh of the design.
    analysis : of the design, which keeps what was found.
    bound : of the margin.
    """
    for name, at in analysis.configurations.items():
        if name not in analysis.limit_points:
            equilibrium, far = analysis.equilibria[name], Margin(BEYOND * bound, None)
            # A given volume does not grow by itself, and what is sealed not without end.
            inflated = at.enclosed is None and float(np.max(at.loads.pressure)) > 0.0
            near = inflated and limit_ahead(at, disc.tangents[name], equilibrium.state) < NEAR * bound
            # With another solver: those of the tasks keep the factorisations from which the next design starts.
            ahead = find_margin(at, Tangent(disc.model), equilibrium, bound) if near else far
            analysis.limit_points[name] = ahead
    return analysis.limit_points


def margins(disc: Discretisation, analysis: Analysis, bound: float) -> dict[str, float]:
    """The pressures of the limit point ahead of every task over its own, see `sensitivity.margin`."""
    return {name: ahead.load for name, ahead in limit_points(disc, analysis, bound).items()}


def margin_slopes(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, bound: float
) -> tuple[np.ndarray, np.ndarray]:
    """The same for all tasks (k,), and the derivatives (k, n) with respect to Φ.

    Parameters
    ----------
    space, disc : the design space and the mesh of the design.
    analysis : of the design.
    bound : of the margin.
    """
    values, rows = [], []
    for name, ahead in limit_points(disc, analysis, bound).items():
        values.append(ahead.load)
        if ahead.state is None:
            rows.append(np.zeros(space.n))
            continue
        by_X, by_pressure, by_reinforcement = margin_slope(analysis.configurations[name], Tangent(disc.model), ahead)
        rows.append(space.pullback(disc.morph.pullback(by_X), {name: by_pressure}, by_reinforcement))
    return np.array(values), np.array(rows)
