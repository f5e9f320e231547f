"""Draw bodies off-screen by VTK; run by `render` as a process of its own."""

from __future__ import annotations

import pickle
import sys
from pathlib import Path
from typing import Any, cast

import numpy as np
import pyvista as pv

from pneumorph.output.section import cut_open
from pneumorph.output.view import COLOURS, CUT, RIM, Job, Panel, Shape, View, colour_map


def main() -> None:
    """Read a job from the file named by the first argument and save its pictures as .npz by the second."""
    source, destination = sys.argv[1:]
    with Path(source).open("rb") as file:
        job: Job = pickle.load(file)
    np.savez(destination, *[draw(job, panel) for panel in job.panels])


def draw(job: Job, panel: Panel) -> np.ndarray:
    """A picture (height, width, 4); where there is no body it is transparent."""
    left, right, bottom, top = panel.extent
    view, window = panel.view, [int(job.dots * (right - left)), int(job.dots * (top - bottom))]
    plotter = pv.Plotter(off_screen=True, window_size=window, lighting="none")
    plotter.background_color = pv.Color("white")
    skin, face, rim = cut_open(panel.shape, view.normal, view.offset)
    field = isinstance(panel.shape, Shape) and panel.shape.field is not None
    plotter.add_mesh(
        skin, **_look(job, field, COLOURS[0]), show_scalar_bar=False, smooth_shading=True, interpolate_before_map=True,
        ambient=0.4, diffuse=0.6, specular=0.12, specular_power=12,
    )  # fmt: skip
    across, up, camera = view.axes()
    if face.n_points:
        known = field and cast(Shape, panel.shape).inside
        # The cut is plane: without lighting its colours are those of the scale.
        plotter.add_mesh(
            face, **_look(job, known, CUT), show_scalar_bar=False, lighting=False, interpolate_before_map=True
        )
        # Slightly towards the camera, or the surfaces that meet in the line would hide half of it.
        plotter.add_mesh(rim.translate(0.2 * camera), color=RIM, line_width=2.0, lighting=False)
    _light(plotter, view)
    focus = (left + right) / 2 * across + (bottom + top) / 2 * up
    plotter.camera_position = [tuple(focus + 1e3 * camera), tuple(focus), tuple(up)]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = (top - bottom) / 2
    plotter.reset_camera_clipping_range()
    plotter.enable_anti_aliasing("ssaa")
    picture = plotter.screenshot(return_img=True, transparent_background=True)
    plotter.close()
    return np.asarray(picture)


def _look(job: Job, field: bool, plain: str) -> dict[str, Any]:
    """Colours of the field, or a plain one without a field."""
    return {"scalars": "field", "cmap": colour_map(), "clim": job.range} if field else {"color": plain}


def _light(plotter: pv.Plotter, view: View) -> None:
    """A key light from the upper left, weaker ones from the lower right and from the camera, all distant."""
    right, up, camera = view.axes()
    for direction, intensity in (
        (camera - 0.8 * right + 0.9 * up, 0.65),
        (camera + 0.9 * right - 0.7 * up, 0.35),
        (camera, 0.25),
    ):
        plotter.add_light(pv.Light(position=tuple(1e4 * direction), focal_point=(0, 0, 0), intensity=intensity))
