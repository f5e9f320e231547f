"""Explore a body: its equilibrium at any pressures, each solved from the nearest ones that are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field

import numpy as np

from pneumorph.analysis.fields import Fields, nodal_stretch
from pneumorph.analysis.records import SweepStep
from pneumorph.analysis.simulate import Simulation, prepare_simulation, step_of
from pneumorph.geometry import Body
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    Loads,
    NoEquilibrium,
    State,
    Tangent,
    Whole,
    configure,
    extrapolated,
    loads_of,
    mirror_of,
    solve,
    whole_of,
)
from pneumorph.problem import Problem

MOST_FACTORISATIONS = 40
"""Most factorisations of one search, so that it ends in reasonable time also where there is nothing to find."""


class Stopped(Exception):
    """The search for an equilibrium was given up because its answer is not wanted any more."""


@dataclass(frozen=True, eq=False)
class Explored:
    """What was found at some pressures.

    Attributes
    ----------
    step : SweepStep
        The equilibrium, or the reason why none was found.
    fields : Fields or None
        Displacements and stretches under the task of the step, of half the body where only that was solved (see
        `Fields.whole`); None without an equilibrium.
    """

    step: SweepStep
    fields: Fields | None


class Explorer:
    """The equilibria of a body at any pressures, without blocked motions.

    Pressures that are symmetric about a mirror plane are solved on half the body, others on the whole, as by
    `simulate`. Every equilibrium is sought from the nearest known ones on the same mesh, and from rest if it is not
    found from there. Where a body has several equilibria at the same pressures, the result depends on where the search
    starts, as with a real body. No path is followed past a limit pressure: `simulate` does that, and takes longer.

    Parameters
    ----------
    problem, body : the body is one of the problem's.

    Examples
    --------
    >>> import pneumorph as pm
    >>> explorer = pm.open_run("runs/small").best.explorer()
    >>> steps = [explorer.at({"A": pressure}).step for pressure in (0.06, 0.055)]  # MPa
    >>> steps[0].translation[2] > steps[1].translation[2]  # mm
    True
    """

    def __init__(self, problem: Problem, body: Body) -> None:
        self.problem, self.body = problem, body
        self._meshes: dict[str | None, _Meshed] = {}

    def at(self, pressures: Mapping[str, float], stop: Callable[[], bool] = lambda: False) -> Explored:
        """The equilibrium at some pressures.

        Parameters
        ----------
        pressures : {chamber: MPa}
            A chamber that is left out has none.
        stop : called before every factorisation; once it returns True, the search is given up.

        Raises
        ------
        Stopped
            If the search was given up.
        MeshError
            If the body cannot be meshed.
        """
        given = {chamber.name: float(pressures.get(chamber.name, 0.0)) for chamber in self.problem.body.chamber}
        meshed = self._meshed(given)
        simulation, model = meshed.simulation, meshed.simulation.model
        at = configure(model, simulation.mesh.points, loads_of(self.problem, model, given), simulation.blocked)
        found = meshed.search(at, stop)
        if stop():
            raise Stopped
        task = self.problem.task[0].name
        step = step_of(task, given, at, found, meshed.whole)
        if isinstance(found, NoEquilibrium):
            return Explored(step, None)
        mesh = simulation.mesh
        return Explored(step, Fields(mesh, {task: found.u}, {task: nodal_stretch(mesh, found.u)}))

    def _meshed(self, pressures: dict[str, float]) -> _Meshed:
        """The mesh for these pressures, made once for every mirror plane."""
        plane = mirror_of(self.problem, [pressures])
        if plane not in self._meshes:
            simulation = prepare_simulation(self.problem, self.body, {self.problem.task[0].name: pressures}, {})
            model = simulation.model
            whole = None if model.mirror is None else whole_of(model, simulation.mesh)
            self._meshes[plane] = _Meshed(simulation, _Stoppable(model), whole)
        return self._meshes[plane]


class _Stoppable(Tangent):
    """A tangent that makes no more factorisations once `stop` returns True."""

    stop: Callable[[], bool] = staticmethod(lambda: False)

    def refactorise(self, data, origin) -> None:
        if self.stop():
            self.max_factorisations = self.factorisations
        super().refactorise(data, origin)


@dataclass(frozen=True, eq=False)
class _Meshed:
    """A meshed body with the loads and states that are known of it."""

    simulation: Simulation
    tangent: _Stoppable
    whole: Whole | None
    known: list[tuple[Loads, State]] = field(default_factory=list)

    def search(self, at: Configuration, stop: Callable[[], bool]) -> Equilibrium | NoEquilibrium:
        """The equilibrium from the nearest known states, or from rest."""
        self.tangent.stop = stop
        near = self._near(at.loads)
        found = None
        if near:
            found = solve(at, self.tangent, extrapolated(near, at.loads), since=near[-1], most=MOST_FACTORISATIONS)
        if found is None or (isinstance(found, NoEquilibrium) and not stop()):
            found = solve(at, self.tangent, most=MOST_FACTORISATIONS)
        if isinstance(found, Equilibrium):
            self.known.append((at.loads, found.state))
        return found

    def _near(self, loads: Loads) -> list[tuple[Loads, State]]:
        """The nearest known state last; before it, for a secant, the next nearest that is not too close to it."""
        if not self.known:
            return []
        last = min(self.known, key=lambda each: _distance(each[0], loads))
        least = 0.5 * _distance(last[0], loads)
        others = [each for each in self.known if each is not last and _distance(each[0], last[0]) >= least]
        return [*sorted(others, key=lambda each: _distance(each[0], loads))[:1], last]


def _distance(one: Loads, other: Loads) -> float:
    return float(np.linalg.norm(one.pressure - other.pressure))
