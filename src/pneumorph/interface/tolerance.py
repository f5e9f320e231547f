"""How far a design's motions, forces and volumes scatter when it is made, and which tolerance is to blame."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.analysis.near import Solved, analyse_near
from pneumorph.analysis.reliability import Ballooning, ballooning_of
from pneumorph.analysis.scatter import OneDeviation, one_deviation, scatter_of, with_moduli
from pneumorph.analysis.second_order import second_order
from pneumorph.analysis.thickening import thickenings
from pneumorph.analysis.tolerances import Tolerances, of_sources
from pneumorph.doing import doing
from pneumorph.errors import ProblemError
from pneumorph.geometry import Body
from pneumorph.interface.drawing import saved
from pneumorph.mechanics import Configuration, part_of
from pneumorph.mesh import TetMesh
from pneumorph.output.thickening import thickening_figure
from pneumorph.problem import Problem, Task
from pneumorph.problem.components import MOTIONS
from pneumorph.problem.deviations import read_deviations
from pneumorph.problem.materials import materials
from pneumorph.problem.objectives.words import motion_word
from pneumorph.problem.quantities import VOLUME_OF, Shown, shown
from pneumorph.problem.sources import doubt, range_of
from pneumorph.results import Fields, Scatter, TaskResult, to_json

LEAST = 0.005
"""Part of the variance below which causes are told together."""

NOT_LINEAR = 0.25
"""Difference from the first-order figure, relative to it, above which it is told that it is not accurate."""

MORE = 0.1
"""Difference of the deviation to second order from that to first, relative to the latter, above which it is told."""

SMALL = {"mm": 0.01, "°": 0.02, "N": 1e-3, "N·mm": 0.02}
"""Motions and forces with a smaller value and a smaller deviation are not told where several are."""


@dataclass(frozen=True, eq=False, repr=False)
class ToleranceReport:
    """Scatter of motions of the tip, of forces with which it pushes where it is held, and of volumes, in every task.

    Attributes
    ----------
    problem : Problem
    tasks : {task: Scatter}
    solved : {task: {quantity: OneDeviation}}
        Of the motions and forces that tasks are about, where castings perturbed by one deviation could be solved.
    second : {task: {quantity: float}}
        Deviations of these to second order, where all castings for them had stable states.
    ballooning : {task: Ballooning}
        Of the tasks in which some castings may balloon.
    mesh : TetMesh
        Of the whole body at rest.
    thickening : {task: {motion: (N,)}}
        Change of these motions in mm or rad per mm³ of rubber that is added at the nodes of surfaces.
    inflated : {task: chambers}
        Which have pressure.
    ends : {task: {MPa: (k,), or None}}
        All that scatters, with the moduli of a rubber of the library scaled to the least and the largest shear modulus
        that sources give, or None where there is no stable state; empty where the rubber's tolerance was given, or
        forces do not scale with the rubber's.
    doubts : sequence of str
        Sentences on rubbers whose moduli are not well known; none where the rubber's tolerance was given.

    Examples
    --------
    >>> import pneumorph as pm
    >>> report = pm.open_run("runs/small").best.tolerance(wall="0.2 mm")
    >>> largest = max(report.tasks["extend"].causes, key=lambda cause: abs(cause.tolerance * cause.by[2]))
    >>> largest.name
    'modulus of the rubber'
    """

    problem: Problem
    tasks: Mapping[str, Scatter]
    solved: Mapping[str, Mapping[str, OneDeviation]]
    second: Mapping[str, Mapping[str, float]]
    ballooning: Mapping[str, Ballooning]
    mesh: TetMesh
    thickening: Mapping[str, Mapping[str, np.ndarray]]
    inflated: Mapping[str, Sequence[str]]
    ends: Mapping[str, Mapping[float, np.ndarray | None]] = field(default_factory=dict)
    doubts: Sequence[str] = ()

    def picture(self, path: str | Path) -> Path:
        """Draw what 0.1 mm more rubber at each place of the surfaces does, as PNG, PDF or SVG by the suffix.

        Of the motions that tasks are about and that have the unit of the first.

        Raises
        ------
        ProblemError
            If no task is about a motion of the tip, or the file cannot be written.
        NoPicture
            If this machine cannot draw off-screen.
        """
        asked = [
            (task.name, motion, sign)
            for task in self.problem.task
            for motion, sign in task.objective.tip_motions.items()
            if motion in self.thickening.get(task.name, {})
        ]
        if not asked:
            raise ProblemError("picture: no task is about a motion of the tip, so there is none to draw; leave it out")
        kind = asked[0][1] in MOTIONS[:3]
        unit, size = ("mm", 1.0) if kind else ("°", float(np.degrees(1.0)))
        changes = {
            f"{task}: {motion_word(motion, sign)}": sign * size * self.thickening[task][motion]
            for task, motion, sign in asked
            if (motion in MOTIONS[:3]) == kind
        }
        saved(thickening_figure(self.problem, self.mesh, changes, unit), Path(path))
        return Path(path)

    def to_json(self) -> dict[str, Any]:
        """All figures, in mm and rad, N and N·mm, mm³; of each cause its tolerance in its unit, and these per unit."""
        return {
            name: {
                "quantities": list(scatter.quantities),
                "values": list(scatter.values),
                "motion": list(scatter.motion),
                "deviation": scatter.deviations.tolist(),
                "causes": [to_json(cause) for cause in scatter.causes],
                "constants": {constant: list(by) for constant, by in scatter.constants.items()},
                "solved": {motion: [each.down, each.up] for motion, each in self.solved[name].items()},
                "second_order": dict(self.second[name]),
                "ballooning": _as_json(self.ballooning.get(name)),
                "sources": [
                    {"shear_modulus_MPa": modulus} | _of_source(values)
                    for modulus, values in self.ends.get(name, {}).items()
                ],
            }
            for name, scatter in self.tasks.items()
        }

    def __str__(self) -> str:
        tasks = [task for task in self.problem.task if task.name in self.tasks]
        tables = [
            "\n".join(
                _lines(
                    task,
                    self.tasks[task.name],
                    self.inflated[task.name],
                    self.solved[task.name],
                    self.second[task.name],
                    self.ballooning.get(task.name),
                    self.ends.get(task.name, {}),
                )
            )
            for task in tasks
        ]
        return "\n\n".join([*tables, *self.doubts])

    __repr__ = __str__


def tolerance_report(
    problem: Problem,
    body: Body,
    given: Mapping[str, Any],
    tasks: Sequence[str] | None = None,
    stored: Fields | None = None,
    results: Mapping[str, TaskResult] | None = None,
) -> ToleranceReport:
    """The scatter of a body of a problem.

    Parameters
    ----------
    problem : with the pressures of the body as those it starts from.
    body : whose walls, cores and rubbers vary.
    given : tolerances other than the usual ones, as text, see `read_tolerances`.
    tasks : the only ones, by default all.
    stored, results : see `analyse_near`.

    Raises
    ------
    ProblemError
        If a tolerance is not one.
    ComputationError
        If the whole body cannot be meshed or has no equilibrium.
    """
    tolerances = of_sources(read_tolerances(given), problem, rubbers="rubber" not in given)
    if tasks is not None:
        problem = problem.model_copy(update={"task": tuple(task for task in problem.task if task.name in tasks)})
    whole = analyse_near(problem, body, (), stored, results)
    scatters, by_nodes = scatter_of(whole, tolerances), thickenings(problem, whole.disc, whole.analysis)
    # To first order only symmetric causes move the limit point of a symmetric body.
    part = part_of(problem)
    ballooning = ballooning_of(analyse_near(problem, body, part, stored, results) if part else whole, tolerances)
    solved: dict[str, dict[str, OneDeviation]] = {}
    second: dict[str, dict[str, float]] = {}
    for task in problem.task:
        solved[task.name], second[task.name] = {}, {}
        if (limit := ballooning.get(task.name)) is not None and limit.within_one:
            continue  # castings off by one deviation balloon, which takes longest to find out
        scatter = scatters[task.name]
        for name in task.objective.quantities:
            of = (whole, task.name, scatter, scatter.quantities.index(name))
            if (found := one_deviation(*of)) is not None:
                solved[task.name][name] = found
                if (deviation := second_order(*of, found)) is not None:
                    second[task.name][name] = deviation
    mesh = whole.disc.morph.mesh.at(whole.analysis.X)
    ends, doubts = {}, []
    if "rubber" not in given:
        ends = {name: _at_ends(whole, name, scatter.quantities) for name, scatter in scatters.items()}
        doubts = list(filter(None, map(doubt, materials(problem).values())))
    inflated = {name: inflated_in(at) for name, at in whole.analysis.configurations.items()}
    return ToleranceReport(problem, scatters, solved, second, ballooning, mesh, by_nodes, inflated, ends, doubts)


def inflated_in(at: Configuration) -> list[str]:
    """The chambers that have pressure."""
    pressures = zip(at.model.chambers, np.asarray(at.loads.pressure), strict=True)
    return [chamber for chamber, pressure in pressures if pressure]


def _at_ends(whole: Solved, task: str, quantities: Sequence[str]) -> dict[float, np.ndarray | None]:
    """Quantities with the least and the largest shear modulus of all sources, by them."""
    material = whole.problem.material
    ends = range_of(material)
    if ends is None:
        return {}
    with doing(f"task {task}: with the moduli of other sources"):
        found = with_moduli(whole, task, [end / material.initial_shear_modulus for end in ends], quantities)
    return {} if found is None else dict(zip(ends, found, strict=True))


def read_tolerances(given: Mapping[str, Any]) -> Tolerances:
    """Tolerances from text or pint quantities, "0.1 mm" or "10 %"; those that are not given are the usual ones.

    Raises
    ------
    ProblemError
        If one is not a tolerance, see `read_deviations`.
    """
    return Tolerances(**read_deviations(given))


def _lines(
    task: Task,
    scatter: Scatter,
    inflated: Sequence[str],
    solved: Mapping[str, OneDeviation],
    second: Mapping[str, float],
    ballooning: Ballooning | None,
    ends: Mapping[float, np.ndarray | None],
) -> Iterator[str]:
    """A table for each motion or force that the task is about, or for all that are large enough, and for volumes."""
    for number, name, told in _told(task, scatter, inflated):
        value, deviation = scatter.values[number], scatter.deviations[number]
        after, spread = told.after, f"{abs(told.size) * deviation:.2g}"
        yield f"{task.name}: {told.word} {told.number(value)} ± {spread}{after} (one standard deviation)"
        yield from _table(scatter, number, told)
        yield from _of_constants(scatter, number, told)
        if name in solved:
            yield _further(solved[name], value, deviation, told)
        elif ballooning is not None and ballooning.within_one:
            yield "  by first derivatives alone: castings off by one deviation balloon, so it tells little"
        if name in second and second[name] > (1.0 + MORE) * deviation:
            yield f"  second order matters: with it the deviation is about {abs(told.size) * second[name]:.2g}{after}"
        if ends:
            solved_at = (
                f"{1e3 * modulus:.3g} kPa: {'no stable state' if at is None else told.number(at[number]) + after}"
                for modulus, at in ends.items()
            )
            yield f"  solved with the shear moduli of sources: {', '.join(solved_at)}"
    if ballooning is not None:
        yield _balloons(task.name, ballooning)


def _of_constants(scatter: Scatter, number: int, told: Shown) -> Iterator[str]:
    """What a quantity changes by per cent of every constant of the rubbers."""
    parts = (
        f"{name} {told.size * by[number]:+.2g}{told.after}" for name, by in scatter.constants.items() if by[number]
    )
    if line := ", ".join(parts):
        yield f"  per % of a constant: {line}"


def _told(task: Task, scatter: Scatter, inflated: Sequence[str]) -> Iterator[tuple[int, str, Shown]]:
    """What a table is made of: the number and name of a quantity, and how it is read."""
    asked = task.objective.quantities
    for number, name in enumerate(scatter.quantities):
        told = shown(name, asked.get(name, 1.0))
        if name.startswith(VOLUME_OF):
            wanted = name.removeprefix(VOLUME_OF) in inflated
        elif asked:
            wanted = name in asked
        else:
            size = abs(told.size) * max(abs(scatter.values[number]), scatter.deviations[number])
            wanted = size >= SMALL[told.unit]
        if wanted:
            yield number, name, told


def _of_source(values: np.ndarray | None) -> dict[str, Any]:
    """What is found with the modulus of a source."""
    if values is None:
        return {"motion": None, "values": None}
    return {"motion": values[: len(MOTIONS)].tolist(), "values": values.tolist()}


def _as_json(ballooning: Ballooning | None) -> dict[str, Any] | None:
    """The figures with the probability that follows from them."""
    return None if ballooning is None else to_json(ballooning) | {"probability": ballooning.probability}


def _balloons(task: str, ballooning: Ballooning) -> str:
    """At which pressure a task balloons, and how many castings of it do so before their working pressure."""
    percent = 100.0 * ballooning.probability
    part = f"about {percent:.0f} %" if percent >= 1.0 else "fewer than 1 %"
    # More digits where the margin is slight.
    margin = f"{ballooning.margin:.2f}" if ballooning.margin >= 1.005 else f"{ballooning.margin:.4f}"
    return (
        f"{task}: balloons at {margin} times its pressure, ± {100.0 * ballooning.deviation:.0f} %; "
        f"{part} of castings balloon below their working pressure"
    )


def _further(solved: OneDeviation, value: float, deviation: float, told: Shown) -> str:
    """What solutions for castings perturbed by one deviation say of the first-order figures."""
    ends = (solved.down, solved.up)
    both = " and ".join("no stable state" if each is None else f"{told.number(each)}{told.after}" for each in ends)
    line = f"  solved for castings off by one deviation: {both}"
    if None in ends:
        return f"{line}; such castings may balloon or buckle"
    far = max(abs(abs(each - value) - deviation) for each in ends if each is not None)
    return f"{line}; this is far from linear" if far > NOT_LINEAR * deviation else line


def _table(scatter: Scatter, number: int, told: Shown) -> Iterator[str]:
    """The causes by their part in the variance of a quantity."""
    size, unit = told.size, told.unit
    shares = scatter.variances[:, number] / max(float(scatter.variances[:, number].sum()), 1e-300)
    yield f"  {'cause':<26} {'tolerance':>10} {unit + ' per unit':>14} {'± ' + unit:>9} {'share':>7}"
    left = [k for k in np.argsort(-shares, kind="stable") if shares[k] < LEAST]
    for k in np.argsort(-shares, kind="stable"):
        if shares[k] < LEAST:
            continue
        cause = scatter.causes[k]
        by = size * cause.by[number]
        tolerance = f"{cause.tolerance:.3g} {cause.unit}"
        yield (
            f"  {cause.name:<26} {tolerance:>10} {f'{by:+.3g} /{cause.unit}':>14} {abs(by) * cause.tolerance:>9.2g} "
            f"{100 * shares[k]:>5.0f} %"
        )
    if left:
        yield f"  {len(left)} others{'':<53} {100 * sum(shares[k] for k in left):>5.0f} %"
