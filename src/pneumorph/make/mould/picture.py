"""Pictures of a mould, closed and taken apart, from its 3MF files; drawn in a process of its own.

VTK may end the process if there is no OpenGL.
"""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import numpy as np
import pyvista as pv

from pneumorph.processes import run

_CHILD = "from pneumorph.make.mould.picture import main; main()"
_SECONDS = 300
_COLOURS = {"outer": "#b3bcc6", "base": "#8d99a6", "lid": "#8d99a6", "core": "#e8b75e", "body": "#6fb394"}
_SIZE = (1500, 1000)


def draw_mould(folder: Path, path: Path) -> bool:
    """Draw the pieces in a folder; False if this machine cannot draw."""
    try:
        command = [sys.executable, "-c", _CHILD, str(folder), str(path)]
        run(command, _SECONDS).check_returncode()
    except (subprocess.SubprocessError, OSError):
        return False
    return path.exists()


def main() -> None:
    """Draw the folder named by the first argument into the file named by the second."""
    from pneumorph.make.printing import read_3mf

    folder, path = map(Path, sys.argv[1:])
    pieces = {}
    for kind in _COLOURS:
        for file in sorted(folder.glob(f"{kind}*.3mf")):
            found = next(iter(read_3mf(file).values()))
            pieces[file.stem] = pv.PolyData.from_regular_faces(found.points, found.corners)
    plotter = pv.Plotter(off_screen=True, window_size=list(_SIZE), lighting="light kit")
    plotter.background_color = pv.Color("white")
    everything = pv.merge(list(pieces.values()))
    left, right, _, _, low, high = everything.bounds
    wide, tall = right - left, high - low
    outer = [name for name in pieces if name.startswith("outer")]
    x, y, _ = pieces[outer[0]].center
    turn = float(np.degrees(np.arctan2(y, x)))
    for name, piece in pieces.items():
        kind = name.split("-")[0]
        look = {"color": _COLOURS[kind], "smooth_shading": True, "split_sharp_edges": True, "ambient": 0.25}
        # Left: closed, without the last sector, seen from there. Middle: apart. Right: the part.
        if kind != "body" and not (kind == "outer" and name.split("-")[1] == outer[-1].split("-")[1]):
            plotter.add_mesh(piece.rotate_z(90.0 - turn), **look)
        aside = piece.rotate_z(-turn)
        away = np.array([2.4 * wide, 0.0, 0.0])
        if kind == "outer":
            centre = np.array(aside.center) * [1.0, 1.0, 0.0]
            away += 0.7 * wide * centre / max(float(np.linalg.norm(centre)), 1e-9)
        away[2] += {"lid": 0.3 * tall, "base": -0.3 * tall}.get(kind, 0.0)
        number = name.split("-")
        if kind == "outer" and len(number) == 3:  # a part of a sector
            away[2] += 0.1 * tall * (float(number[2]) - 1.5)
        if kind == "body":
            away = np.array([4.4 * wide, 0.0, 0.0])
        plotter.add_mesh(aside.translate(away), **look)
    middle = np.array([2.2 * wide, 0.0, (low + high) / 2.0])
    plotter.camera_position = [
        tuple(middle + np.array([0.0, -20.0 * wide, 5.0 * wide])),
        tuple(middle),
        (0.0, 0.0, 1.0),
    ]
    plotter.camera.parallel_projection = True
    plotter.camera.parallel_scale = max(0.85 * tall, 2.0 * wide)
    plotter.reset_camera_clipping_range()
    plotter.enable_anti_aliasing("ssaa")
    plotter.screenshot(str(path))
