"""A body simulated: its equilibria at the tasks' pressures, or along sweeps of pressure, with its plate held or not."""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.analysis.answers import vector
from pneumorph.analysis.pressures import Leg, legs_of
from pneumorph.analysis.records import SweepStep
from pneumorph.errors import ProblemError
from pneumorph.geometry import Body
from pneumorph.mechanics import (
    COMPONENTS,
    Configuration,
    Equilibrium,
    Model,
    NoEquilibrium,
    Tangent,
    Whole,
    configure,
    guided_of,
    loads_of,
    mirror_of,
    model_of,
    sweep,
    whole_of,
)
from pneumorph.mesh import TetMesh, mesh_body
from pneumorph.objective import measure_features
from pneumorph.problem import Problem
from pneumorph.problem.components import COMPONENT_OF, component_of

BLOCKS = {**{name: (component_of(name),) for name in (*COMPONENTS, *COMPONENT_OF)}, "all": COMPONENTS}
"""The plate components that each word holds."""


@dataclass(frozen=True)
class Curve:
    """One sweep.

    Attributes
    ----------
    task : the task whose pressures the chambers have that are not swept.
    swept : names of the chambers that are.
    steps : as far as it was walked.
    """

    task: str
    swept: tuple[str, ...]
    steps: list[SweepStep]

    @property
    def found(self) -> list[SweepStep]:
        """The steps that have an equilibrium."""
        return [step for step in self.steps if step.converged]


@dataclass(frozen=True, eq=False)
class Simulation:
    """A meshed body and the sweeps to be made of it.

    Attributes
    ----------
    pressures : {task: {chamber: MPa}}
        Those of the chambers that are given none.
    legs : the sweeps, each made for every task.
    blocked : (6,) bool
        Plate components that are held.
    """

    problem: Problem
    mesh: TetMesh
    model: Model
    pressures: Mapping[str, Mapping[str, float]]
    legs: list[Leg]
    blocked: np.ndarray

    @property
    def count(self) -> int:
        """Number of all steps."""
        return len(self.pressures) * sum(len(leg.path) for leg in self.legs)

    def walk(self, curves: list[Curve]) -> Iterator[SweepStep]:
        """Find the steps one after the other; each is put in the last of `curves`, to which every sweep adds one."""
        tangent = Tangent(self.model)
        whole = None if self.model.mirror is None else whole_of(self.model, self.mesh)
        for task, own in self.pressures.items():
            for leg in self.legs:
                curves.append(Curve(task, leg.swept, []))
                along = [{**own, **given} for given in leg.path]
                loads = [loads_of(self.problem, self.model, each) for each in along]
                path = [configure(self.model, self.mesh.points, each, self.blocked) for each in loads]
                for pressures, at, found in zip(along, path, sweep(path, tangent), strict=True):
                    step = _step(task, pressures, at, found, whole)
                    curves[-1].steps.append(step)
                    yield step


def prepare_simulation(
    problem: Problem,
    body: Body,
    pressures: Mapping[str, Mapping[str, float]],
    given: Mapping[str, Any],
    block: Iterable[str] = (),
    one_by_one: bool = False,
) -> Simulation:
    """Mesh a body, or half of it where a mirror plane allows that, for sweeps.

    Parameters
    ----------
    problem, body : the body is one of the problem's.
    pressures : {task: {chamber: MPa}}
        Of the chambers that are given none.
    given : {chamber: "60 kPa" or "0:60:5 kPa"}, see `legs_of`.
    block : motions of the plate that are blocked, of `BLOCKS`.
    one_by_one : sweep one chamber after the other.

    Raises
    ------
    ProblemError
        For what is no pressure, chamber or motion.
    MeshError
    """
    legs = legs_of(given, tuple(chamber.name for chamber in problem.body.chamber), one_by_one)
    blocked = _blocked(problem, list(block))
    applied = [{**own, **each} for own in pressures.values() for leg in legs for each in leg.path]
    mesh = mesh_body(body, problem.mesh.size, mirror_of(problem, applied)).mesh
    return Simulation(problem, mesh, model_of(problem, mesh), pressures, legs, blocked)


def _blocked(problem: Problem, names: list[str]) -> np.ndarray:
    """The plate components (6,) that are held."""
    if names and problem.end_effector.kind == "free":
        raise ProblemError('block: a free tip has no plate to hold; take kind = "plate" in [end_effector]')
    for name in names:
        if name not in BLOCKS:
            raise ProblemError(f'block: "{name}" is not known here; take one of {", ".join(BLOCKS)}')
    blocked = {component for name in names for component in BLOCKS[name]}
    return np.array([component in blocked for component in COMPONENTS]) | guided_of(problem)


def _step(
    task: str, pressures: dict[str, float], at: Configuration, found: Equilibrium | NoEquilibrium, whole: Whole | None
) -> SweepStep:
    if isinstance(found, NoEquilibrium):
        return SweepStep(task, pressures, converged=False, reason=found.reason)
    motion = measure_features(at.model, at.X, found.state)
    return SweepStep(
        task=task,
        pressures=pressures,
        translation=vector(motion.translation),
        rotation=vector(motion.rotation),
        reaction=_reaction(at, found),
        volumes=found.volumes,
        max_stretch=found.max_stretch,
        beyond_validity=at.model.rubber.beyond(found.max_stretch),
        stable=found.stable and (whole is None or whole.negative_pivots(at, found.state) == 0),
    )


def _reaction(at: Configuration, found: Equilibrium) -> dict[str, float]:
    """What the actuator exerts on whatever blocks or springs hold its plate, N and N·mm."""
    spring = at.model.copies * np.asarray(at.loads.spring)
    exerted = found.reaction + spring * found.plate
    return {
        name: float(exerted[index]) for index, name in enumerate(COMPONENTS) if at.blocked[index] or spring[index] > 0.0
    }
