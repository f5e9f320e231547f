"""Moving pictures: how the shape changes from design to design, and how a design inflates; every frame is computed."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from io import BytesIO
from pathlib import Path

import numpy as np
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure
from PIL import Image
from scipy.sparse import csr_matrix, diags
from scipy.sparse.linalg import cg

from pneumorph.atomic import write_bytes
from pneumorph.geometry import Body
from pneumorph.interrupts import stop_if_asked
from pneumorph.mesh import TetMesh
from pneumorph.output import render
from pneumorph.output.bodies import Layout, compose, job_of, lay_out, title_lines
from pneumorph.output.cuts import task_view, view_of
from pneumorph.output.figures import COLUMN
from pneumorph.output.format import format_pressures
from pneumorph.output.marks import task_marks
from pneumorph.output.reinforcements import coverings_of
from pneumorph.output.scenes import Scene, gravity_of, highest_stretch
from pneumorph.output.shell import shell_of
from pneumorph.output.view import Job, Shape, View
from pneumorph.problem import Problem
from pneumorph.problem.acting import like_first
from pneumorph.results import Fields, HistoryEntry, TaskResult, nodal_stretch

DOTS = 140
"""Per inch of a frame."""

MOST_FRAMES = 60
"""Of an evolution; a longer one shows some of its designs, with the first and the last."""

LONG, SHORT, STAY = 8.0, 0.3, 1.5
"""Seconds: an evolution, the longest that one frame is shown, and how long the last frame stays."""

WIDEST, TALLEST = COLUMN, 3.6
"""Inches: largest width and height of a body."""

Frames = list[tuple[Image.Image, float]]
"""Pictures with the seconds for which each is shown."""


@dataclass(frozen=True, eq=False)
class Film:
    """Scenes to be shown one after another, all to one scale and at one place.

    Attributes
    ----------
    scenes, seconds : the scenes, and for how long each is shown.
    back : whether the film goes back to its beginning, scene by scene.
    stretch, title : as of a `Row`.
    """

    scenes: Sequence[Scene]
    seconds: Sequence[float]
    back: bool
    stretch: tuple[float, float]
    title: str

    @cached_property
    def layout(self) -> Layout:
        """The place and scale of all scenes."""
        layout = lay_out(self.scenes, WIDEST, TALLEST, columns=1)
        low, high = np.min(layout.extents, axis=0), np.max(layout.extents, axis=0)
        return replace(layout, extents=[np.array([low[0], high[1], low[2], high[3]])] * len(self.scenes))

    @property
    def job(self) -> Job:
        """What is to be drawn for it."""
        return job_of(self.scenes, self.layout, self.stretch, DOTS)

    def frames(self, pictures: Sequence[np.ndarray]) -> Frames:
        """The frames, with the pictures of its job."""
        lines = max(title_lines(scene, self.layout) for scene in self.scenes)
        way = [
            (_drawn(compose([scene], self.layout, [picture], self.stretch, self.title, lines)), seconds)
            for scene, picture, seconds in zip(self.scenes, pictures, self.seconds, strict=True)
        ]
        return [*way, *way[-2:0:-1]] if self.back else way

    def drawn(self) -> Frames:
        """Draw the frames; raises NoPicture if this machine cannot draw off-screen."""
        return self.frames(render.images(self.job))


def evolution(problem: Problem, bodies: Sequence[tuple[HistoryEntry, Body]], view: View | None = None) -> Film:
    """The designs of a run at rest, with their results.

    Parameters
    ----------
    bodies : results and body of every design.
    view : by default that of all tasks together.
    """
    chosen = np.unique(np.rint(np.linspace(0, len(bodies) - 1, min(len(bodies), MOST_FRAMES))).astype(int))
    scenes = []
    for entry, body in (bodies[number] for number in chosen):
        motions = [task.objective.achieved(entry.tasks[task.name]) for task in problem.task]
        names = [f"{task.name} " for task in problem.task] if len(motions) > 1 else [f"{motions[0].word} "]
        words = ", ".join(f"{name}{motion}" for name, motion in zip(names, motions, strict=True))
        title = f"design {entry.iteration} at rest\n{words}"
        scenes.append(
            Scene(title, shell_of(body), view or view_of(problem), gravity=gravity_of(problem, problem.task[0]))
        )
    seconds = [min(SHORT, LONG / len(scenes))] * (len(scenes) - 1) + [STAY]
    return Film(scenes, seconds, False, (1.0, 1.0), problem.title)


def inflation(problem: Problem, fields: Fields, result: TaskResult, name: str, view: View | None = None) -> Film:
    """A design on the way to the pressures of a task and back, at the fractions of them that are stored.

    Parameters
    ----------
    fields, found : of the design; its result in the task.
    name : of the task.
    view : by default the plane in which the task bends the body.
    """
    task = next(task for task in problem.task if task.name == name)
    view = view or task_view(problem, task, result)
    # At fractions of the pressures the tip is elsewhere: loads would not be where they are drawn.
    marks = replace(task_marks(problem, task, result), arrows=(), reached=np.zeros((0, 3)))
    scenes = [
        Scene(
            f"{name}: {format_pressures(pressures)}",
            shape,
            view,
            marks,
            gravity_of(problem, task),
            coverings=coverings_of(problem, shape.mesh, shape.u),
        )
        for pressures, shape in _way(problem, fields.whole(), result, name)
    ]
    seconds = [SHORT] * (len(scenes) - 1) + [STAY]
    stretch = 1.0, highest_stretch(scene.shape for scene in scenes)
    return Film(scenes, seconds, True, stretch, problem.title)


def save_gif(path: Path, frames: Frames) -> None:
    """Save frames, all of one size, as a GIF that repeats, with the same colours in all of them."""
    pictures = [picture for picture, _ in frames]
    wide, high = pictures[0].size
    both = Image.new("RGB", (2 * wide, high))
    both.paste(pictures[0], (0, 0))
    both.paste(pictures[len(pictures) // 2 if len(pictures) > 2 else -1], (wide, 0))
    colours = np.reshape(both.quantize(255, dither=Image.Dither.NONE).getpalette() or [], (-1, 3))
    # The background, which would be the mean of all nearly white colours.
    colours[colours.min(axis=1) >= 250] = 255
    palette = Image.new("P", (1, 1))
    palette.putpalette(colours.ravel().tolist())
    first, *others = [picture.quantize(palette=palette, dither=Image.Dither.NONE) for picture in pictures]
    times = [round(1000 * seconds) for _, seconds in frames]
    content = BytesIO()
    first.save(content, "GIF", save_all=True, append_images=others, duration=times, loop=0, optimize=False)
    write_bytes(path, content.getvalue())


def _drawn(figure: Figure) -> Image.Image:
    stop_if_asked()
    figure.set_dpi(DOTS)
    canvas = FigureCanvasAgg(figure)
    canvas.draw()
    return Image.fromarray(np.asarray(canvas.buffer_rgba())).convert("RGB")


def _way(problem: Problem, fields: Fields, result: TaskResult, name: str) -> Iterator[tuple[dict[str, float], Shape]]:
    """The states of a task by rising pressures, in MPa; the cut face has no colours, as nothing is stored inside."""
    mesh, full = fields.mesh, fields.u[name]
    rest = np.zeros_like(full) if fields.sag is None else fields.sag
    if like_first(problem, name):
        stretch = np.ones(len(full)) if fields.sag is None else nodal_stretch(mesh, rest)
        yield dict.fromkeys(result.pressures, 0.0), Shape(mesh, rest, stretch, inside=False)
    if name in fields.inflation:
        way = fields.inflation[name]
        for part, u, stretch in zip(way.parts, way.u, way.stretch, strict=True):
            field = np.ones(len(full))
            field[fields.skin] = stretch
            pressures = {chamber: float(part * value) for chamber, value in result.pressures.items()}
            moved = filled_in(mesh, fields.skin, u, rest + part * (full - rest))
            yield pressures, Shape(mesh, moved, field, inside=False)
    yield dict(result.pressures), Shape(mesh, full, fields.stretch[name], inside=False)


def filled_in(mesh: TetMesh, skin: np.ndarray, u: np.ndarray, guess: np.ndarray) -> np.ndarray:
    """Displacements (N, 3) of all nodes from those (S, 3) of the surfaces, near a guess: only the cut face shows them.

    What the guess misses at the surfaces is spread inside, so that every node has the mean of its neighbours.

    Parameters
    ----------
    mesh : TetMesh
    skin : (S,) int
        Numbers of the surfaces' nodes.
    u : (S, 3) array
        Their displacements, mm.
    guess : (N, 3) array
        Of all displacements, mm.
    """
    moved = guess.copy()
    moved[skin] = u
    edges = np.concatenate([mesh.tets[:, [a, b]] for a in range(10) for b in range(a)])
    count = len(mesh.points)
    near = csr_matrix((np.ones(len(edges)), edges.T), shape=(count, count))
    near = ((near + near.T) > 0).astype(float)
    laplace = csr_matrix(diags(np.asarray(near.sum(axis=1)).ravel()) - near)
    inner = np.setdiff1d(np.arange(count), skin)
    known = laplace[inner][:, skin]
    inside = laplace[inner][:, inner]
    scale = diags(1.0 / inside.diagonal())
    for axis in range(3):
        missed = u[:, axis] - guess[skin, axis]
        moved[inner, axis] += cg(inside, -known @ missed, rtol=1e-4, M=scale)[0]
    return moved
