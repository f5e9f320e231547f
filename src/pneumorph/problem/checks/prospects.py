"""Whether what is asked for can be reached at all: motions that a symmetry forbids, and limits on states."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from pneumorph.problem.acting import acting
from pneumorph.problem.body import Symmetry
from pneumorph.problem.components import MOTIONS
from pneumorph.problem.materials import materials
from pneumorph.problem.models import Task
from pneumorph.problem.objectives import Maximize, TargetMotion
from pneumorph.problem.regions import REST
from pneumorph.problem.tables import Tables
from pneumorph.symmetry.images import image
from pneumorph.symmetry.operations import operations


def check_states(problem: Tables) -> Iterator[tuple[str, str]]:
    """Bounds on states that not even a body at rest keeps."""
    limits = problem.limits
    for name, material in materials(problem).items():
        if not isinstance(limits.strain, float) or material.valid_stretch is None:
            continue
        if limits.strain * material.valid_stretch <= 1.0:
            where = "" if name == REST else f' of region "{name}"'
            yield (
                "limits.strain",
                f"{limits.strain:g} is out of reach: at rest, the stretch of 1 is {1.0 / material.valid_stretch:.3g} "
                f"of the range of the rubber{where}; use a larger one, usually 1",
            )


def check_motions(problem: Tables) -> Iterator[tuple[str, str]]:
    """Shifts and bending that a symmetry of body, pressures and loads forbids; for twist see `across`."""
    if problem.region or problem.membrane or problem.fibres or problem.obstacle:
        return
    symmetry = problem.tubes.symmetry
    alone = {f'mirror "{plane}"': Symmetry(mirror=(plane,)) for plane in symmetry.mirror}
    if symmetry.rotation > 1:
        alone[f"rotation = {symmetry.rotation}"] = Symmetry(rotation=symmetry.rotation)
    if symmetry.point:
        alone["point"] = Symmetry(point=True)
    if symmetry.half_turn:
        alone[f'half_turn = "{symmetry.half_turn}"'] = Symmetry(half_turn=symmetry.half_turn)
    for index, task in enumerate(problem.task):
        asked = task.objective
        if isinstance(asked, TargetMotion):
            keys = {motion: motion for motion, value in asked.targets.items() if value and asked.weight_of(motion)}
        else:
            keys = {asked.component: "motion"} if isinstance(asked, Maximize) else {}
        for motion, key in keys.items():
            if motion == "twist":
                continue
            for name, each in {**alone, "of all kinds together": symmetry}.items():
                if not _possible(problem, task, each)[MOTIONS.index(motion)]:
                    yield (
                        f"task[{index}].objective.{key}",
                        f"{motion} is ruled out by body.symmetry, {name}: body, pressures and loads are symmetric, and "
                        "so are all motions; leave that symmetry out, or give chambers that are images of each other "
                        "unlike pressures",
                    )
                    break


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
        own, given = task.pressure.get(name), task.pressure.get(names[other])
        if own != given or (own is not None and own.free) or chambers[index].gas != chambers[other].gas:
            return False
        if filled.get(name) is not None or filled.get(names[other]) is not None:
            return False
    under = acting(problem, task)
    weight = np.zeros(3) if under.gravity is None else np.array(under.gravity.vector)
    borne = bool(under.hold.values) or any(value > 0.0 for _, value in under.spring)
    loads = np.array([weight, under.force, under.moment])
    if g[2, 2] < 0.0:
        return not (borne or np.any(loads))
    if borne and (np.any(np.abs(g - np.diag(np.diag(g))) > 1e-9) or any(under.hold.values.values())):
        return False
    images = loads @ g.T
    images[2] *= np.linalg.det(g)
    return np.allclose(images, loads, atol=1e-12)
