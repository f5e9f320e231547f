"""A body at the pressures of a measured curve: what is solved at every point, and the states."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.analysis.analyse import build_discretisation, refuse_friction
from pneumorph.analysis.bodies import mesh_of
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry import Body
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    State,
    Tangent,
    configure,
    enclosed_of,
    guided_of,
    loads_of,
    part_of,
    sweep,
)
from pneumorph.mesh import Morph
from pneumorph.problem import Problem, Task
from pneumorph.problem.acting import acting


@dataclass(frozen=True)
class Curve:
    """A measured curve.

    Attributes
    ----------
    pressures : (n, C) MPa
        Of all chambers, in the order of the problem.
    quantity : str
        A motion of the tip, what it pushes with where it is held, or a volume; see `problem/quantities.py`.
    values : (n,) mm and rad, N and N·mm, mm³
    """

    pressures: np.ndarray
    quantity: str
    values: np.ndarray


def along(
    problem: Problem, body: Body, task: Task, pressures: np.ndarray, whole: bool = False
) -> tuple[Morph, list[Configuration]]:
    """A body meshed, and its configurations at pressures (n, C) in MPa.

    Parameters
    ----------
    problem, body : one of its designs.
    task : whose loads act.
    pressures : of all chambers, in the order of the problem.
    whole : mesh the whole body, also where a part of it has all motions under these pressures.

    Raises
    ------
    ProblemError
        If there is friction, or a pressure is unknown because a chamber is sealed or filled to a volume.
    """
    refuse_friction(problem)
    if enclosed_of(problem, task.volumes):
        raise ProblemError("measured: is for bodies whose pressures are given, without sealed and filled chambers")
    chambers = [each.name for each in problem.body.chamber]
    given = [dict(zip(chambers, map(float, row), strict=True)) for row in pressures]
    under = acting(problem, task)
    morph = mesh_of(problem, body, () if whole else part_of(problem, given, [under]))
    model, X = build_discretisation(problem, morph, body.control_points()).model, morph.mesh.points
    guided = guided_of(problem, under)
    return morph, [configure(model, X, loads_of(problem, model, row, task.poses, under=under), guided) for row in given]


def solved_along(points: Sequence[Configuration], pressures: np.ndarray, tangent: Tangent) -> list[State]:
    """The states of a body along a curve, each from that at the next lower pressure.

    Parameters
    ----------
    points : of the curve.
    pressures : (n, C) of all chambers.
    tangent : the linear solver of their model.

    Raises
    ------
    ComputationError
        If one is not found.
    """
    order = np.argsort(pressures.sum(axis=1), kind="stable")
    states: dict[int, State] = {}
    for number, answer in zip(order, sweep([points[k] for k in order], tangent), strict=True):
        if not isinstance(answer, Equilibrium):
            raise ComputationError(f"no state at point {number + 1} of the curve: {answer.reason}")
        states[int(number)] = answer.state
    return [states[k] for k in range(len(points))]
