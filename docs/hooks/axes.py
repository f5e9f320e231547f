"""The sketch of axes and of the sense of every motion; `python docs/hooks/axes.py` writes docs/images/axes.svg.

A tube from the base at z = 0, drawn at rest and moved, seen from -y and from above: x to the right, y away, z up.
"""

from __future__ import annotations

import math
from pathlib import Path

FILE = Path(__file__).parents[1] / "images" / "axes.svg"

LENGTH, RADIUS, ANGLE = 80.0, 12.0, math.radians(50.0)
PANEL, HEIGHT, FLOOR, SCALE = 200, 250, 190, 1.5

Vector = tuple[float, float, float]

PANELS: dict[str, tuple[Vector, str, Vector]] = {
    "bending_x": ((1.0, 0.0, 0.0), "the tip goes towards -y", (0.0, -1.0, 0.0)),
    "bending_y": ((0.0, 1.0, 0.0), "the tip goes towards +x", (1.0, 0.0, 0.0)),
    "twist": ((0.0, 0.0, 1.0), "counter-clockwise, seen from the tip", (0.0, 0.0, 0.0)),
}
"""Motions: the axis of the rotation, what a positive one does, and where the tip goes."""


def turned(vector: Vector, axis: Vector, angle: float) -> Vector:
    """A vector turned about an axis of length 1, by the right-hand rule."""
    c, s = math.cos(angle), math.sin(angle)
    along = sum(a * b for a, b in zip(axis, vector, strict=True))
    across = (
        axis[1] * vector[2] - axis[2] * vector[1],
        axis[2] * vector[0] - axis[0] * vector[2],
        axis[0] * vector[1] - axis[1] * vector[0],
    )
    x, y, z = (c * v + s * w + (1 - c) * along * a for v, w, a in zip(vector, across, axis, strict=True))
    return x, y, z


def moved(x: float, y: float, z: float, axis: Vector, angle: float = ANGLE) -> Vector:
    """Where a point of the tube goes when the tip turns by an angle, evenly along the tube."""
    steps = 60
    centre = (0.0, 0.0, 0.0)
    for number in range(steps):
        part = turned((0.0, 0.0, z / steps), axis, angle * z / LENGTH * (number + 0.5) / steps)
        centre = (centre[0] + part[0], centre[1] + part[1], centre[2] + part[2])
    around = turned((x, y, 0.0), axis, angle * z / LENGTH)
    return centre[0] + around[0], centre[1] + around[1], centre[2] + around[2]


def projected(point: Vector) -> tuple[float, float]:
    """A point on the paper, in the units of the picture, with the second coordinate downwards."""
    x, y, z = point
    return SCALE * (x + 0.45 * y), -SCALE * (z + 0.35 * y)


def _line(points: list[Vector], style: str, closed: bool = False) -> str:
    places = " ".join(f"{a:.1f},{b:.1f}" for a, b in map(projected, points))
    return f'<{"polygon" if closed else "polyline"} points="{places}" {style}/>'


def _ring(height: float, axis: Vector, angle: float) -> list[Vector]:
    turns = [2 * math.pi * number / 48 for number in range(48)]
    return [moved(RADIUS * math.cos(t), RADIUS * math.sin(t), height, axis, angle) for t in turns]


def _tube(axis: Vector, angle: float, style: str) -> list[str]:
    heights = [LENGTH * number / 8 for number in range(9)]
    lines = [_line(_ring(height, axis, angle), style, closed=True) for height in (heights[0], heights[4], heights[8])]
    for number in range(8):
        t = 2 * math.pi * number / 8
        stripe = [moved(RADIUS * math.cos(t), RADIUS * math.sin(t), height, axis, angle) for height in heights]
        lines.append(_line(stripe, style))
    return lines


def _text(at: tuple[float, float], words: str, more: str = "") -> str:
    return f'<text x="{at[0]:.1f}" y="{at[1]:.1f}" {more}>{words}</text>'


def _axes() -> list[str]:
    lines = []
    for name, end in (("x", (30.0, 0.0, 0.0)), ("y", (0.0, 34.0, 0.0)), ("z", (0.0, 0.0, 106.0))):
        lines.append(_line([(0.0, 0.0, 0.0), end], 'class="axis" marker-end="url(#head)"'))
        a, b = projected(end)
        lines.append(_text((a + 4, b - 4), name, 'class="name"'))
    return lines


def _turn(axis: Vector) -> list[str]:
    """An arrow about the axis of the rotation, by the right-hand rule, around the axis' name."""
    middle = (0.0, 0.0, LENGTH + 14.0) if axis[2] else tuple(20.0 * part for part in axis)
    first = (1.0, 0.0, 0.0) if axis[2] else (0.0, 0.0, 1.0)
    points = []
    for number in range(25):
        offset = turned(first, axis, math.radians(-60.0 + 12.0 * number))
        points.append(tuple(m + 9.0 * o for m, o in zip(middle, offset, strict=True)))
    return [_line(points, 'class="turn" marker-end="url(#head)"')]


def svg() -> str:
    """The text of the sketch."""
    width = PANEL * len(PANELS)
    lines = [
        f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {width} {HEIGHT}" width="{width}" height="{HEIGHT}" '
        'font-family="sans-serif" font-size="12">',
        "<title>Axes, and the sense of bending_x, bending_y and twist</title>",
        "<style>polyline, polygon { fill: none; stroke: #bbbbbb; stroke-width: 0.7 } .moved polyline, .moved polygon "
        "{ stroke: #0072b2 } .axis { stroke: #222222; stroke-width: 1.2 } .turn { stroke: #d55e00; stroke-width: 2 } "
        ".name { font-style: italic } .motion { font-family: monospace; font-weight: bold }</style>",
        '<defs><marker id="head" viewBox="0 0 10 10" refX="8" refY="5" markerWidth="6" markerHeight="6" orient="auto">'
        '<path d="M 0 0 L 10 5 L 0 10 z" fill="context-stroke"/></marker></defs>',
        f'<rect width="{width}" height="{HEIGHT}" fill="#ffffff"/>',
    ]
    for number, (motion, (axis, words, towards)) in enumerate(PANELS.items()):
        a, b = projected(moved(0.0, 0.0, LENGTH, axis))
        middle = PANEL * number + PANEL / 2
        lines += [
            f'<g id="{motion}" data-axis="{axis}" data-towards="{towards}" data-tip="{a:.1f} {b:.1f}" '
            f'transform="translate({middle - 10:g} {FLOOR})">',
            '<g class="rest">',
            *_tube(axis, 0.0, ""),
            "</g>",
            '<g class="moved">',
            *_tube(axis, ANGLE, ""),
            "</g>",
            *_axes(),
            *_turn(axis),
            "</g>",
            _text((middle, HEIGHT - 28), f"{motion} &gt; 0", 'class="motion" text-anchor="middle"'),
            _text((middle, HEIGHT - 11), words, 'text-anchor="middle" font-size="11"'),
        ]
    return "\n".join([*lines, "</svg>", ""])


if __name__ == "__main__":
    FILE.write_text(svg(), encoding="utf-8")
