"""What is found, one type to one result, and the JSON that is made of it: here and nowhere else.

Everything is in mm, N, MPa and rad. The keys in files carry the units; fields of another name say theirs.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import MISSING, dataclass, field, fields
from typing import TYPE_CHECKING, Any, TypeVar

import numpy as np

if TYPE_CHECKING:
    from _typeshed import DataclassInstance

Vector = tuple[float, float, float]
Pressures = Mapping[str, float]

NOWHERE: Vector = (math.nan, math.nan, math.nan)
"""In place of a vector that was not found."""


@dataclass(frozen=True)
class TaskResult:
    """What a design makes of a task.

    Attributes
    ----------
    pressures : {chamber: MPa}
    objective : float
        The task's own, without its weight; smaller is better.
    errors : {name: float}
        How far a target is missed, where the task has one: "position_mm", "orientation_rad".
    translation, rotation : (3,) mm, rad
        Of the tip; the rotation is a rotation vector.
    section_positions, section_rotations : (S, 3) mm, rad
        Of the sections that the objective looks at.
    volumes : {chamber: mm³}
        Of the inflated chambers.
    max_stretch : float
        Largest principal stretch.
    beyond_validity : bool
        Whether that is beyond what the rubber's parameters hold for.
    stable : bool
    """

    pressures: Pressures = field(metadata={"key": "pressure_MPa"})
    objective: float
    errors: Mapping[str, float]
    translation: Vector = field(metadata={"key": "translation_mm"})
    rotation: Vector = field(metadata={"key": "rotation_rad"})
    section_positions: tuple[Vector, ...] = field(metadata={"key": "section_position_mm"})
    section_rotations: tuple[Vector, ...] = field(metadata={"key": "section_rotation_rad"})
    volumes: Mapping[str, float] = field(metadata={"key": "volume_mm3"})
    max_stretch: float
    beyond_validity: bool
    stable: bool


@dataclass(frozen=True)
class HistoryEntry:
    """An accepted design in a line of ``history.jsonl``.

    Attributes
    ----------
    iteration : int
        0 is the start.
    objective : float
        The weighted sum of the tasks'.
    tasks : {task: TaskResult}
    limits : {key: value}
        Worst certified value of every limit over the surfaces; None without such a limit.
    held : bool
        Whether every limit is held.
    elements, dofs : int
    factorisations : int
        Of all tries.
    seconds : {phase: s}
        "geometry", "equilibrium", "gradient", "subproblem" and "total".
    equivalents : float or None
        Time of the whole iteration over that of one tangent assembly with factorisation on the same mesh.
    remeshed : bool
        Whether the design has a new mesh.
    step, ratio, evaluations : float mm, float, int; None for the start
        Longest motion of a control point, actual over predicted gain, evaluations of the limits in the sub-problem.
    optimality : float or None
        The part of the objective's gradient that the limits leave.
    """

    iteration: int
    objective: float
    tasks: Mapping[str, TaskResult] = field(metadata={"of": TaskResult})
    limits: Mapping[str, float | None]
    held: bool
    elements: int
    dofs: int
    factorisations: int
    seconds: Mapping[str, float]
    equivalents: float | None
    remeshed: bool
    step: float | None = field(metadata={"key": "step_mm"}, default=None)
    ratio: float | None = None
    evaluations: int | None = None
    # The first runs have none.
    optimality: float | None = None


@dataclass(frozen=True)
class Motion:
    """What a task achieves, in its usual unit: "mm", "°", or "" for a plain objective."""

    value: float
    unit: str


@dataclass(frozen=True)
class RunResult:
    """What ``result.json`` says: how a run ended and what its last design, which is its best, is like."""

    title: str
    completed: bool
    reason: str
    iterations: int
    best: int
    objective: float
    optimality: float | None
    motions: Mapping[str, Motion] = field(metadata={"of": Motion})
    tasks: Mapping[str, TaskResult] = field(metadata={"of": TaskResult})
    limits: Mapping[str, float | None]
    held: bool
    seconds: Mapping[str, float]
    peak_memory: float | None = field(metadata={"key": "peak_memory_MB"})
    versions: Mapping[str, str | None]


@dataclass(frozen=True)
class SweepStep:
    """One step of a sweep: an equilibrium, or the reason why there is none, all else being empty or not a number.

    Attributes
    ----------
    task : str
        Whose pressures the chambers have that are not given any.
    pressures : {chamber: MPa}
    converged : bool
        Whether there is an equilibrium.
    translation, rotation : (3,) mm, rad
        Of the tip.
    reaction : {component: N or N·mm}
        What the actuator exerts on whatever blocks or springs hold its plate.
    volumes : {chamber: mm³}
    max_stretch, beyond_validity, stable
        As in `TaskResult`.
    reason : str
        A sentence where there is none; else empty.
    """

    task: str
    pressures: Pressures = field(metadata={"key": "pressure_MPa"})
    translation: Vector = field(metadata={"key": "translation_mm"}, default=NOWHERE)
    rotation: Vector = field(metadata={"key": "rotation_rad"}, default=NOWHERE)
    reaction: Mapping[str, float] = field(default_factory=dict)
    volumes: Mapping[str, float] = field(metadata={"key": "volume_mm3"}, default_factory=dict)
    max_stretch: float = math.nan
    beyond_validity: bool = False
    stable: bool = False
    converged: bool = True
    reason: str = ""


Record = TypeVar("Record", bound="DataclassInstance")


def to_json(record: Any) -> dict[str, Any]:
    """A record as files have it: plain values under their keys, null for what is not a finite number."""
    content = {each.metadata.get("key", each.name): _plain(getattr(record, each.name)) for each in fields(record)}
    if isinstance(record, SweepStep):
        if record.converged:
            del content["reason"]
        else:
            content |= dict.fromkeys(content.keys() - {"task", "pressure_MPa", "converged", "reason"})
    return content


def from_json(kind: type[Record], content: Mapping[str, Any]) -> Record:
    """A record from what `to_json` made of it.

    Raises
    ------
    KeyError
        When a key is missing.
    """
    values = {}
    for each in fields(kind):
        key = each.metadata.get("key", each.name)
        inner = each.metadata.get("of")
        if inner is not None:
            values[each.name] = {name: from_json(inner, part) for name, part in content[key].items()}
        elif (each.default is MISSING and each.default_factory is MISSING) or content.get(key) is not None:
            values[each.name] = _tuples(content[key])
    return kind(**values)


def _tuples(value: Any) -> Any:
    return tuple(map(_tuples, value)) if isinstance(value, list) else value


def _plain(value: Any) -> Any:
    if hasattr(value, "__dataclass_fields__"):
        return to_json(value)
    if isinstance(value, Mapping):
        return {str(key): _plain(part) for key, part in value.items()}
    if isinstance(value, np.ndarray | np.generic):
        value = value.tolist()
    if isinstance(value, list | tuple):
        return [_plain(part) for part in value]
    return None if isinstance(value, float) and not math.isfinite(value) else value
