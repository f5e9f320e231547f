"""Checks of motions: whether the symmetry of a body and its loads forbids those that are asked for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pneumorph.problem.acting import acting
from pneumorph.problem.body import Symmetry
from pneumorph.problem.components import MOTIONS
from pneumorph.problem.models import Task
from pneumorph.problem.tables import Tables
from pneumorph.symmetry.images import image
from pneumorph.symmetry.operations import operations


def check_motions(problem: Tables) -> Iterator[tuple[str, str]]:
    """Motions that a symmetry of body, pressures and loads forbids."""
    if problem.obstacle:
        return
    # Of fibres and layers it is only known whether they are their own mirror images.
    layered = problem.region or problem.membrane or problem.fibres
    handed = any(fibres.handed for fibres in problem.fibres)
    symmetry = problem.tubes.symmetry
    alone = {f'mirror "{plane}"': Symmetry(mirror=(plane,)) for plane in symmetry.mirror}
    if symmetry.rotation > 1:
        alone[f"rotation = {symmetry.rotation}"] = Symmetry(rotation=symmetry.rotation)
    if symmetry.point:
        alone["point"] = Symmetry(point=True)
    if symmetry.half_turn:
        alone[f'half_turn = "{symmetry.half_turn}"'] = Symmetry(half_turn=symmetry.half_turn)
    for index, task in enumerate(problem.task):
        for motion, key in _asked(problem, index, task):
            if handed if motion == "twist" else layered:
                continue
            for name, each in {**alone, "of all kinds together": symmetry}.items():
                if not _possible(problem, task, each)[MOTIONS.index(motion)]:
                    instead = ' (half_turn = "x" also keeps both halves alike)' if motion == "twist" else ""
                    yield (
                        key,
                        f"{motion} is ruled out by body.symmetry, {name}: body, pressures and loads are symmetric, and "
                        f"so are all motions; leave that symmetry out{instead}, or give chambers that are images of "
                        "each other unlike pressures",
                    )
                    break


def _asked(problem: Tables, index: int, task: Task) -> Iterator[tuple[str, str]]:
    """The motions that must not be zero in a task, and their keys."""
    for motion, (key, _) in task.objective.asked_motions.items():
        yield motion, f"task[{index}].objective.{key}"
    if task.objective.section_count[1]:
        # A curve that is not on the axis. A place beside it can be reached in part, along the axis.
        about = task.objective.bends(problem.tubes.length)
        x, y = (0.0, 0.0) if about is None else (about[1], about[0])
        for motion, sideways in (("shift_x", x), ("shift_y", y)):
            if abs(sideways) > 1e-6:
                yield motion, f"task[{index}].objective"
    for where, limits in (("limits", problem.limits), (f"task[{index}].limits", task.limits)):
        if limits is not None and limits.at_least is not None:
            for motion in MOTIONS:
                if getattr(limits.at_least, motion) is not None:
                    yield motion, f"{where}.at_least.{motion}"


def _possible(problem: Tables, task: Task, symmetry: Symmetry) -> NDArray[np.bool_]:
    """Which of `MOTIONS` (6,) the tip can have where symmetric loads keep a body symmetric.

    An operation g that keeps the tip in its place turns shifts to g t and rotations to det(g) g θ. One that exchanges
    base and tip turns the rotation of the tip relative to the base, R, to its inverse: θ is -det(g) g θ then.
    """
    shifts, turns = [], []
    for g in operations(symmetry):
        if not (np.trace(g) > 3.0 - 1e-9 or _keeps(problem, task, g)):
            continue
        handed = round(float(np.linalg.det(g)))
        turns.append(g[2, 2] * handed * g)
        if g[2, 2] > 0.0:
            shifts.append(g)
    # The mean over a group projects onto what it keeps.
    kept = np.concatenate([np.diag(np.mean(shifts, axis=0)), np.diag(np.mean(turns, axis=0))])
    return kept > 1e-9


def _keeps(problem: Tables, task: Task, g: NDArray[np.float64]) -> bool:
    """Whether an operation maps pressures, weight and what is on the plate to themselves."""
    chambers, names = problem.tubes.chamber, [chamber.name for chamber in problem.tubes.chamber]
    for index, name in enumerate(names):
        other = image(chambers, index, g, problem.tubes.length)
        if other is None:
            return False
        if other == index:
            continue
        filled = task.volume or {}
        if _supply(task, name) != _supply(task, names[other]) or chambers[index].gas != chambers[other].gas:
            return False
        if filled.get(name) is not None or filled.get(names[other]) is not None:
            return False
    under = acting(problem, task)
    borne = bool(under.hold.values) or any(value > 0.0 for _, value in under.spring)
    if g[2, 2] < 0.0:
        return not (borne or under.moves)
    turned = np.any(np.abs(g - np.diag(np.diag(g))) > 1e-9)
    return not (borne and turned) and not under.breaking(g)


def _supply(task: Task, name: str) -> float | str:
    """The pressure of a chamber, MPa; of one that is designed, the name of the chamber that has the supply."""
    pressure = task.pressure.get(name)
    if pressure is None:
        return 0.0
    return (pressure.same_as or name) if pressure.free else pressure.start
