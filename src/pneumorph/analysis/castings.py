"""Perturbed castings of a design, whose states are found beside the design's own: what makes a design robust.

With all causes of scatter z in standard deviations, the residuals of an objective differ by A z to first order. Where
they differ most is along A's first right singular vector v. An objective with a target is that of the castings
z = ±k v on average: of one residual r it is r̄² + (k s)², with the mean r̄ and the spread s of both. One without a
target is that of the worse casting, z = k v: its value plus k times its deviation. In between, nodes of castings are a
constant away from those of the design, so that derivatives of these objectives are exact.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from math import sqrt
from typing import NamedTuple

import numpy as np

from pneumorph.analysis.tolerances import MODULUS, Tolerances, as_cast, pressure_of, shape_causes
from pneumorph.mechanics import Configuration, Equilibrium, NoEquilibrium, State, Tangent, predict, solve
from pneumorph.mesh import Morph
from pneumorph.mesh.tets import chambers_of
from pneumorph.objective import Objective
from pneumorph.sensitivity import MotionSlopes, by_known, motion_slopes, objective_value


@dataclass(frozen=True, eq=False)
class Casting:
    """A perturbed casting.

    Attributes
    ----------
    changes : of all causes by their names, in the units of the code.
    motion : (N, 3) mm, of the causes that move nodes.
    tangent : its linear solver.
    """

    changes: Mapping[str, float]
    motion: np.ndarray
    tangent: Tangent


class TaskState(NamedTuple):
    """A state in a task, of the design or of a casting, with its linear solver and its objective.

    `softer` are the loads of its configuration per load of the design, see `as_cast`.
    """

    at: Configuration
    tangent: Tangent
    equilibrium: Equilibrium
    value: float
    softer: float = 1.0

    def by_design(
        self, by_pressure: Mapping[str, float], by_reinforcement: np.ndarray
    ) -> tuple[dict[str, float], np.ndarray]:
        """Derivatives by pressures and data (R, 2) of sheets and fibres of the design, from those by its own."""
        by_pressure = {chamber: self.softer * by for chamber, by in by_pressure.items()}
        return by_pressure, by_reinforcement * [self.softer, 1.0]


def casting_name(task: str, number: int) -> str:
    """What a casting of a task is called, from number 0 on."""
    return f"{task}, casting {number + 1}"


def solve_castings(
    castings: Sequence[Casting],
    at: Configuration,
    tangent: Tangent,
    state: State,
    objective: Objective,
    beside: Sequence[np.ndarray | None],
    tolerance: float,
    most: float,
) -> tuple[TaskState, ...] | NoEquilibrium:
    """The states of castings, with the factorisation of the body as it is designed where that is near enough.

    Parameters
    ----------
    castings : of the body.
    at, tangent, state : the equilibrium of the body as it is designed.
    objective : of the task.
    beside : by what (n,) unknowns differ from those of `state` where the searches begin; None: by first derivatives.
    tolerance, most : see `solve`.
    """
    solved = []
    for casting, apart in zip(castings, beside, strict=True):
        there = as_cast(at, casting.motion, casting.changes)
        start = predict(at, tangent, state, casting.motion, there.loads) if apart is None else None
        if apart is not None:
            start = at.model.state(at.model.vector(state) + apart)
        casting.tangent.borrow(tangent, there)
        found = solve(there, casting.tangent, start, tolerance, (at, state), most)
        if isinstance(found, NoEquilibrium):
            return found
        value = objective_value(there, casting.tangent, found.state, objective)
        softer = 1.0 / (1.0 + casting.changes[MODULUS])
        solved.append(TaskState(there, casting.tangent, found, value, softer))
    return tuple(solved)


def worst_changes(
    morph: Morph,
    at: Configuration,
    tangent: Tangent,
    state: State,
    objective: Objective,
    tolerances: Tolerances,
    deviations: float,
) -> tuple[Mapping[str, float], ...]:
    """The changes of all causes with which an objective differs most: two castings of one with residuals, else one.

    Parameters
    ----------
    morph : of the mesh.
    at, tangent, state : the equilibrium of the body as it is designed.
    objective : of the task.
    tolerances : of every cause.
    deviations : k, by how many standard deviations they differ.
    """
    causes = list(_causes(morph, at, motion_slopes(at, tangent, state, objective), tolerances))
    per_deviation = np.array([tolerance * by for _, tolerance, by in causes]).T
    worst = np.linalg.svd(per_deviation)[2][0]
    sides = (1.0, -1.0)
    if objective.residuals is None:
        sides = (float(np.sign(per_deviation[0] @ worst)),)
    return tuple(
        {
            name: side * deviations * z * tolerance
            for (names, tolerance, _), z in zip(causes, worst.tolist(), strict=True)
            for name in names
        }
        for side in sides
    )


def _causes(
    morph: Morph, at: Configuration, slopes: MotionSlopes, tolerances: Tolerances
) -> Iterator[tuple[Sequence[str], float, np.ndarray]]:
    """The names of what changes together, its standard deviation, and what it does to the residuals (k,) per unit."""
    yield (MODULUS,), tolerances.rubber, np.sum(list(slopes.moduli.values()), axis=0)
    pressures = np.array([by_known(at, loads.pressure) for loads in slopes.loads])
    for names in map(chambers_of, morph.mesh.faces):
        own = [at.model.chambers.index(name) for name in names]
        if np.any(np.asarray(at.loads.pressure)[own]):
            tolerance = tolerances.pressure / sqrt(len(names))
            yield [pressure_of(name) for name in names], tolerance, pressures[:, own].sum(axis=1)
    on_surface = np.array([morph.on_surface(by_X) for by_X in slopes.X])
    for each in shape_causes(morph, at.X, tolerances):
        by_nodes = slopes.X if len(each.motion) == len(at.X) else on_surface
        yield (each.name,), each.tolerance, np.tensordot(by_nodes, each.motion, axes=2)
