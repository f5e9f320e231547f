"""Pictures of a mould, closed and taken apart, from its 3MF files; run by `drawing` as a process of its own."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pyvista as pv

from pneumorph.processes import end_with_input

_COLOURS = {"outer": "#b3bcc6", "base": "#8d99a6", "lid": "#8d99a6", "core": "#e8b75e", "body": "#6fb394"}
_COLOURS |= {"master": "#e8b75e", "negative": "#d9a3a3", "part": "#6fb394", "box": "#b3bcc6", "cover": "#8d99a6"}
_SIZE = (1500, 1000)
"""Of a picture in pixels."""


def main() -> None:
    """Draw the folder named by the first argument into the file named by the second."""
    from pneumorph.make.printing import read_3mf

    end_with_input()
    folder, path = map(Path, sys.argv[1:])
    pieces = {}
    for kind in _COLOURS:
        for file in sorted(folder.glob(f"{kind}*.3mf")):
            mesh = next(iter(read_3mf(file).values()))
            pieces[file.stem] = pv.PolyData.from_regular_faces(mesh.points, mesh.corners)
    plotter = pv.Plotter(off_screen=True, window_size=list(_SIZE), lighting="light kit")
    plotter.background_color = pv.Color("white")
    (_draw_silicone if "negative-1-a" in pieces else _draw_split)(plotter, pieces)
    plotter.camera.parallel_projection = True
    plotter.reset_camera_clipping_range()
    plotter.enable_anti_aliasing("ssaa")
    plotter.screenshot(str(path))


def _add(plotter: pv.Plotter, name: str, piece: pv.DataSet, named: bool = False) -> None:
    """Draw a piece, with its name above it if asked."""
    if named:
        left, right, front, back, _, high = piece.bounds
        at = [[(left + right) / 2.0, (front + back) / 2.0, high]]
        look = {"font_size": 18, "text_color": "black", "shape": None}
        look |= {"justification_horizontal": "center", "show_points": False, "always_visible": True}
        plotter.add_point_labels(at, [name], **look)
    colour = _COLOURS[name.split("-")[0]]
    plotter.add_mesh(piece, color=colour, smooth_shading=True, split_sharp_edges=True, feature_angle=24.0, ambient=0.25)


def _draw_split(plotter: pv.Plotter, pieces: dict[str, pv.DataSet]) -> None:
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
        _add(plotter, name, aside.translate(away), named=True)
    middle = np.array([2.2 * wide, 0.0, (low + high) / 2.0])
    _look(plotter, middle, 20.0 * wide, max(0.85 * tall, 2.0 * wide))


def _look(plotter: pv.Plotter, middle: np.ndarray, far: float, scale: float) -> None:
    """See everything from the front and a little from above."""
    plotter.camera_position = [tuple(middle + np.array([0.0, -far, 0.25 * far])), tuple(middle), (0.0, 0.0, 1.0)]
    plotter.camera.parallel_scale = scale


def _draw_silicone(plotter: pv.Plotter, pieces: dict[str, pv.DataSet]) -> None:
    """Above, a master from both sides, the negatives, the parts and the body; below, the mould apart and closed."""
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
    width, low, high = _in_a_row(plotter, row, 0.0)

    # Side a obliquely to the right.
    stack = ("cover-b", "box-b", "negative-1-b", "part-1", "negative-1-a", "box-a", "cover-a")
    oblique = {name: piece.rotate_z(turn + 60.0) for name, piece in pieces.items()}
    groups = [
        [(name, oblique[name]) for name in pieces if name == kind or name.startswith(f"{kind}-")] for kind in stack
    ]
    closed = [pair for group in groups for pair in group]
    below, lowest, _ = _in_a_row(plotter, [*groups, closed], 1.3 * (high - low))
    wide, tall = 1.03 * max(width, below), 1.2 * (high - lowest)
    middle = np.array([max(width, below) / 2.0 - 4.0, 0.0, (high + lowest) / 2.0])
    plotter.window_size = [_SIZE[0], int(_SIZE[0] * tall / wide)]
    _look(plotter, middle, 20.0 * width, tall / 2.0)


def _in_a_row(
    plotter: pv.Plotter, groups: list[list[tuple[str, pv.DataSet]]], down: float
) -> tuple[float, float, float]:
    """Draw groups of pieces from left to right, lowered by `down`; the width of the row, its bottom and its top."""
    left, ends = 0.0, []
    for group in groups:
        bounds = pv.merge([piece for _, piece in group]).bounds
        for name, piece in group:
            # Of pieces at one place the first is named.
            _add(plotter, name, piece.translate([left - bounds[0], 0.0, -down]), named=name == group[0][0])
        left += bounds[1] - bounds[0] + 8.0
        ends.append(bounds[4:])
    return left, min(low for low, _ in ends) - down, max(high for _, high in ends) - down
