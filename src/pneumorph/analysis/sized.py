"""The size of equal elements from which a mesh is graded for an error that is asked for, `mesh.error`.

The error of one mesh is estimated, and so is that of a finer or coarser one, of which the order follows in which the
error falls with the size. Elements that contribute most are divided afterwards (`graded.py`).
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.analysis.accuracy import LEVER, MOST, ORDER, MeshError, mesh_errors
from pneumorph.analysis.analyse import Analysis, Discretisation, build_discretisation
from pneumorph.analysis.bodies import mesh_of
from pneumorph.analysis.starting import analyse_start
from pneumorph.doing import doing
from pneumorph.errors import ProblemError
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.mechanics import part_of
from pneumorph.problem import Problem, Task
from pneumorph.problem.components import MOTIONS
from pneumorph.results import HistoryEntry, RunResult

ORDERS = (0.8, 4.0)
"""Between these, orders that follow from two meshes are believed: errors may change their sign between them."""

COARSER = 3.0
"""The error of the mesh of equal elements over that which is asked for: one that elements are divided for twice."""

AIM, ENOUGH = 0.8, 0.5
"""Part of an error at which a size aims, and above which a mesh is not finer than needed."""

FACTORS = (0.4, 1.6)
"""Between these factors on the size of a mesh its error tells that of another."""

ROUNDS, SAME = 4, 0.02
"""Most meshes whose error is estimated, and the relative difference of sizes that are the same."""

SLIGHT = 0.1
"""A motion that is a smaller part of the whole one, as bending at a symmetric start, is taken to be so large."""

TINY = 1e-9
"""Errors and motions below which there is nothing to compare."""

LARGEST = 100_000
"""Elements of meshes that are chosen so."""

EVERY, GROWN = 5, 1.5
"""In every so many designs it is looked whether the error is more than what is asked for; after the first of them also
where a motion is so many times as large as when it was looked at last. Before that, motions grow so in every design and
are small beside those of the end: with 4 % asked, `bending` had 16,349 elements at 21° where each was looked at, and
4,436 at 35° where the fifth was the first."""


@dataclass(frozen=True)
class Sized:
    """The relative error of a mesh with elements of a size, mm."""

    size: float
    error: float
    elements: int

    def elements_at(self, size: float) -> float:
        """About how many elements of another size, mm, there would be."""
        return self.elements * (self.size / size) ** 3


@doing("choosing the size of elements")
def sized(problem: Problem) -> Problem:
    """A problem with the size of elements from which the mesh of its start is graded for the error that it asks for.

    Raises
    ------
    ProblemError
        If more elements are needed than can be solved, or the error is not known.
    ComputationError
        If the start cannot be meshed or has no equilibrium.
    """
    asked = problem.mesh.error
    if asked is None:
        return problem
    coarsest = math.inf if problem.solid is not None else problem.body.radius
    return _with(problem, chosen(lambda size: _estimated(problem, size), problem.mesh.size, COARSER * asked, coarsest))


def chosen(estimated: Callable[[float], Sized], size: float, asked: float, coarsest: float) -> float:
    """The size of elements, mm, for a relative error.

    Parameters
    ----------
    estimated : function of a size
        Its mesh with the error, perhaps of another size.
    size : the first one.
    asked : the error.
    coarsest : the largest possible size, mm.

    Raises
    ------
    ProblemError
        If it takes more elements than can be solved.
    """
    found: list[Sized] = []
    while True:
        found.append(estimated(size))
        last = found[-1]
        if ENOUGH * asked <= last.error <= asked:
            return last.size
        wanted = min(next_size(found, asked), coarsest)
        size = last.size * float(np.clip(wanted / last.size, *FACTORS))
        if len(found) < ROUNDS and abs(size - last.size) > SAME * last.size and 8 * last.elements_at(size) <= MOST:
            continue
        if len(found) == 1:
            # A finer mesh cannot be refined: a coarser one tells how errors fall.
            found.insert(0, estimated(min(FACTORS[1] * last.size, coarsest)))
            wanted = min(next_size(found, asked), coarsest)
        if (elements := last.elements_at(wanted)) > LARGEST:
            least = last.error * (last.elements / LARGEST) ** (ORDER / 3)
            raise ProblemError(
                f"mesh.error: {100 * asked:.3g} % takes about {elements:.0g} elements of {wanted:.2g} mm; ask for "
                f"{100 * least:.1g} % or more"
            )
        return wanted


def next_size(found: Sequence[Sized], asked: float) -> float:
    """The size, mm, at which the error is expected to be a little less than what is asked for.

    Parameters
    ----------
    found : the meshes whose error is known, the last one nearest to what is sought.
    asked : relative.
    """
    last, order = found[-1], ORDER
    if len(found) > 1 and found[-2].size != last.size:
        ratio = max(found[-2].error, TINY) / max(last.error, TINY)
        order = float(np.clip(math.log(ratio) / math.log(found[-2].size / last.size), *ORDERS))
    return last.size * (AIM * asked / max(last.error, TINY)) ** (1.0 / order)


def is_estimated(problem: Problem, number: int, moved: np.ndarray, looked: np.ndarray, remeshed: bool = False) -> bool:
    """Whether the error of a design is estimated once it is accepted, as `mesh.error` needs it.

    The estimate takes 7 to 18 equivalents, about as much as a design. Without `mesh.error` only the last has it.

    Parameters
    ----------
    problem : of the run.
    number : of the design.
    moved : (tasks,) how far the tip moves in every task, mm, see `moved`.
    looked : (tasks,) or (0,) the same of the design that was looked at last; empty if none was.
    remeshed : whether the design has a new mesh.
    """
    if problem.mesh.error is None:
        return False
    if number >= problem.optimizer.iterations or number % EVERY == 0 or not len(looked):
        return True
    return number > EVERY and (remeshed or bool(np.any(moved > GROWN * looked)))


def moved(problem: Problem, analysis: Analysis) -> np.ndarray:
    """How far the tip moves in every task (tasks,), mm, where rotations are motions at the distance `LEVER`."""
    lever = np.repeat([1.0, LEVER], 3)
    return np.array([np.linalg.norm(lever * analysis.equilibria[task.name].plate) for task in problem.task])


def relative_error(problem: Problem, disc: Discretisation, analysis: Analysis) -> float | None:
    """The largest error of the mesh in the motions that tasks are about, see `largest_share`."""
    return largest_share(problem, mesh_errors(problem, disc, analysis))


def largest_share(problem: Problem, errors: Mapping[str, MeshError]) -> float | None:
    """The largest error of the mesh in the motions that tasks are about, relative to them; see `motion_share`.

    None if that of a task is not known.
    """
    if any(task.name not in errors for task in problem.task):
        return None
    return max(motion_share(task, errors[task.name]) for task in problem.task)


def recorded_share(problem: Problem, entry: HistoryEntry) -> float | None:
    """The same of a design in a history; None if it has no estimates of all tasks."""
    return largest_share(problem, {name: MeshError(entry.tasks[name], fine) for name, fine in entry.finer.items()})


def result_share(problem: Problem, result: RunResult) -> float | None:
    """The same of the result of a run."""
    return largest_share(problem, {name: MeshError(result.tasks[name], fine) for name, fine in result.finer.items()})


def motion_share(task: Task, error: MeshError) -> float:
    """The error over the motion of the tip: the largest of the components that a task is about, or that of all."""
    worst = worst_motion(task, error)
    return error.share if worst is None else float(relative_errors(error)[worst])


def worst_motion(task: Task, error: MeshError) -> int | None:
    """Which of the motions that a task is about has the largest relative error; None if it is about none."""
    about = [MOTIONS.index(name) for name in task.objective.tip_motions]
    return max(about, key=lambda k: relative_errors(error)[k]) if about else None


def relative_errors(error: MeshError) -> np.ndarray:
    """The errors over the motions (6,); of those that are small beside the others, over a part of the whole motion."""
    lever = np.repeat([1.0, LEVER], 3)
    least = SLIGHT * np.linalg.norm(lever * error.motion) / lever
    return np.abs(error.missing) / np.maximum(np.maximum(np.abs(error.motion), least), TINY)


def _estimated(problem: Problem, size: float) -> Sized:
    """The error of the start on a mesh of a size; of a coarser one, where its refinement would be too large."""
    there = _with(problem, size)
    body = body_of(there)
    morph = mesh_of(there, body, part_of(there))
    if (many := 8 * len(morph.mesh.tets) / MOST) > 1.0:
        return _estimated(problem, 1.1 * size * many ** (1 / 3))
    disc, space = build_discretisation(there, morph, body.control_points()), space_of(there, body)
    analysis = analyse_start(there, space, disc, space.start)
    error = relative_error(there, disc, analysis)
    if error is None:
        raise ProblemError("mesh.error: is not known, since no state is found on a refined mesh; give mesh.size alone")
    return Sized(size, error, disc.model.elements)


def _with(problem: Problem, size: float) -> Problem:
    return problem.with_changes({"mesh.size": f"{size:.3g} mm"})
