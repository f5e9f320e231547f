"""Where a further chamber would help: what a small void at pressure does to the objective, everywhere in the rubber."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
from scipy.spatial import KDTree

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.analysis.workspace import axes_of
from pneumorph.doing import doing
from pneumorph.errors import ProblemError
from pneumorph.mesh.tets import is_cut
from pneumorph.problem import Problem, with_further_chamber
from pneumorph.sensitivity import gradient, tip_motion_adjoints
from pneumorph.sensitivity.insertion import insertion_slopes
from pneumorph.symmetry.part import Part, images_of

APART = 2.0
"""Places that are told are farther apart than this times the room around the better one."""

ROUNDER = 1.05
"""Wall around, and radius of, further chambers over the least ones: they have to be found within limits."""

SMALLER, TRIES = 0.9, 6
"""Factor on the radius of a further chamber for which the start has no room, and how many radii are tried."""


@dataclass(frozen=True, eq=False)
class Insertions:
    """What a small void does at each of E places in the rubber, to first order in its volume.

    Attributes
    ----------
    places : (E, 3) mm
        In the body at rest, or the part of it that is solved.
    room : (E,) mm
        Distance from the surfaces.
    gain : (E,)
        By how much the weighted sum of the objectives falls per mm³ of the void.
    pressures : {task: (E,)}
        The pressure in the void at which the task gains most, MPa.
    motions : {task: (6, E)}
        How the tip then moves: translation in mm and rotation vector in rad, per mm³.
    part : Part
        Which part of the body that is.
    """

    places: np.ndarray
    room: np.ndarray
    gain: np.ndarray
    pressures: Mapping[str, np.ndarray]
    motions: Mapping[str, np.ndarray]
    part: Part = ()

    def pressures_at(self, place: np.ndarray) -> dict[str, float]:
        """The pressures (MPa) of the tasks in a void anywhere in the body, those of the nearest of the places.

        Parameters
        ----------
        place : (3,) mm
        """
        distance, near = KDTree(self.places).query(images_of(self.part) @ place)
        nearest = np.asarray(near)[np.argmin(distance)]
        return {name: float(each[nearest]) for name, each in self.pressures.items()}


@dataclass(frozen=True)
class Insertion:
    """A sphere at one place, as large as the wall around it allows.

    Attributes
    ----------
    place : (3,) mm
    radius : float, mm
    pressures : {task: MPa}
    motions : {task: (6,)}
        How much farther the tip goes, in mm and rad: per volume, times the volume of the sphere.
    gain : float
        Of the weighted sum of the objectives, in the same way.
    found : Insertions
        Where it was found, which knows of its images: those that loads and pressures tell from it have other pressures.
    """

    place: tuple[float, float, float]
    radius: float
    pressures: Mapping[str, float]
    motions: Mapping[str, tuple[float, ...]]
    gain: float
    found: Insertions = field(repr=False, compare=False)


@doing("finding where a further chamber would help")
def find_insertions(problem: Problem, disc: Discretisation, analysis: Analysis) -> Insertions:
    """What voids do, each at the least or the largest pressure of the problem, whichever is better for the task.

    Parameters
    ----------
    problem : with its tasks.
    disc, analysis : a body of it, or a part of it, with its states.

    Raises
    ------
    ProblemError
        If the tasks span a workspace, whose size is no sum over them.
    """
    if axes_of(disc.objectives):
        raise ProblemError("objective.kind: a workspace is no sum over tasks; of it places are not found")
    ends = pressure_range(problem)
    gain, pressures, motions = np.zeros(disc.model.elements), {}, {}
    for task in problem.task:
        at, tangent = analysis.configurations[task.name], disc.tangents[task.name]
        equilibrium = analysis.equilibria[task.name]
        adjoint = gradient(at, tangent, equilibrium, disc.objectives[task.name]).adjoint
        _, moving = tip_motion_adjoints(at, tangent, equilibrium.state)
        slopes = insertion_slopes(at, equilibrium.state, [adjoint, *map(disc.model.state, moving)], ends)
        best = np.argmin(slopes[0], axis=0)
        pressures[task.name] = np.array(ends)[best]
        chosen = np.take_along_axis(slopes, best[None, None], axis=1)[:, 0]
        gain -= task.weight * chosen[0]
        motions[task.name] = chosen[1:]
    mesh = disc.morph.mesh.at(analysis.X)
    places = analysis.X[mesh.tets[:, :4]].mean(axis=1)
    skin = np.unique(np.concatenate([nodes.ravel() for name, nodes in mesh.faces.items() if not is_cut(name)]))
    room = KDTree(analysis.X[skin]).query(places)[0]
    return Insertions(places, room, gain, pressures, motions, disc.model.part)


def pressure_range(problem: Problem) -> tuple[float, float]:
    """The least and the largest pressure (MPa) of all chambers in all tasks; one of them may be zero."""
    given = [each for task in problem.task for each in task.pressure.values()]
    return min(0.0, *(each.min for each in given)), max(0.0, *(each.max for each in given))


def best_insertions(found: Insertions, wall: float, least: float, count: int) -> Iterator[Insertion]:
    """The places where the largest sphere that leaves a wall would help most, the best first, apart from each other.

    Parameters
    ----------
    found : by `find_insertions`.
    wall : between the sphere and the surfaces, mm.
    least : radius below which there is no sphere, mm.
    count : how many places.
    """
    radius = found.room - wall
    worth = np.where(radius >= least, found.gain * 4.0 / 3.0 * np.pi * np.maximum(radius, 0.0) ** 3, -np.inf)
    for _ in range(count):
        best = int(np.argmax(worth))
        if not worth[best] > 0.0:
            return
        volume = 4.0 / 3.0 * np.pi * radius[best] ** 3
        x, y, z = found.places[best].tolist()
        yield Insertion(
            (x, y, z),
            float(radius[best]),
            {name: float(each[best]) for name, each in found.pressures.items()},
            {name: tuple((volume * each[:, best]).tolist()) for name, each in found.motions.items()},
            float(worth[best]),
            found,
        )
        near = np.linalg.norm(found.places - found.places[best], axis=1) < APART * found.room[best]
        worth[near] = -np.inf


def further_chambers(problem: Problem, found: Insertions, count: int) -> list[Insertion]:
    """The best places for a chamber that the limits of a problem allow, the best first; at most `count`."""
    # A sphere's principal curvatures are both one over its radius.
    least = 0.0 if problem.solid is not None else ROUNDER / problem.limits.curvature**0.5
    return list(best_insertions(found, ROUNDER * problem.limits.wall, least, count))


def with_further(problem: Problem, places: Sequence[Insertion]) -> tuple[Problem, Insertion]:
    """The problem with a chamber in the first of some places where its start has room for one, and that place.

    Raises
    ------
    ProblemError
        If none has.
    """
    refused: ProblemError | None = None
    bounds = pressure_range(problem)
    for each in places:
        radius = each.radius
        for _ in range(TRIES):
            try:
                return with_further_chamber(problem, each.place, radius, each.found.pressures_at, bounds), each
            except ProblemError as error:
                refused, radius = error, SMALLER * radius
    assert refused is not None, "of no place nothing is asked"
    raise refused
