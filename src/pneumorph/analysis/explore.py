"""Explore a body: its equilibrium at any pressures, each solved from the nearest ones that are known."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.analysis.analyse import refuse_friction
from pneumorph.analysis.bodies import mesh_of
from pneumorph.analysis.steps import step_of
from pneumorph.errors import ProblemError
from pneumorph.geometry import Body
from pneumorph.mechanics import (
    Configuration,
    Equilibrium,
    Loads,
    Model,
    NoEquilibrium,
    Skin,
    State,
    Tangent,
    Whole,
    configure,
    enclosed_of,
    guided_of,
    loads_of,
    mirrors_of,
    model_of,
    part_of,
    rest,
    restored,
    secant_start,
    settled,
    solve,
    whole_of,
)
from pneumorph.mesh import TetMesh
from pneumorph.problem import Problem
from pneumorph.problem.acting import Acting, acting
from pneumorph.results import Fields, SweepStep, TaskResult, nodal_stretch
from pneumorph.symmetry.part import Part, turns_of

MOST_FACTORISATIONS = 40
"""Most factorisations of one search, so that it ends in reasonable time also where there is nothing to find."""

FEW_FACTORISATIONS = 10
"""The same where it is known that there may be nothing to find, and a state is known beside it."""

STRIDE = 6
"""From rest, pressures are raised in so many steps, each predicted from those before it: for soft bodies at their full
pressures that takes less than half of what Newton's method takes from rest."""


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
        Displacements and stretches under the task of the step, of part of the body where only that was solved (see
        `Fields.whole`); None without an equilibrium.
    """

    step: SweepStep
    fields: Fields | None


class Explorer:
    """The equilibria of a body at any pressures, under the other loads of its first task.

    Pressures that are symmetric are solved on part of the body, others on the whole, as by `simulate`. Every
    equilibrium is sought from the nearest known ones on the same mesh, and from rest if it is not found from there.
    Where a body has several equilibria at the same pressures, the result depends on where the search starts, as with a
    real body. No path is followed past a limit pressure: `simulate` does that, and takes longer.

    Parameters
    ----------
    problem, body : the body is one of the problem's.
    stored : Fields, optional
        What a run has stored of this design. Its mesh is then that of the explorer, and its equilibria are known from
        the beginning.
    results : {task: TaskResult}, optional
        The results that belong to `stored`.
    unlike : Acting, optional
        Where other loads than those of the first task will act: loads as large as these, and like none of them, by
        which it is chosen what is solved, and which states count as near.

    Examples
    --------
    >>> import pneumorph as pm
    >>> explorer = pm.open_run("runs/small").best.explorer()
    >>> steps = [explorer.at({"A": pressure}).step for pressure in (0.06, 0.055)]  # MPa
    >>> steps[0].translation[2] > steps[1].translation[2]  # mm
    True
    """

    def __init__(
        self,
        problem: Problem,
        body: Body,
        stored: Fields | None = None,
        results: Mapping[str, TaskResult] | None = None,
        unlike: Acting | None = None,
    ) -> None:
        refuse_friction(problem)
        if enclosed_of(problem, problem.task[0].volumes) is not None:
            raise ProblemError("explore: pressures of sealed and filled chambers follow; use simulate --volume")
        self.problem, self.body = problem, body
        self._stored, self._results = stored, results or {}
        self._under, self._unlike = acting(problem, problem.task[0]), unlike
        self._meshes: dict[Part, _Meshed] = {}

    @property
    def under(self) -> Acting:
        """The loads of the first task."""
        return self._under

    def with_loads_like(self, unlike: Acting) -> Explorer:
        """One of the same body that finds states under other loads too; see the parameter `unlike`."""
        return Explorer(self.problem, self.body, self._stored, self._results, unlike)

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
        at = self._at(meshed, given)
        answer = meshed.search(at, self._strides(meshed, given), stop)
        if stop():
            raise Stopped
        task = self.problem.task[0].name
        step = step_of(task, given, at, answer, meshed.skin, meshed.whole)
        if isinstance(answer, NoEquilibrium):
            return Explored(step, None)
        return Explored(step, Fields(meshed.mesh, {task: answer.u}, {task: nodal_stretch(meshed.mesh, answer.u)}))

    def solved(
        self, pressures: Mapping[str, float], like: Mapping[str, float], near: bool = False, under: Acting | None = None
    ) -> tuple[Configuration, Equilibrium | NoEquilibrium, Tangent]:
        """The equilibrium at pressures, and the tangent that was factorised near it.

        Parameters
        ----------
        pressures : {chamber: MPa}
        like : {chamber: MPa}
            Pressures by which it is chosen what is solved: all of the body for those that are not symmetric.
        near : bool
            Whether it is given up soon where it is not found from the nearest known states.
        under : Acting, optional
            Weight and loads of the plate in place of those of the first task.

        Raises
        ------
        MeshError
            If the body cannot be meshed.
        """
        meshed = self._meshed(dict(like))
        at = self._at(meshed, pressures, under)
        answer = meshed.search(at, None if near else self._strides(meshed, pressures, under), lambda: False)
        return (settled(at, answer) if isinstance(answer, Equilibrium) else at), answer, meshed.tangent

    def whole(self, like: Mapping[str, float]) -> Whole | None:
        """The whole body, where `solved` with the same `like` solves part of it; else None.

        Parameters
        ----------
        like : {chamber: MPa}
        """
        return self._meshed(dict(like)).whole

    def skin(self, like: Mapping[str, float]) -> Skin:
        """The surface of the body, on the mesh on which `solved` solves.

        Parameters
        ----------
        like : {chamber: MPa}
            As for `solved`.
        """
        return self._meshed(dict(like)).skin

    def mesh(self, like: Mapping[str, float]) -> TetMesh:
        """The mesh on which `solved` solves, of the body or of its part.

        Parameters
        ----------
        like : {chamber: MPa}
            As for `solved`.
        """
        return self._meshed(dict(like)).mesh

    def known_pressures(self) -> list[dict[str, float]]:
        """The pressures (MPa) of the tasks with stored results, at which equilibria are known from the beginning."""
        return [dict(result.pressures) for result in self._results.values()]

    def _at(self, meshed: _Meshed, pressures: Mapping[str, float], under: Acting | None = None) -> Configuration:
        # Where obstacles are is a matter of the task; the first one's results are in its name.
        first, under = self.problem.task[0], under or self._under
        loads = loads_of(self.problem, meshed.model, dict(pressures), first.poses, under=under)
        return configure(meshed.model, meshed.mesh.points, loads, guided_of(self.problem, under))

    def _strides(
        self, meshed: _Meshed, pressures: Mapping[str, float], under: Acting | None = None
    ) -> list[Configuration]:
        """The way from no pressure to these, without its end."""
        parts = [number / STRIDE for number in range(STRIDE)] if any(pressures.values()) else []
        return [self._at(meshed, {name: part * value for name, value in pressures.items()}, under) for part in parts]

    def _meshed(self, pressures: dict[str, float]) -> _Meshed:
        """The mesh for these pressures, made once for the part of the body that they ask for."""
        under = None if self._unlike is None else [self._unlike]
        part = part_of(self.problem, [pressures], under)
        if self._stored is not None:
            planes, turns = mirrors_of(self.problem, [pressures], under), turns_of(part)
            part = tuple(
                cut
                for cut in self._stored.mesh.part
                if cut in planes or (turns_of((cut,)) > 1 and turns % turns_of((cut,)) == 0)
            )
        if part not in self._meshes:
            stored = None if self._stored is None else self._stored.unfolded(part)
            mesh = mesh_of(self.problem, self.body, part).mesh if stored is None else stored.mesh
            model = model_of(self.problem, mesh)
            whole = whole_of(model, mesh) if model.part else None
            known = [] if stored is None else self._known(model, stored)
            size = None if self._unlike is None else loads_of(self.problem, model, pressures, under=self._unlike)
            self._meshes[part] = _Meshed(mesh, model, _Stoppable(model), Skin(mesh), whole, known, size)
        return self._meshes[part]

    def _known(self, model: Model, stored: Fields) -> list[tuple[Configuration, State]]:
        """The equilibria that are stored: of every task, and without pressure."""
        X, still = stored.mesh.points, np.zeros(6)
        known, tasks = [], {task.name: task for task in self.problem.task}
        for task, result in self._results.items():
            plate = np.array([*result.translation, *result.rotation]) if model.plate else still
            under = acting(self.problem, tasks[task])
            loads = loads_of(self.problem, model, dict(result.pressures), tasks[task].poses, under=under)
            state = restored(model, X, stored.u[task], plate, objects_of(model, loads, result))
            known.append((configure(model, X, loads, guided_of(self.problem, under)), state))
        if not self._under.moves:
            nothing = loads_of(self.problem, model, {}, under=self._under)
            known.append((configure(model, X, nothing, guided_of(self.problem, self._under)), rest(model)))
        return known


def objects_of(model: Model, loads: Loads, result: TaskResult) -> np.ndarray:
    """The unknowns (J, 6) of free obstacles at a result."""
    if model.contact is None or not model.contact.free:
        return np.zeros((0, 6))
    poses = [[*result.pose_translations[name], *result.pose_rotations[name]] for name in model.contact.free]
    return np.array(poses) - np.asarray(loads.shift)[model.contact.rows]


class _Stoppable(Tangent):
    """A tangent that makes no more factorisations once `stop` returns True."""

    stop: Callable[[], bool] = staticmethod(lambda: False)

    def refactorise(self, data, origin) -> None:
        if self.stop():
            self.max_factorisations = self.factorisations
        super().refactorise(data, origin)


@dataclass(frozen=True, eq=False)
class _Meshed:
    """A meshed body with the loads and states that are known of it, and loads that count as equally large, if others
    than pressures vary."""

    mesh: TetMesh
    model: Model
    tangent: _Stoppable
    skin: Skin
    whole: Whole | None
    known: list[tuple[Configuration, State]]
    size: Loads | None

    def search(
        self, at: Configuration, way: Sequence[Configuration] | None, stop: Callable[[], bool]
    ) -> Equilibrium | NoEquilibrium:
        """The equilibrium from the nearest known states, or else along a way from rest, if there is one."""
        self.tangent.stop = stop
        if near := self._near(at.loads):
            answer = self._from(near, at, MOST_FACTORISATIONS if way is not None else FEW_FACTORISATIONS)
            if isinstance(answer, Equilibrium) or way is None or stop():
                return answer
        # From rest, whatever is known: from there nothing was found.
        walked: list[tuple[Configuration, State]] = []
        for step in way or ():
            answer = self._from(walked[-2:], step)
            if isinstance(answer, NoEquilibrium) or stop():
                return answer
            walked.append((step, answer.state))
        return self._from(walked[-2:], at)

    def _from(
        self, near: list[tuple[Configuration, State]], at: Configuration, most: int = MOST_FACTORISATIONS
    ) -> Equilibrium | NoEquilibrium:
        """The equilibrium from one or two known states, from rest without any."""
        start, since = secant_start(near, at), near[-1] if near else None
        answer = solve(at, self.tangent, start, since=since, most=most)
        if isinstance(answer, Equilibrium):
            self.known.append((at, answer.state))
        return answer

    def _near(self, loads: Loads) -> list[tuple[Configuration, State]]:
        """The nearest known state last; before it, for a secant, the next nearest that is not too close to it."""
        if not self.known:
            return []
        last = min(self.known, key=lambda each: self._distance(each[0].loads, loads))
        least = 0.5 * self._distance(last[0].loads, loads)
        others = [
            each for each in self.known if each is not last and self._distance(each[0].loads, last[0].loads) >= least
        ]
        return [*sorted(others, key=lambda each: self._distance(each[0].loads, loads))[:1], last]

    def _distance(self, one: Loads, other: Loads) -> float:
        if self.size is None:
            return float(np.linalg.norm(one.pressure - other.pressure))
        parts = []
        for name in ("pressure", "wrench", "acceleration"):
            size = float(np.abs(getattr(self.size, name)).max(initial=0.0))
            parts.append((getattr(one, name) - getattr(other, name)) / (size or 1.0))
        return float(np.linalg.norm(np.concatenate(parts)))
