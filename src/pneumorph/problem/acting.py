"""What acts on a body beside pressures and obstacles: the loads of [end_effector] and [gravity], or a task's own."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.problem.components import MOTIONS, component_of
from pneumorph.problem.models import EndEffector, Gravity, Hold, Spring, Task
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables

Triple = tuple[float, float, float]


@dataclass(frozen=True)
class Acting:
    """Loads on a body.

    Attributes
    ----------
    force, moment : on the plate, N and N·mm.
    spring : between the plate and the ground.
    hold : what is held of it, and where.
    gravity : None without.
    """

    force: Triple
    moment: Triple
    spring: Spring
    hold: Hold
    gravity: Gravity | None

    @property
    def acceleration(self) -> Triple:
        """Of gravity, mm/s²."""
        return (0.0, 0.0, 0.0) if self.gravity is None else self.gravity.vector

    @property
    def wrench(self) -> tuple[float, ...]:
        """Force and moment (6,) on the plate."""
        return *self.force, *self.moment

    @property
    def moves(self) -> bool:
        """Whether a body moves under these loads, without any pressure."""
        return any((*self.acceleration, *self.wrench, *self.hold.values.values()))

    def breaking(self, operation: np.ndarray) -> list[str]:
        """The keys of the loads that are not their own images under an orthogonal matrix (3, 3).

        Moments and rotations are axial vectors: reflections turn them the other way.
        """
        held = np.array([self.hold.values.get(component_of(motion), 0.0) for motion in MOTIONS])
        axial = np.linalg.det(operation) * operation
        given = [
            ("gravity", self.acceleration, operation),
            ("force", self.force, operation),
            ("moment", self.moment, axial),
            ("hold", held[:3], operation),
            ("hold", held[3:], axial),
        ]
        changed = [key for key, parts, by in given if not np.allclose(by @ parts, parts, rtol=0.0, atol=_same(parts))]
        return list(dict.fromkeys(changed))


def _same(parts: Sequence[float] | np.ndarray) -> float:
    return ROUNDING * float(np.linalg.norm(parts))


def acting(problem: Tables, task: Task | None = None) -> Acting:
    """The loads of a task, or those of the problem that tasks have by default.

    Parameters
    ----------
    problem : Problem
    task : Task, optional
        One of its tasks.
    """
    effector = problem.end_effector
    own = (None,) * 5 if task is None else (task.force, task.moment, task.spring, task.hold, task.gravity)
    force, moment, spring, hold, gravity = own
    given = gravity or problem.gravity
    return Acting(
        force=force or effector.force,
        moment=moment or effector.moment,
        spring=spring or effector.spring,
        hold=hold or effector.hold,
        gravity=given if given is not None and given.acceleration else None,
    )


def acting_in(problem: Tables) -> dict[str, Acting]:
    """The loads of every task."""
    return {task.name: acting(problem, task) for task in problem.task}


def like_first(problem: Tables, task: str) -> bool:
    """Whether a task has the loads of the first one, of which the state without pressures is stored."""
    loads = acting_in(problem)
    return loads[task] == loads[problem.task[0].name]


def has_weight(problem: Tables) -> bool:
    """Whether there is gravity in any task."""
    return any(each.gravity is not None for each in (acting(problem), *acting_in(problem).values()))


_KEYS = ("force", "moment", "spring", "hold")


def faults_of_loads(problem: Tables) -> Iterator[tuple[str, str]]:
    """Loads of tasks on a plate that is not there."""
    for index, task in enumerate(problem.task):
        for key in _KEYS:
            if problem.end_effector.kind == "free" and getattr(task, key) is not None:
                yield (
                    f"task[{index}].{key}",
                    'needs a plate, but the tip is free; use end_effector.kind = "plate" or leave it out',
                )


def words_of_plate(given: EndEffector | Task) -> list[str]:
    """What acts on the plate, in words; of a task what it has of its own."""
    words = [] if given.spring is None else [f"{name} spring {text}" for name, text in _written(given.spring).items()]
    for key in ("force", "moment"):
        if any(getattr(given, key) or ()):
            words.append(f"{key} {', '.join(given.model_dump(mode='json')[key])}")
    if given.hold is not None:
        words += [f"{name} held at {text}" for name, text in given.hold.model_dump(exclude_none=True).items()]
    return words


def _written(spring: Spring) -> dict[str, str]:
    """The springs that are there, as in a file."""
    texts = spring.model_dump()
    return {name: texts[name] for name, value in spring if value > 0}


def words_of_gravity(gravity: Gravity | None) -> str:
    """Gravity in words."""
    if gravity is None or not gravity.acceleration:
        return "none"
    return f"{gravity.model_dump()['acceleration']} along {list(gravity.direction)}"


def words_of_own(task: Task) -> str:
    """The loads that a task has of its own, in words; empty without."""
    words = words_of_plate(task)
    for key, nothing in (("force", task.force), ("moment", task.moment)):
        words += [f"no {key}"] if nothing is not None and not any(nothing) else []
    words += ["no springs"] if task.spring is not None and not _written(task.spring) else []
    words += ["nothing held"] if task.hold is not None and not task.hold.values else []
    filled = task.model_dump(include={"volume"})["volume"] or {}
    words += [f"{name} filled with {volume}" for name, volume in filled.items()]
    words += [] if task.gravity is None else [f"gravity {words_of_gravity(task.gravity)}"]
    return ", ".join(words)
