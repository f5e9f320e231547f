"""Mechanics of part of a body: when half or a quarter is enough, and the whole body that any part represents.

Such a model has symmetric motions only. Stability against all other motions follows from the tangent of the whole body,
factorised once at the mirrored state.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from math import nan

import numpy as np

from pneumorph.mechanics.assembly.contact import Contact
from pneumorph.mechanics.assembly.kinematics import State
from pneumorph.mechanics.assembly.model import Model, build_model
from pneumorph.mechanics.assembly.obstacles import surface_of
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.assembly.terms import Weight
from pneumorph.mesh import TetMesh, Unfolded, unfold
from pneumorph.problem import Problem, regions, reinforcement
from pneumorph.problem.symmetry import MIRRORS, operations

Pressures = Mapping[str, float]


def mirrors_of(problem: Problem, pressures: Iterable[Pressures] | None = None) -> tuple[str, ...]:
    """The planes, of "xz" and "yz" in this order, about which a problem is symmetric in shape, loads and objectives.

    There are none where anything may touch: a part of a body does not see its other parts.

    Parameters
    ----------
    problem : Problem
    pressures : iterable of {chamber: MPa}, optional
        All that will be applied; by default those of the tasks, where free ones may become unequal in two chambers.
    """
    if problem.contact is not None or problem.obstacle:
        return ()
    applied = applied_pressures(problem, pressures)
    return tuple(plane for plane in ("xz", "yz") if _is_symmetric(problem, plane, applied))


def applied_pressures(problem: Problem, pressures: Iterable[Pressures] | None) -> list[Pressures]:
    """The given pressures, or those of the tasks, where a free one is like no other."""
    if pressures is not None:
        return list(pressures)
    return [
        {name: nan if pressure.free else pressure.start for name, pressure in task.pressure.items()}
        for task in problem.task
    ]


def _is_symmetric(problem: Problem, plane: str, applied: list[Pressures]) -> bool:
    mirror = np.array(MIRRORS[plane])
    # Rotations and moments are axial vectors: a mirror reverses the components that it keeps of other vectors.
    axial = np.prod(mirror) * mirror
    effector, gravity = problem.end_effector, problem.gravity
    weight = np.zeros(3) if gravity is None else gravity.acceleration * np.array(gravity.direction)
    return (
        any(np.allclose(operation, np.diag(mirror)) for operation in operations(problem.body.symmetry))
        and regions.keeps(problem, plane)
        and reinforcement.keeps(problem, plane)
        and not np.any(weight[mirror < 0])
        and not np.any(np.array(effector.force)[mirror < 0])
        and not np.any(np.array(effector.moment)[axial < 0])
        and all(task.objective.keeps(mirror.tolist(), axial.tolist()) for task in problem.task)
        and all(
            pressure.get(one, 0.0) == pressure.get(other, 0.0)
            for one, other in _pairs(problem, mirror)
            for pressure in applied
        )
    )


def _pairs(problem: Problem, mirror: np.ndarray) -> Iterator[tuple[str, str]]:
    """Chambers off the plane, each with its mirror image."""
    for one in problem.body.chamber:
        image = mirror[:2] * one.center
        if np.allclose(image, one.center):
            continue
        for other in problem.body.chamber:
            if np.allclose([*image, *one.span], [*other.center, *other.span]):
                yield one.name, other.name


@dataclass(frozen=True, eq=False)
class Whole:
    """The whole body that the model of a part represents."""

    part: Model
    image: Unfolded
    model: Model
    tangent: Tangent

    def configuration(self, at: Configuration) -> Configuration:
        """The whole body at the nodes of the part, under the full loads."""
        pressure = dict(zip(self.part.chambers, at.loads.pressure, strict=True))
        loads = at.loads._replace(
            pressure=np.array([pressure[name] for name in self.model.chambers]),
            spring=self.part.copies * at.loads.spring,
            wrench=self.part.copies * at.loads.wrench,
        )
        return Configuration(self.model, self.image.vectors(at.X), loads, at.blocked)

    def state(self, part: State) -> State:
        """The symmetric state of the whole body, from the state of its part."""
        own = np.array(part.u)
        self.part.tip.tied.led(own)
        u = self.image.vectors(own)
        if not self.part.mixed:
            return State(u, part.plate)
        count = len(self.part.rubbers)
        hydrostatic = part.hydrostatic.reshape(count, -1)[:, self.part.source[self.image.source]]
        return State(u, part.plate, hydrostatic.ravel())

    def negative_pivots(self, at: Configuration, state: State) -> int:
        """Negative pivots of the whole body at a state of the part; 0 means stable against all motions."""
        self.tangent.factorise(self.configuration(at), self.state(state))
        return self.tangent.negative_pivots


def whole_of(part: Model, mesh: TetMesh) -> Whole:
    """The whole body of the model of a part and its mesh."""
    image = unfold(mesh)
    rubber = part.rubber if len(part.rubbers) == 1 else part.rubbers
    weight = any(isinstance(term.energy, Weight) for term in part.terms)
    contact = None
    if part.contact is not None:
        surface = surface_of(image.mesh)
        own = None if part.contact.own is None else part.contact.own.of_whole(surface, image.mesh.points)
        contact = Contact(surface, {}, {}, own)
    body = build_model(
        image.mesh,
        rubber,
        part.plate,
        mixed=part.mixed,
        weight=weight,
        contact=contact,
        reinforcements=part.reinforcements,
    )
    return Whole(part, image, body, Tangent(body))
