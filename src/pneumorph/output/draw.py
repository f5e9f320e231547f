"""Draw bodies off-screen by VTK; run by `render` as a process of its own."""

from __future__ import annotations

import pickle
import sys
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyvista as pv

from pneumorph.output.section import Opened, cut_open
from pneumorph.output.view import (
    COLOURS,
    COVERING,
    CUT,
    JOBS,
    OBSTACLE,
    RIM,
    Covering,
    Job,
    Panel,
    Shape,
    View,
    drawn_name,
)
from pneumorph.processes import end_with_input

ADDED: dict[str, Any] = {"render": False, "reset_camera": False}
"""For everything that is added to a window: it is drawn once, when all is there."""


def main() -> None:
    """Read the jobs of a folder, which the argument names, and save the pictures of each once they are drawn."""
    end_with_input()
    folder = Path(sys.argv[1])
    with (folder / JOBS).open("rb") as file:
        jobs: list[Job] = pickle.load(file)
    parts = iter(opened([panel for job in jobs for panel in job.panels]))
    # One window for all pictures: each window would compile all of its shaders again.
    plotter = pv.Plotter(off_screen=True, lighting="none")
    plotter.background_color = pv.Color("white")
    plotter.enable_anti_aliasing("ssaa")
    for number, job in enumerate(jobs):
        np.savez(folder / "part.npz", *[draw(plotter, job, panel, next(parts)) for panel in job.panels])
        # Complete once it has its name.
        (folder / "part.npz").rename(folder / drawn_name(number))


def opened(panels: Sequence[Panel]) -> Iterator[Opened]:
    """The bodies of panels, cut open; states of one mesh that are cut alike are cut once for all of them."""
    cut: dict[int, Opened] = {}
    for number, panel in enumerate(panels):
        if number not in cut:
            alike = [other for other in range(number, len(panels)) if _alike(panel, panels[other])]
            parts = cut_open([panels[other].shape for other in alike], panel.view.normal, panel.view.offset)
            cut |= dict(zip(alike, parts, strict=True))
        yield cut.pop(number)


def _alike(one: Panel, other: Panel) -> bool:
    if one is other:
        return True
    same = isinstance(one.shape, Shape) and isinstance(other.shape, Shape) and one.shape.mesh is other.shape.mesh
    return same and one.view.offset == other.view.offset and np.array_equal(one.view.normal, other.view.normal)


def draw(plotter: pv.Plotter, job: Job, panel: Panel, parts: Opened) -> np.ndarray:
    """A picture (height, width, 4) of a body that is cut open; where there is no body it is transparent.

    Parameters
    ----------
    plotter : Plotter
        What was drawn in its window is removed.
    job : Job
        For the colours, and the number of dots.
    panel : Panel
    parts : Opened
        The body of the panel.
    """
    left, right, bottom, top = panel.extent
    view, skin, face, rim = panel.view, *parts
    plotter.clear()
    plotter.window_size = [int(job.dots * (right - left)), int(job.dots * (top - bottom))]
    field = isinstance(panel.shape, Shape) and panel.shape.field is not None
    plotter.add_mesh(
        skin, **_look(job, field, COLOURS[0]), show_scalar_bar=False, smooth_shading=True, interpolate_before_map=True,
        ambient=0.4, diffuse=0.6, specular=0.12, specular_power=12, **ADDED,
    )  # fmt: skip
    across, up, camera = view.axes()
    if face.n_points:
        known = field and cast(Shape, panel.shape).inside
        # The cut is plane: without lighting its colours are those of the scale.
        plotter.add_mesh(
            face, **_look(job, known, CUT), show_scalar_bar=False, lighting=False, interpolate_before_map=True, **ADDED
        )
        # Slightly towards the camera, or the surfaces that meet in the line would hide half of it.
        plotter.add_mesh(rim.translate(0.2 * camera), color=RIM, line_width=2.0, lighting=False, **ADDED)
    for covering in panel.coverings:
        _add_covering(plotter, covering, view)
    for obstacle in panel.obstacles:
        mesh = pv.PolyData.from_regular_faces(obstacle.points, obstacle.triangles)
        if view.offset is not None:
            mesh = mesh.clip(normal=view.normal, origin=view.offset * view.normal, invert=False)
        if mesh.n_points:
            plotter.add_mesh(
                mesh, color=OBSTACLE, opacity=0.45, smooth_shading=False, ambient=0.4, diffuse=0.6, **ADDED
            )
    _light(plotter, view)
    focus = (left + right) / 2 * across + (bottom + top) / 2 * up
    plotter.camera_position = [tuple(focus + 1e3 * camera), tuple(focus), tuple(up)]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = (top - bottom) / 2
    plotter.reset_camera_clipping_range()
    plotter.render()
    return np.asarray(plotter.screenshot(return_img=True, transparent_background=True))


def _add_covering(plotter: pv.Plotter, covering: Covering, view: View) -> None:
    """Sheets and fibres on what is not cut away."""
    cells = covering.cells
    if view.offset is not None:
        cells = cells[covering.rest[cells].mean(axis=1) @ view.normal > view.offset]
    if not len(cells):
        return
    # Slightly towards the camera, like the rim.
    points = covering.points + 0.2 * view.axes()[2]
    if cells.shape[1] == 3:
        sheet = pv.PolyData.from_regular_faces(points, cells)
        plotter.add_mesh(sheet, color=COVERING, opacity=0.35, lighting=False, **ADDED)
        return
    strokes = pv.PolyData(points, lines=np.insert(cells, 0, 2, axis=1).ravel())
    plotter.add_mesh(strokes, color=COVERING, line_width=1.5, lighting=False, **ADDED)


def _look(job: Job, field: bool, plain: str) -> dict[str, Any]:
    """Colours of the field, or a plain one without a field."""
    return {"scalars": "field", "cmap": job.colours.map(), "clim": job.range} if field else {"color": plain}


def _light(plotter: pv.Plotter, view: View) -> None:
    """A key light from the upper left, weaker ones from the lower right and from the camera, all distant."""
    right, up, camera = view.axes()
    for direction, intensity in (
        (camera - 0.8 * right + 0.9 * up, 0.65),
        (camera + 0.9 * right - 0.7 * up, 0.35),
        (camera, 0.25),
    ):
        plotter.add_light(pv.Light(position=tuple(1e4 * direction), focal_point=(0, 0, 0), intensity=intensity))
