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
_COLOURS |= {"master": "#e8b75e", "negative": "#d9a3a3", "part": "#6fb394"}
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
    (_draw_silicone if "negative-1-a" in pieces else _draw_split)(plotter, pieces)
    plotter.camera.parallel_projection = True
    plotter.reset_camera_clipping_range()
    plotter.enable_anti_aliasing("ssaa")
    plotter.screenshot(str(path))


def _add(plotter: pv.Plotter, name: str, piece: pv.PolyData, **look) -> None:
    colour = _COLOURS[name.split("-")[0]]
    plotter.add_mesh(piece, color=colour, smooth_shading=True, split_sharp_edges=True, ambient=0.25, **look)


def _draw_split(plotter: pv.Plotter, pieces: dict[str, pv.PolyData]) -> None:
    """Left: closed, without the last sector, seen from there. Middle: apart. Right: the part."""
    everything = pv.merge(list(pieces.values()))
    left, right, _, _, low, high = everything.bounds
    wide, tall = right - left, high - low
    outer = [name for name in pieces if name.startswith("outer")]
    x, y, _ = pieces[outer[0]].center
    turn = float(np.degrees(np.arctan2(y, x)))
    for name, piece in pieces.items():
        kind = name.split("-")[0]
        if kind != "body" and not (kind == "outer" and name.split("-")[1] == outer[-1].split("-")[1]):
            _add(plotter, name, piece.rotate_z(90.0 - turn))
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
        _add(plotter, name, aside.translate(away))
    middle = np.array([2.2 * wide, 0.0, (low + high) / 2.0])
    _look(plotter, middle, 20.0 * wide, max(0.85 * tall, 2.0 * wide))


def _look(plotter: pv.Plotter, middle: np.ndarray, far: float, scale: float) -> None:
    """See everything from the front and a little from above."""
    plotter.camera_position = [tuple(middle + np.array([0.0, -far, 0.25 * far])), tuple(middle), (0.0, 0.0, 1.0)]
    plotter.camera.parallel_scale = scale


def _draw_silicone(plotter: pv.Plotter, pieces: dict[str, pv.PolyData]) -> None:
    """From left to right: a master on its plate, and its other side; both negatives; the parts of rubber; the body."""
    upward = np.array(pieces["negative-1-a"].center) - np.array(pieces["negative-1-b"].center)
    turn = -90.0 - float(np.degrees(np.arctan2(upward[1], upward[0])))  # side a towards the viewer
    ahead = {name: piece.rotate_z(turn) for name, piece in pieces.items()}
    back = {name: piece.rotate_z(turn + 180.0) for name, piece in pieces.items()}
    masters = [name for name in pieces if name.split("-")[:2] == ["master", "1"]]
    parts = [name for name in pieces if name.startswith("part-")]
    row = [[(name, view[name]) for name in masters] for view in (ahead, back)]
    row += [[("negative-1-a", back["negative-1-a"])], [("negative-1-b", ahead["negative-1-b"])]]
    row += [[(name, (back if number == 0 else ahead)[name])] for number, name in enumerate(parts)]
    row.append([("body", ahead["body"])])
    left, tallest = 0.0, 0.0
    for group in row:
        bounds = pv.merge([piece for _, piece in group]).bounds
        for name, piece in group:
            _add(plotter, name, piece.translate([left - bounds[0], 0.0, 0.0]))
        left += bounds[1] - bounds[0] + 12.0
        tallest = max(tallest, bounds[5] - bounds[4])
    bounds = pieces["body"].bounds
    middle = np.array([left / 2.0, 0.0, (bounds[4] + bounds[5]) / 2.0])
    wide = left / 2.0 * _SIZE[1] / _SIZE[0]
    _look(plotter, middle, 20.0 * left, max(0.65 * tallest, 1.05 * wide))
