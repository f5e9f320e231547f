"""The target file: what a robot is to do, of which rubber, in which space, and no body.

    title = "Finger"
    material = { name = "Dragon Skin 30" }      # or a list of them, to choose from
    space = { length = "80 mm", radius = "12 mm" }
    pressure = { max = "40 kPa" }
    [[task]]
    name = "close"
    objective = { motion = "bending_y" }

The tables end_effector, gravity, task and limits are those of a problem file. A task has no pressures: they are found.
"""

from __future__ import annotations

import shlex
from pathlib import Path
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field, Strict, ValidationError, field_validator, model_validator

from pneumorph import units
from pneumorph.errors import ProblemError
from pneumorph.problem.gas import ATMOSPHERE, BELOW_VACUUM
from pneumorph.problem.material import Material
from pneumorph.problem.models import MOST_TASKS, EndEffector, Gravity, Limits, Pressure, Task
from pneumorph.problem.reading import read_toml
from pneumorph.problem.reasons import faults_of, refusal
from pneumorph.problem.table import Example, InvalidKey, Quantity, Table
from pneumorph.symmetry.operations import MIRRORS

PositiveLength = Annotated[float, Quantity(units.LENGTH, "positive")]
GaugePressure = Annotated[float, Quantity(units.PRESSURE)]

Wished = Literal["mass", "air", "pressure", "stretch", "-force"]
"""What is to be small; with a minus, large."""

MOST_RUBBERS = 10


class Space(Table):
    """The space that the robot may fill at rest: a cylinder or a box about z, from its base at z = 0 to its tip."""

    length: PositiveLength
    """From base to tip."""
    radius: PositiveLength | None = None
    """Of a cylinder."""
    width: PositiveLength | None = None
    """Of a box, along x; its middle is at x = 0."""
    depth: PositiveLength | None = None
    """Of a box, along y; its middle is at y = 0."""

    @model_validator(mode="after")
    def _one_shape(self) -> Space:
        if self.radius is not None:
            for key in ("width", "depth"):
                if getattr(self, key) is not None:
                    raise InvalidKey(key, "is of a box, but radius of a cylinder; leave one of them out")
        elif self.width is None and self.depth is None:
            raise InvalidKey("radius", 'is missing; give it for a cylinder, or width and depth for a box, e.g. "20 mm"')
        for key in ("width", "depth"):
            if self.radius is None and getattr(self, key) is None:
                raise InvalidKey(key, 'is missing; a box has width along x and depth along y, e.g. "20 mm"')
        return self

    @property
    def sides(self) -> np.ndarray | None:
        """Half the width and half the depth (2,) of a box, mm; None of a cylinder."""
        return None if self.width is None or self.depth is None else np.array([self.width, self.depth]) / 2.0

    @property
    def round(self) -> float:
        """Radius of the largest cylinder about z in it, mm."""
        return float(self.sides.min()) if self.sides is not None else float(self.radius or 0.0)

    @property
    def reach(self) -> float:
        """The farthest that anything in it is from z, mm."""
        return float(np.hypot(*self.sides)) if self.sides is not None else float(self.radius or 0.0)

    @property
    def area(self) -> float:
        """Of its cross-section, mm²."""
        return float(4.0 * self.sides.prod()) if self.sides is not None else float(np.pi * (self.radius or 0.0) ** 2)

    @property
    def envelope(self) -> dict[str, Any]:
        """The table limits.envelope that keeps designs in it."""
        if self.sides is None:
            return {"radius": f"{self.radius:g} mm"}
        x, y = self.sides
        return {
            "box": [[f"{-x:g} mm", f"{-y:g} mm", "0 mm"], [f"{x:g} mm", f"{y:g} mm", f"{self.length:g} mm"]],
        }


class PressureRange(Table):
    """The gauge pressures that chambers may have, in MPa."""

    min: GaugePressure = 0.0
    """Least; negative is vacuum."""
    max: Annotated[GaugePressure, Example('e.g. max = "60 kPa"')]
    """Largest."""

    @model_validator(mode="after")
    def _in_order(self) -> PressureRange:
        if self.max <= self.min:
            raise InvalidKey("max", "is not above min; give the largest pressure that your supply has")
        if self.min < -ATMOSPHERE:
            raise InvalidKey("min", BELOW_VACUUM)
        return self


class Wish(Task):
    """A task without pressures, which belong to the chambers that are still to be found."""

    pressure: dict[str, Pressure] = Field(default_factory=dict)
    """Stays empty."""

    @model_validator(mode="after")
    def _only_what_is_known(self) -> Wish:
        for key in ("pressure", "pressures_of", "volume", "move", "turn"):
            if getattr(self, key):
                raise InvalidKey(
                    key, "is for a problem with a body; leave it out: a target has no chambers or obstacles"
                )
        return self

    @property
    def towards(self) -> np.ndarray | None:
        """The direction (2,) across z towards which the tip goes; None if it does not go sideways or does not say."""
        asked = {motion: each.value for motion, each in self.objective.asked_motions.items()}
        sideways = np.array([asked.get("bending_y", 0.0), -asked.get("bending_x", 0.0)])
        if not np.any(sideways):
            sideways = np.array([asked.get("shift_x", 0.0), asked.get("shift_y", 0.0)])
        if not asked and (about := self.objective.bends(1.0)) is not None:
            sideways = np.array([about[1], -about[0]])
        return sideways / np.linalg.norm(sideways) if np.any(sideways) else None

    @property
    def motions(self) -> frozenset[str]:
        """Motions of the tip that must not be zero; none if the objective is about others too."""
        return frozenset(self.objective.asked_motions)


class Target(Table):
    """What a robot is to do."""

    title: Annotated[str, Field(max_length=300)] = ""
    """A title for messages and pictures."""
    material: Annotated[
        tuple[Material, ...],
        Field(min_length=1, max_length=MOST_RUBBERS),
        Example('[material] with name = "Dragon Skin 30"'),
    ]
    """The rubber, or a list of those to choose from."""
    space: Annotated[Space, Example('space = { length = "80 mm", radius = "12 mm" }')]
    """The space that the robot may fill at rest."""
    pressure: Annotated[PressureRange, Example('pressure = { max = "60 kPa" }')]
    """The pressures that chambers may have."""
    reinforcement: Annotated[bool, Strict()] = False
    """Whether cloth and thread may be used beside rubber."""
    made: Literal["one piece", "layers"] = "layers"
    """Whether the body is cast in one piece, or may be of layers that are cast one by one and bonded."""
    end_effector: EndEffector = EndEffector()
    """What the tip carries."""
    gravity: Gravity | None = None
    """Weight of the body; without this table gravity is off."""
    task: Annotated[tuple[Wish, ...], Example("a table [[task]]")] = Field(min_length=1, max_length=MOST_TASKS)
    """What the robot is to do, each a table [[task]]."""
    limits: Limits = Limits()
    """Limits that every design satisfies; the envelope is by default the space."""
    minimize: Annotated[tuple[Wished, ...], Field(max_length=5)] = ()
    """What bodies that do their tasks are compared by: "mass", "air", "pressure", "stretch", "-force" (the most)."""

    @field_validator("minimize")
    @classmethod
    def _each_once(cls, wishes: tuple[str, ...]) -> tuple[str, ...]:
        if len(set(wishes)) < len(wishes):
            raise ValueError("names the same twice; name each once")
        return wishes

    @field_validator("task")
    @classmethod
    def _different_names(cls, tasks: tuple[Wish, ...]) -> tuple[Wish, ...]:
        names = [task.name for task in tasks]
        for index, name in enumerate(names):
            if name in names[:index]:
                raise ValueError(f'the name "{name}" is used twice; give each task a different one')
        return tasks

    @field_validator("material", mode="before")
    @classmethod
    def _one_or_several(cls, given: Any) -> Any:
        return [given] if isinstance(given, dict) else given

    @property
    def directions(self) -> tuple[np.ndarray, ...]:
        """The directions (2,) across z towards which tasks bend, those of the same line once."""
        found: list[np.ndarray] = []
        for task in self.task:
            towards = task.towards
            if towards is not None and all(np.abs(towards - each).max() > 1e-6 for each in found):
                found.append(towards)
        return tuple(found)

    def mirrored(self, plane: str) -> bool:
        """Whether bodies may be their own images in a plane: tasks are, or go several ways across it.

        Loads and pressures may bend such a body, but its walls on both sides stay alike, of which one may have to give
        way.
        """
        polar = np.array(MIRRORS[plane])
        axial = np.prod(polar) * polar
        broken = [task.towards for task in self.task if not task.objective.keeps(polar.tolist(), axial.tolist())]
        ways = [each for each in broken if each is not None]
        return not ways or any(np.abs(each - ways[0]).max() > 1e-6 for each in ways)

    @property
    def motions(self) -> frozenset[str]:
        """Motions of the tip that some task asks for."""
        return frozenset().union(*(task.motions for task in self.task))

    @property
    def said(self) -> bool:
        """Whether every task says which motions it asks for."""
        return all(task.motions for task in self.task)


def load_target(path: str | Path) -> Target:
    """Read a target file.

    Raises
    ------
    ProblemError
        One line: the file or the key in it, what is wrong, and how to fix it.
    """
    path = Path(path)
    data = read_toml(path, str(path), "the target file")
    for key in ("body", "design", "region", "membrane", "fibres"):
        if key in data:
            raise ProblemError(
                f"{key}: is for a problem with a body, and a target has none; leave it out, or design that body: "
                f"pneumorph design {shlex.quote(str(path))}"
            )
    try:
        return Target.model_validate(data)
    except ValidationError as error:
        raise refusal(faults_of(error)) from None
