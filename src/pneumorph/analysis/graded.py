"""Elements that are divided where a design's error of the mesh comes from, until it is as small as `mesh.error`, and
those whose parts are joined again where little of it comes from."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace

import numpy as np

from pneumorph.analysis.accuracy import LEVER, MeshError, mesh_errors, refined_model
from pneumorph.analysis.analyse import Analysis, Discretisation, build_discretisation
from pneumorph.analysis.castings import casting_name
from pneumorph.analysis.sized import LARGEST, motion_share, worst_motion
from pneumorph.doing import doing
from pneumorph.mechanics import State
from pneumorph.mechanics.solve.local import contributions
from pneumorph.mechanics.solve.refined import on_refined
from pneumorph.mesh.bisect import divided_morph
from pneumorph.problem import Problem, Task
from pneumorph.sensitivity.response import measured_of

AIM = 0.95
"""Part of the error that is asked for at which elements are divided: where it is missed, some more are."""

LEFT = 0.3
"""The part of an element's contribution that its parts have: `linear` has 0.28 where all elements are divided."""

WHOLE = 16.0
"""What an element contributes over what its parts did, where they are joined: little comes from where the solution is
smooth, and there errors fall with the fourth power of the size. With 1/`LEFT` in its place `bending` had seven times
the error that was meant."""

AMPLE = 0.5
"""Part of the error that is asked for below which elements are larger in the next mesh, and up to which they are."""

BULK = 0.5
"""Largest part of all contributions whose elements are divided at a time: what is left is looked at again after it."""


def to_divide(
    problem: Problem, disc: Discretisation, analysis: Analysis, errors: Mapping[str, MeshError]
) -> np.ndarray:
    """The elements (m,) that contribute most to errors larger than `mesh.error`; none where that is not known.

    As few as needed, if their parts contribute `LEFT` of what they do, but no more than `BULK` of the error at a time.

    Parameters
    ----------
    problem : of the design.
    disc, analysis : its mesh and its states.
    errors : of its tasks.
    """
    asked, marked = problem.mesh.error, np.zeros(disc.model.elements, bool)
    if asked is None or disc.model.elements > LARGEST:
        return np.flatnonzero(marked)
    large = [task for task in problem.task if task.name in errors and motion_share(task, errors[task.name]) > asked]
    for share, parts in _shared_out(problem, disc, analysis, errors, large):
        order = np.argsort(-parts)
        needed = (1.0 - AIM * asked / share) / (1.0 - LEFT)
        marked[order[: 1 + int(np.searchsorted(np.cumsum(parts[order]), min(needed, BULK)))]] = True
    return np.flatnonzero(marked)


@doing("the error of the mesh")
def joined(problem: Problem, disc: Discretisation, analysis: Analysis) -> np.ndarray | None:
    """How many times every element (m,) is halved in the body's next mesh: once less where `mesh.error` allows it.

    Where all errors are far below `mesh.error`, that is done with the elements that contribute least to them, as long
    as the errors stay small if each contributes `WHOLE` times what its parts do. None if no element has been divided.

    Parameters
    ----------
    problem : of the design.
    disc, analysis : its mesh and its states.
    """
    halved, asked = disc.morph.mesh.halved, problem.mesh.error
    if halved is None or asked is None or not halved.any():
        return halved
    errors = mesh_errors(problem, disc, analysis, thorough=False)
    known = [task for task in problem.task if task.name in errors]
    found = list(_shared_out(problem, disc, analysis, errors, known))
    if len(found) < len(problem.task):
        return halved
    more = np.array([(WHOLE - 1.0) * share * parts for share, parts in found])
    room = np.array([[AMPLE * asked - share] for share, _ in found])
    able = np.flatnonzero(halved > 0.0)
    order = able[np.argsort(more[:, able].max(axis=0))]
    fit = np.all(np.cumsum(more[:, order], axis=1) <= room, axis=0)
    less = order[: np.count_nonzero(fit)]
    halved = halved.copy()
    halved[less] = np.maximum(halved[less] - 1.0, 0.0)
    return halved


def _shared_out(
    problem: Problem,
    disc: Discretisation,
    analysis: Analysis,
    errors: Mapping[str, MeshError],
    tasks: Sequence[Task],
) -> Iterator[tuple[float, np.ndarray]]:
    """The share of every task, see `motion_share`, and the part (m,) of each element in it; those that are known."""
    refined = refined_model(problem, disc.morph.mesh.at(analysis.X)) if tasks else None
    if refined is None:
        return
    for task in tasks:
        at, state = analysis.configurations[task.name], analysis.equilibria[task.name].state
        there = replace(at, model=refined.model, X=refined.fine.mesh.points)
        measured = measured_of(shift=at.loads.shift)
        seeds = measured.jacobian(there.model, there.X, on_refined(refined.fine, at, state))[2][:6]
        error = errors[task.name]
        seed = _combined(seeds, _weights(task, error))
        found = contributions(refined.fine, at, disc.tangents[task.name], state, there, [seed])
        if found is not None and np.any(found):
            yield motion_share(task, error), found[0] / found[0].sum()


def divided(
    problem: Problem, disc: Discretisation, analysis: Analysis, marked: np.ndarray, heights: Sequence[float]
) -> tuple[Discretisation, dict[str, State]]:
    """The mesh of a design with some elements divided, and its states there, from which equilibria are near.

    Parameters
    ----------
    problem : of the design.
    disc, analysis : its mesh and its states.
    marked : (m,) int
        The elements.
    heights : see `build_morph`.
    """
    morph, fine = divided_morph(disc.morph, analysis.points, marked, heights)
    states = {
        name: on_refined(fine, at, analysis.equilibria[name].state) for name, at in analysis.configurations.items()
    }
    for task, castings in analysis.castings.items():
        for number, each in enumerate(castings):
            states[casting_name(task, number)] = on_refined(fine, each.at, each.equilibrium.state)
    return build_discretisation(problem, morph, analysis.points), states


def _weights(task: Task, error: MeshError) -> np.ndarray:
    """By how much each motion (6,) counts in the share of a task, see `motion_share`."""
    if (worst := worst_motion(task, error)) is not None:
        return np.where(np.arange(6) == worst, 1.0, 0.0)
    lever = np.repeat([1.0, LEVER], 3)
    return lever**2 * error.missing / np.linalg.norm(lever * error.missing)


def _combined(seeds: Sequence[State], weights: np.ndarray) -> State:
    """Their weighted sum."""

    def summed(*fields: np.ndarray) -> np.ndarray:
        return np.tensordot(weights, np.array(fields), 1)

    return State(*map(summed, *seeds))
