"""A problem under other loads than those of its first task, as users write them."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from typing import Any

import numpy as np

from pneumorph.analysis.pressures import HELD, held_values
from pneumorph.errors import ProblemError
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting
from pneumorph.problem.components import component_of, is_turn
from pneumorph.problem.models import Hold
from pneumorph.units import FORCE, MOMENT, parse

WRENCH = {f"{kind}_{axis}": unit for kind, unit in (("force", FORCE), ("moment", MOMENT)) for axis in "xyz"}
"""Components of what acts on the plate, and what they are measured in."""

GRAVITY = "gravity"


def under_loads(problem: Problem, load: Mapping[str, Any], block: Iterable[str], pushed: Iterable[str] = ()) -> Problem:
    """A problem with other loads in its first task; what is not given stays.

    Parameters
    ----------
    problem : Problem
    load : mapping
        Components of the force and moment on the plate, {"force_x": "-0.1 N", "moment_z": "2 N*mm"}, and the direction
        of gravity, {"gravity": "0,0,-1"}.
    block : iterable of "shift_x" or "shift_x=2 mm"
        Motions of the plate that are held.
    pushed : iterable of motions
        Held where they are at rest, unless they are held anyway.

    Raises
    ------
    ProblemError
        If a load or a motion is unknown or no quantity, or there is no plate or no weight.
    """
    first = problem.task[0]
    under = acting(problem, first)
    block = [*(name for name in pushed if component_of(name) not in under.hold.values), *block]
    if problem.end_effector.kind == "free" and (block or any(name != GRAVITY for name in load)):
        raise ProblemError('load: acts on a plate, and the tip is free; set kind = "plate" in [end_effector]')
    changes: dict[str, Any] = {}
    own = dict(zip(WRENCH, under.wrench, strict=True))
    for name, asked in load.items():
        if name == GRAVITY:
            if under.gravity is None:
                raise ProblemError("load gravity: the body has no weight; add the table [gravity] to the problem")
            changes["gravity"] = under.gravity.model_copy(update={"direction": _direction(asked)})
            continue
        if name not in WRENCH:
            raise ProblemError(f"load {name}: is no load; use one of {', '.join(WRENCH)}, {GRAVITY}")
        try:
            own[name] = parse(asked, WRENCH[name])
        except ValueError as error:
            raise ProblemError(f"load {name}: {error}") from None
    values = list(own.values())
    if tuple(values) != under.wrench:
        changes |= {"force": tuple(values[:3]), "moment": tuple(values[3:])}
    if block:
        held = {name.removeprefix(HELD): each for name, each in held_values(block).items()}
        if swept := [name for name, each in held.items() if len(each) > 1]:
            raise ProblemError(f"block {swept[0]}: is held at one value here; write it as {swept[0]}=2mm")
        kept = under.hold.values | {name: float(each[0]) for name, each in held.items()}
        changes["hold"] = Hold.model_validate(
            {name: f"{value!r} {'rad' if is_turn(name) else 'mm'}" for name, value in kept.items()}
        )
    if not changes:
        return problem
    return problem.model_copy(update={"task": (first.model_copy(update=changes), *problem.task[1:])})


def _direction(asked: Any) -> tuple[float, float, float]:
    try:
        vector = np.array([float(part) for part in (asked.split(",") if isinstance(asked, str) else asked)])
    except (TypeError, ValueError):
        vector = np.zeros(0)
    length = float(np.linalg.norm(vector))
    if vector.shape != (3,) or not 0.0 < length < np.inf:
        raise ProblemError(f'load gravity: "{asked}" is no direction; write x, y and z, such as gravity=0,0,-1')
    x, y, z = (vector / length).tolist()
    return x, y, z
