"""The probability that a casting balloons before it reaches its working pressure.

A design balloons at λ times its working pressure. With all causes of scatter ε in standard deviations, ln λ differs by
gᵀε to first order: exactly so for the moduli, where only pressure acts. So a casting balloons with the probability
Φ(−ln λ / |g|), that of the first-order reliability method (Hasofer and Lind 1974), with the normal distribution Φ.

Of a part of a symmetric body, causes that keep its symmetry are all there are: to first order no other changes λ.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from scipy.special import ndtr

from pneumorph.analysis.constants import fitted_in, forces_by_constants
from pneumorph.analysis.near import Solved
from pneumorph.analysis.tolerances import (
    HISTORY,
    LOADS,
    MODULUS,
    Tolerances,
    as_cast,
    pressure_of,
    scales,
    shape_causes,
    stiffness_of,
)
from pneumorph.doing import doing
from pneumorph.mechanics import Configuration, Loads, Tangent, limit_ahead
from pneumorph.mechanics.solve.border import given_pressures
from pneumorph.mesh.tets import chambers_of
from pneumorph.sensitivity import BEYOND, find_margin, limit_slope

FARTHEST, LEAST = 3.0, 1.5
"""Limit points are looked for up to so many deviations by the moduli alone, and in any case up to this multiple of the
working pressure, since walls and cores vary too."""

WAYS = (1e-3, -1e-3)
"""Deviations of a cause whose difference gives the derivatives of loads, which are simple functions of it."""

LONGEST = 3.0
"""Multiple of the working pressure beyond which none is looked for either."""


@dataclass(frozen=True)
class Ballooning:
    """Where a task balloons.

    Attributes
    ----------
    margin : float
        The pressure there over the working one, λ.
    deviation : float
        The standard deviation of ln λ.
    """

    margin: float
    deviation: float

    @property
    def within_one(self) -> bool:
        """Whether castings that are off by one standard deviation balloon."""
        return math.log(self.margin) < self.deviation

    @property
    def probability(self) -> float:
        """That with which a casting balloons before its working pressure."""
        return float(ndtr(-math.log(self.margin) / self.deviation)) if self.deviation else 0.0


def ballooning_of(part: Solved, tolerances: Tolerances) -> dict[str, Ballooning]:
    """Where the castings of every task balloon; tasks without a limit point within their scatter are left out.

    So are those with contact, sealed or filled chambers, or several rubbers, where forces do not scale with a modulus.

    Parameters
    ----------
    part : the body, or a part of it, with its states.
    tolerances : of every cause.
    """
    found = {}
    constants = fitted_in(part.problem)
    by_moduli = math.exp(FARTHEST * math.hypot(*_of_moduli(tolerances).values()))
    bound = min(max(by_moduli, LEAST), LONGEST) / BEYOND
    for task, at in part.analysis.configurations.items():
        if not scales(at) or float(np.max(given_pressures(at), initial=0.0)) <= 0.0:
            continue
        equilibrium, tangent = part.analysis.equilibria[task], Tangent(part.disc.model)
        with doing(f"looking for ballooning in task {task}"):
            if limit_ahead(at, part.disc.tangents[task], equilibrium.state) > LONGEST:
                continue
            ahead = find_margin(at, tangent, equilibrium, bound)
            if ahead.state is None:
                continue
            by_X, by_loads, by_forces = limit_slope(at, tangent, ahead)
        shapes = shape_causes(part.disc.morph, at.X, tolerances)
        changes = [each.tolerance * np.tensordot(by_X, each.everywhere(part.disc.morph), axes=2) for each in shapes]
        for cause in _of_loads(part, at, tolerances):
            up, down = (as_cast(at, None, {name: way * each for name, each in cause.items()}).loads for way in WAYS)
            ways = zip(up, down, strict=True)
            change = Loads(*((np.asarray(one) - np.asarray(other)) / (2.0 * WAYS[0]) for one, other in ways))
            change = change._replace(pressure=ahead.load * np.asarray(change.pressure))
            changes.append(np.sum([np.sum(by * each) for by, each in zip(by_loads, change, strict=True)]))
        for region, forces in forces_by_constants(at, ahead.state, constants).items():
            changes += list(constants[region].errors @ (forces @ by_forces))
        found[task] = Ballooning(ahead.load, float(np.linalg.norm(changes)) / ahead.load)
    return found


def _of_moduli(tolerances: Tolerances) -> dict[str, float]:
    """The deviations of the moduli of a single rubber, by causes."""
    return {MODULUS: tolerances.rubbers.get("", tolerances.rubber), HISTORY: tolerances.histories.get("", 0.0)}


def _of_loads(part: Solved, at: Configuration, tolerances: Tolerances) -> Iterator[dict[str, float]]:
    """One deviation of every cause that moves no nodes: what changes together in it, by names."""
    for name, tolerance in _of_moduli(tolerances).items():
        yield {name: tolerance}
    # A chamber of a part stands for its images, whose pressures vary by themselves.
    for names in map(chambers_of, part.disc.morph.mesh.faces):
        if names:
            yield dict.fromkeys(map(pressure_of, names), tolerances.pressure / math.sqrt(len(names)))
    for name in (*LOADS.values(), *map(stiffness_of, at.model.reinforcements)):
        yield {name: tolerances.load}
