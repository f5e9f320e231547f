"""Runs in a directory that no optimiser has made: a body that waves more from design to design."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from records import entry, task_result

from pneumorph.analysis import analyse, collect_fields, compute_inflation, discretise, thickenings
from pneumorph.geometry import Body
from pneumorph.geometry.tube import build_design_space, starting_body
from pneumorph.problem import Problem
from pneumorph.results import Fields, Inflation, RunResult
from pneumorph.run import RunDirectory, StoredDesign, create
from pneumorph.run.complete import Outcome, result

LIMITS = {"wall_mm": 2.5, "fold_mm": 2.0, "curvature": 0.1, "skew": 0.01, "stretch": 0.01, "envelope_mm": 9.5}
LIMITS |= {"margin": 1.5}


def waved(body: Body, amplitude: float) -> Body:
    """A body whose walls wave about their own axes."""
    surfaces = []
    for surface in body.surfaces:
        net = surface.net.copy()
        centre = net.mean(axis=1, keepdims=True)
        net[1:-1, :, :2] += amplitude * (np.sin(1.5 * net[1:-1, :, 2:]) * (net - centre)[1:-1, :, :2]) / 8.0
        surfaces.append(replace(surface, net=net))
    return Body(surfaces[0], tuple(surfaces[1:]))


def waving_run(path: Path, problem: Problem, designs: int, fields: dict[int, Fields], waves: float = 0.1):
    """A run directory with that many designs; `fields` are stored of the first and the last."""
    run, start = create(path, problem), starting_body(problem.tubes)
    pressures = {task.name: {name: free.start for name, free in task.pressure.items()} for task in problem.task}
    for number in range(designs):
        body = waved(start, waves * number)
        stored = StoredDesign.of(body, pressures)
        nothing = next(iter(fields.values()))
        run.record(line(problem, number, pressures), stored, fields.get(number, nothing), {})
    for stored in (run.path / "fields").iterdir():
        if int(stored.stem) not in fields:
            stored.unlink()
    return run


def line(problem: Problem, number: int, pressures):
    """A history entry whose numbers change from design to design."""
    tasks = {
        task.name: task_result(
            pressures=pressures[task.name],
            translation=(0.25 * number, 0.0, 1.0 + number),
            rotation=(0.0, 0.1 * number, 0.0),
            volumes=dict.fromkeys(pressures[task.name], 900.0 + number),
            objective=-1.0 - number,
            errors={"position_mm": 3.0 / (1 + number), "orientation_rad": 0.2 / (1 + number)},
        )
        for task in problem.task
    }
    return entry(number, objective=-1.5 - number, tasks=tasks, limits=LIMITS)


def analysed(problem: Problem, amplitude: float) -> Fields:
    """Fields of the waved body as they are at the end of a run."""
    body = waved(starting_body(problem.tubes), amplitude)
    space, disc = build_design_space(problem, body), discretise(problem, body)
    found = analyse(problem, space, disc, space.start)
    _, inflation = compute_inflation(problem, disc, found)
    return collect_fields(disc, found, None, inflation, thickenings(problem, disc, found))


def ended(run: RunDirectory, reason: str = "it is a test", completed: bool = True) -> RunResult:
    """Write and return the result of a run."""
    run.write_result(result(run.problem, run.history(), Outcome(reason, completed)))
    found = run.result()
    assert found is not None
    return found


def inflated(fields: Fields, parts: int = 5) -> Fields:
    """The same with a way to its states that is straight."""
    share = np.arange(1, parts + 1) / (parts + 1)
    skin = fields.skin
    ways = {
        name: Inflation(
            share,
            (share[:, None, None] * u[skin]).astype(np.float32),
            (1 + share[:, None] * (fields.stretch[name][skin] - 1)).astype(np.float32),
        )
        for name, u in fields.u.items()
    }
    return replace(fields, inflation=ways)
