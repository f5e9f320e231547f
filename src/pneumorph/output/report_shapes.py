"""The shapes of a run for its page: the surfaces of every design, and the deformed surfaces that are stored."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.geometry import Body, Surface
from pneumorph.geometry.starting import body_of
from pneumorph.mesh import TetMesh
from pneumorph.mesh.tets import chambers_of
from pneumorph.output.obstacles import shells_of, views_of
from pneumorph.output.packed import MICROMETRE, Steps, in_parts, in_steps
from pneumorph.output.tube.nets import told_as_tube
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting_in, like_first
from pneumorph.problem.components import is_turn
from pneumorph.problem.objectives.words import motion_word
from pneumorph.results import Fields, HistoryEntry, SweepStep, TaskResult, nodal_stretch
from pneumorph.run import RunDirectory

QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""A six-node triangle as four flat ones."""

MOST_NUMBERS = 1_300_000
"""Most displacements and stretches on a page. They take 1.5 bytes each, so that the whole page stays below 5 MB. Where
there are more, surfaces are drawn by the corners of their triangles only, and then at fewer pressures."""

PATCH = 10.0
"""mm³ of rubber that is added at a place where it is told what that does: 0.1 mm on 1 cm²."""

Arrays = dict[str, Steps]


def packed_surfaces(bodies: Sequence[Body]) -> tuple[list[dict[str, Any]], Arrays]:
    """A description for a page of every surface of some designs of a body, and what it is drawn from in each.

    Of a tube that is its control net, (designs, n_r, n_q, 3). Any other surface is drawn by the vertices of its shell,
    (designs, n, 3), whose triangles are the same in all designs.
    """
    told, arrays = [], Arrays()
    step = _length_step(bodies[0])
    for surfaces in zip(*(body.surfaces for body in bodies), strict=True):
        first, key = surfaces[0], array_key(surfaces[0])
        kind = told_as_tube(surfaces)
        if kind is None:
            kind, stored = {"kind": "triangles"}, f"shell {key}"
            shells = [surface.shell() for surface in surfaces]
            arrays[f"corners {key}"] = Steps(shells[0][1].ravel(), differences=True)
            points = [each for each, _ in shells]
        else:
            stored, points = f"net {key}", [each.control_points().reshape(*each.shape, 3) for each in surfaces]
        arrays[stored] = in_steps(np.array(points), step, differences=True)
        told.append({"name": first.name, "cavity": first.cavity, "key": key, "stored": stored} | kind)
    return told, arrays


def packed_obstacles(problem: Problem) -> tuple[list[str], Arrays]:
    """The names of the obstacles on a page, and their triangles in their places."""
    start = body_of(problem)
    step, arrays = _length_step(start), Arrays()
    points = start.exterior.control_points()
    shells = shells_of(problem, {spec.name: points for spec in problem.obstacle})
    for name, shell in shells.items():
        arrays[f"obstacle points {name}"] = in_steps(shell.points, step)
        arrays[f"obstacle triangles {name}"] = Steps(shell.triangles.ravel(), differences=True)
    return list(shells), arrays


def array_key(surface: Surface) -> str:
    """What the names of a surface's arrays end with."""
    # A chamber may be called "exterior".
    return f"chamber {surface.name}" if surface.cavity else "exterior"


def _length_step(body: Body) -> float:
    """Micrometres, or finer for a body that is small."""
    return min(MICROMETRE, 1e-4 * float(np.ptp(body.exterior.control_points(), axis=0).max()))


@dataclass(frozen=True, eq=False)
class Stop:
    """The nodes at some pressures (MPa): displacements (N, 3) in mm and largest principal stretches (N,).

    `obstacles` are the motions of those that are not in their places, as 4 × 4 matrices column by column; None where it
    is not known.
    """

    pressures: Mapping[str, float]
    u: np.ndarray
    stretch: np.ndarray
    obstacles: Mapping[str, list[float] | None]


@dataclass(frozen=True, eq=False)
class Skin:
    """The surfaces of a stored design as flat triangles.

    Attributes
    ----------
    nodes : (V,) indices of the mesh's nodes; nodes on a sharp edge between two parts come twice.
    triangles : (T, 3) indices into `nodes`; normals point from solid to void.
    parts : for every part the surface that it belongs to, and where its nodes and triangles end.
    """

    nodes: np.ndarray
    triangles: np.ndarray
    parts: list[dict[str, Any]]


def packed_states(
    run: RunDirectory, history: list[HistoryEntry], numbers: int | None = None, taken: int = 0
) -> tuple[list[dict[str, Any]], Arrays, list[str]]:
    """Descriptions for a page of all designs with stored fields, the arrays, and sentences on what is left out.

    `numbers` are at most stored, by default `MOST_NUMBERS`, of which something else has `taken` some.
    """
    numbers = (MOST_NUMBERS if numbers is None else numbers) - taken
    stored = [(entry, fields) for entry in history for fields in [run.fields(entry.iteration)] if fields is not None]
    whole = [(entry, fields.whole()) for entry, fields in stored]
    stops = [{task: list(_stops(run.problem, entry, fields, task)) for task in fields.u} for entry, fields in whole]
    count, notes = sum(len(each) for by_task in stops for each in by_task.values()), []
    size = max((len(fields.skin) for _, fields in whole), default=0)
    corners = 4 * size * count > numbers
    if corners:
        notes.append("inflated surfaces are drawn by the corners of their triangles, to keep this file small")
    most = int(numbers / max(size if corners else 1, 1)) if corners else count
    if most < count:
        stops = [{task: _thinned(each, most / count) for task, each in by_task.items()} for by_task in stops]
        notes.append("fewer pressures are shown than are stored, to keep this file small")
    if _free(run.problem):
        notes.append("free obstacles are shown at rest and at the whole pressures, where their places are stored")
    told, arrays = [], Arrays()
    for (entry, fields), by_task in zip(whole, stops, strict=True):
        changes = _changes(run.problem, fields)
        design, more = _packed_design(entry.iteration, fields, by_task, corners, changes)
        told.append(design)
        arrays |= more
    return told, arrays, notes


@dataclass(frozen=True, eq=False)
class Change:
    """What `PATCH` of rubber at every node (N,) does to a motion, its name, and words that have its unit."""

    motion: str
    words: str
    values: np.ndarray


def _changes(problem: Problem, fields: Fields) -> dict[str, list[Change]]:
    """Of the motions of the tip that every task is about, where they are stored."""
    found: dict[str, list[Change]] = {}
    for task in problem.task:
        for motion, sign in task.objective.tip_motions.items():
            if motion in fields.thickening.get(task.name, {}):
                unit, size = ("°", float(np.degrees(1.0))) if is_turn(motion) else ("mm", 1.0)
                word = motion_word(motion, sign)
                words = f"{word[0].upper()}{word[1:]}: change by 0.1 mm more rubber on 1 cm², {unit}"
                values = sign * size * PATCH * fields.thickening[task.name][motion]
                found.setdefault(task.name, []).append(Change(word, words, values))
    return found


def _stops(problem: Problem, entry: HistoryEntry, fields: Fields, task: str) -> Iterator[Stop]:
    """A task's states by rising pressures, as far as stored; below the full pressures only the surfaces are known."""
    pressures = entry.tasks[task].pressures
    nothing, rest = dict.fromkeys(pressures, 0.0), np.zeros_like(fields.mesh.points)
    if fields.sag is not None and like_first(problem, task):
        yield Stop(
            nothing, fields.sag, nodal_stretch(fields.mesh, fields.sag), moved_obstacles(problem, task, None, 0.0)
        )
    elif not acting_in(problem)[task].moves:
        yield Stop(nothing, rest, np.ones(len(rest)), {})
    if task in fields.inflation:
        way, skin = fields.inflation[task], fields.skin
        for part, u, stretch in zip(way.parts, way.u, way.stretch, strict=True):
            moved, stretched = rest.copy(), np.ones(len(rest))
            moved[skin], stretched[skin] = u, stretch
            partly = {name: float(part * value) for name, value in pressures.items()}
            yield Stop(partly, moved, stretched, moved_obstacles(problem, task, None, float(part)))
    yield Stop(dict(pressures), fields.u[task], fields.stretch[task], moved_obstacles(problem, task, entry.tasks[task]))


def moved_obstacles(
    problem: Problem, task: str, found: TaskResult | SweepStep | None, part: float = 1.0
) -> dict[str, list[float] | None]:
    """Where obstacles are, see `Stop`, at this part of a task's poses; free ones are known of a result alone."""
    asked = next(each for each in problem.task if each.name == task)
    views = views_of(problem, asked, found, part)
    places: dict[str, list[float] | None] = {
        name: view.matrix.T.ravel().tolist() for name, view in views.items() if view.pose.any()
    }
    return places if found is not None else places | dict.fromkeys(_free(problem))


def _free(problem: Problem) -> list[str]:
    """The names of the free obstacles."""
    return [spec.name for spec in problem.obstacle if spec.free is not None]


def packed_state(
    problem: Problem, fields: Fields, pressures: Mapping[str, float], found: SweepStep
) -> tuple[dict[str, Any], Arrays]:
    """The description for a page of a state that is not of a run, and its arrays.

    Parameters
    ----------
    problem : Problem
    fields : Fields
        Of one task.
    pressures : {chamber: MPa}
    found : SweepStep
        Its result.
    """
    whole = fields.whole()
    ((task, u),) = whole.u.items()
    stop = Stop(pressures, u, whole.stretch[task], moved_obstacles(problem, task, found))
    return _packed_design(0, whole, {task: [stop]}, corners=False, changes={})


def _thinned(stops: list[Stop], part: float) -> list[Stop]:
    """About that fraction of the stops; the one at full pressures is kept."""
    count = max(1, int(part * len(stops)))
    places = np.unique(np.rint(np.linspace(0, len(stops) - 1, count)).astype(int)) if count > 1 else [-1]
    return [stops[place] for place in places]


def _packed_design(
    number: int,
    fields: Fields,
    by_task: Mapping[str, list[Stop]],
    corners: bool,
    changes: Mapping[str, Sequence[Change]],
) -> tuple[dict[str, Any], Arrays]:
    skin, step = (
        skin_of_mesh(fields.mesh, corners),
        min(MICROMETRE, 1e-4 * float(np.ptp(fields.mesh.points, axis=0).max())),
    )
    arrays = {
        f"points {number}": in_steps(fields.mesh.points[skin.nodes], step),
        # Neighbouring triangles have similar numbers.
        f"triangles {number}": Steps(skin.triangles.ravel(), differences=True),
    }
    tasks = []
    for task, stops in by_task.items():
        told = []
        for place, stop in enumerate(stops):
            name = f"{number} {place} {task}"
            arrays[f"u {name}"] = in_parts(stop.u[skin.nodes])
            arrays[f"stretch {name}"] = in_steps(stop.stretch[skin.nodes], 1e-3)
            told.append({"pressures": dict(stop.pressures), "name": name, "obstacles": dict(stop.obstacles)})
        tasks.append({"task": task, "stops": told})
        for place, change in enumerate(changes.get(task, ())):
            name = f"thickening {number} {place} {task}"
            arrays[name] = in_parts(change.values[skin.nodes])
            words = {"name": name, "motion": change.motion, "words": change.words}
            tasks[-1].setdefault("thickening", []).append(words)
    return {"design": number, "parts": skin.parts, "tasks": tasks}, arrays


def skin_of_mesh(mesh: TetMesh, corners: bool) -> Skin:
    """The surfaces of a mesh, by the corners of its triangles only if asked for."""
    nodes, triangles, parts, first = [], [], [], 0
    for name, faces in mesh.faces.items():
        chambers = chambers_of(name)
        for part in _smooth_parts(mesh.points, faces) if chambers else [faces]:
            flat = part[:, :3] if corners else part[:, QUARTERS].reshape(-1, 3)
            used, numbers = np.unique(flat, return_inverse=True)
            nodes.append(used)
            triangles.append(first + numbers.reshape(-1, 3))
            first += len(used)
            surface = {"face": name, "cavity": bool(chambers), "surface": chambers[0] if chambers else "exterior"}
            parts.append(surface | {"vertices": first, "triangles": sum(map(len, triangles))})
    return Skin(np.concatenate(nodes), np.concatenate(triangles), parts)


def _smooth_parts(points: np.ndarray, faces: np.ndarray) -> Iterator[np.ndarray]:
    """The tube of a chamber, and its flat ends where it has them: all points of one share their z."""
    z = points[faces[:, :3], 2]
    low, high = z.min(), z.max()
    near = 1e-6 * (high - low)
    base, tip = (z < low + near).all(axis=1), (z > high - near).all(axis=1)
    for chosen in (~base & ~tip, base, tip):
        if chosen.any():
            yield faces[chosen]
