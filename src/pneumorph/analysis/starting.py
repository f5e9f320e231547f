"""The analysis of a body to begin from: it finds the states of all tasks, or says what is in the way of them."""

from __future__ import annotations

import math
from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np

from pneumorph.analysis.analyse import DESIGN_TOLERANCE, Analysis, Discretisation, analyse, build_discretisation
from pneumorph.analysis.bodies import mesh_of
from pneumorph.doing import doing
from pneumorph.errors import Hopeless, MeshError
from pneumorph.geometry import Body, DesignSpace
from pneumorph.mechanics import (
    NoEquilibrium,
    configure,
    guided_of,
    loads_of,
    part_of,
    rotation,
    solve,
)
from pneumorph.problem import Problem, Task
from pneumorph.problem.acting import acting
from pneumorph.problem.beam import Beam, beam_of, key_of_loads
from pneumorph.problem.components import MOTIONS

TURNED, STRETCHED = math.radians(90.0), 1.0
"""From this rotation of the tip or this strain of a beam on, one state is found without pressure before all others."""

OPPOSED, FOLDED = math.radians(60.0), math.radians(120.0)
"""Rotations of the tip by the loads alone: beyond the first a task that asks for the opposite has no prospect, beyond
the second none has."""

BUCKLED = 2.0
"""Load over the one at which a beam buckles, beyond which pressure does not keep the body straight either."""

COARSE = 400
"""Elements of the mesh on which that state is found."""

MOST = 40
"""Most factorisations for it, and for the first states of a body that hardly bears its loads."""

ENOUGH = 1e-3
"""Relative residual of that state."""


def coarser(problem: Problem, body: Body, disc: Discretisation, enough: int) -> Discretisation:
    """A mesh of the body with about so many elements; its own where it has no more, or a coarser one cannot be made.

    Parameters
    ----------
    problem, body : what is meshed.
    disc : its own mesh.
    enough : number of elements.
    """
    if disc.model.elements <= enough:
        return disc
    size = problem.mesh.size * (disc.model.elements / enough) ** (1 / 3)
    try:
        coarse = build_discretisation(problem, mesh_of(problem, body, part_of(problem), size), body.control_points())
    except MeshError:
        return disc
    return coarse if coarse.model.elements < disc.model.elements else disc


def analyse_start(
    problem: Problem, space: DesignSpace, disc: Discretisation, phi: np.ndarray, tolerance: float = DESIGN_TOLERANCE
) -> Analysis:
    """Find the states of all tasks from rest.

    Parameters
    ----------
    problem, space : with its tasks and variables.
    disc : a mesh of the body.
    phi : (n,) its design.
    tolerance : relative residual of the equilibria.

    Raises
    ------
    Hopeless
        If the loads alone fold the body over, or there is no state at the starting pressures; the reason says at which
        pressures there are some.
    """
    doubted = {}
    for index, task in enumerate(problem.task):
        beam = beam_of(problem, task)
        if beam and (beam.angle > TURNED or beam.compression > 1.0 or abs(beam.strain) > STRETCHED):
            doubted[index] = _words(problem, index, beam)
            with doing("finding out whether the body bears its loads without pressure"):
                _require_bearing(problem, space, disc, phi, index, beam)
    most = MOST if doubted else math.inf
    analysis = analyse(problem, space, disc, phi, tolerance=tolerance, most=most, explain=not doubted)
    if isinstance(analysis, NoEquilibrium):
        raise Hopeless("; ".join([f"the start cannot be analysed: {analysis.reason}", *doubted.values()]))
    return analysis


def _require_bearing(
    problem: Problem, space: DesignSpace, disc: Discretisation, phi: np.ndarray, index: int, beam: Beam
) -> None:
    """Refuse a body that the loads of a task alone fold over; one without a state under them may bear them otherwise.

    Parameters
    ----------
    problem, space, disc, phi : as of `analyse_start`.
    index : of the task.
    beam : the estimate for it.
    """
    coarse = coarser(problem, space.body(phi), disc, COARSE)
    task = problem.task[index]
    under = acting(problem, task)
    X = coarse.morph.positions(space.control_points(phi))
    loads = loads_of(problem, coarse.model, {}, task.poses, space.reinforcement(phi), under)
    at = configure(coarse.model, X, loads, guided_of(problem, under))
    loaded = solve(at, coarse.tangents[task.name], tolerance=ENOUGH, most=MOST)
    if isinstance(loaded, NoEquilibrium):
        expected: dict[str, float] = dict(zip(MOTIONS, (0.0, 0.0, 0.0, *beam.turned, 0.0), strict=True))
        if beam.compression <= BUCKLED and not _opposed(task, expected):
            return
        what = "the body does not bear its loads"
        raise Hopeless(f"{key_of_loads(problem, index)}: {what}; {_words(problem, index, beam)}")
    shift, turn = loaded.plate[:3], loaded.plate[3:]
    angle = math.acos(float(np.clip(rotation(jnp.asarray(turn))[2, 2], -1.0, 1.0)))
    moved: dict[str, float] = dict(zip(MOTIONS, (*shift, *turn), strict=True))
    touches = coarse.model.contact is not None and coarse.model.contact.own is not None
    if not touches and coarse.skin.intersects_itself(X + loaded.u):
        what = f"press the body into itself (its tip moves to z = {problem.body.length + shift[2]:.3g} mm)"
    elif not loaded.stable and beam.compression > BUCKLED:
        what = "make the body buckle"
    elif angle > FOLDED:
        what = f"fold the body over: they turn its tip by {math.degrees(angle):.0f}°"
    elif motion := _opposed(task, moved):
        what = f"turn its tip by {math.degrees(moved[motion]):.0f}° in {motion}, against what task {task.name} asks for"
    else:
        return
    key, words = key_of_loads(problem, index), _words(problem, index, beam)
    raise Hopeless(f"{key}: without pressure, the loads alone {what}; {words}")


def _opposed(task: Task, moved: Mapping[str, float]) -> str | None:
    """A rotation by the loads alone that is far on the other side of what a task asks for."""
    for motion, (_, value) in task.objective.asked_motions.items():
        if motion in MOTIONS[3:] and value * moved[motion] < 0.0 and abs(moved[motion]) > OPPOSED:
            return motion
    return None


def _words(problem: Problem, index: int, beam: Beam) -> str:
    """What the estimate as a beam says, and what to do."""
    parts = []
    if beam.angle > TURNED:
        parts.append(f"would bend by {math.degrees(beam.angle):.0f}°")
    if beam.compression > 1.0:
        parts.append(f"carries {beam.compression:.2g} times its buckling load")
    if abs(beam.strain) > STRETCHED:
        parts.append(f"is strained by {100.0 * beam.strain:.0f} % along its axis")
    key = key_of_loads(problem, index).rpartition(".")[2]
    return f"as a linear beam it {' and '.join(parts)}; make the {key} smaller, the body thicker, or its rubber stiffer"
