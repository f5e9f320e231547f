"""Fingers around a palm."""

from __future__ import annotations

import math
from string import ascii_uppercase
from typing import Any

from pneumorph.bodies.parts import Part
from pneumorph.bodies.rows import row_of
from pneumorph.bodies.start import LARGEST, Start, between, count_of, sizes_of, text_with

MOST = 6
"""Largest number of fingers."""


def hand(
    fingers: int = 3,
    opening: Any = "30 mm",
    palm: Any = "8 mm",
    length: Any = "45 mm",
    width: Any = "12 mm",
    height: Any = "12 mm",
    chambers: int = 4,
    wall: Any = "1.75 mm",
    gap: Any = "2 mm",
    floor: Any = "2.5 mm",
    channel: Any = "1.5 mm",
) -> Start:
    """Rows of bellows around a palm, whose floors face each other: inflated, they close on a ball between them.

    The hand is cast with its bellows open towards the middle; the floors are bonded to them. Every finger has a chamber
    of its own.

    Parameters
    ----------
    fingers : int
        Their number, at most 6. The first is at the side of x.
    opening : length with unit
        Diameter of the space between the fingers.
    palm : length with unit
        Its thickness.
    length, width, height : length with unit
        Of a finger, along z, across, and away from the middle.
    chambers : int
        Number of the bellows of a finger.
    wall, gap : length with unit
        Thickness of the walls of the bellows, and distance between two of these.
    floor : length with unit
        Its thickness.
    channel : length with unit
        Height of the channel along the floor; it is twice as wide.

    Returns
    -------
    Start
        Whose `write` writes problem and STEP file.

    Raises
    ------
    ProblemError
        If a size is no length, or leaves no room for others; its message begins with the name of the size.

    Examples
    --------
    >>> path = pm.bodies.hand(fingers=2, length="40 mm").write("pinch")
    >>> [chamber.name for chamber in pm.load(path).body.chamber]
    ['A', 'B']
    """
    around = sizes_of(opening=opening, palm=palm)
    number = count_of("fingers", fingers, MOST)
    row = row_of(chambers, length=length, width=width, height=height, wall=wall, gap=gap, floor=floor, channel=channel)
    inner, thick = around["opening"] / 2.0, around["palm"]
    # Neighbouring fingers do not touch each other.
    closest = 1.2 * row.width / 2.0 / math.tan(math.pi / number) if number > 2 else 2.0
    between("opening", 2.0 * inner, 2.0 * closest, LARGEST, f"for {number} fingers")
    between("palm", thick, 2.0, LARGEST)
    outer = math.hypot(inner + row.height, row.width / 2.0)
    parts = [Part(True, "cylinder", (0.0, 0.0, 0.0, outer, thick))]
    tables, pressures = [], []
    for finger, name in enumerate(ascii_uppercase[:number]):
        angle = 360.0 * finger / number
        parts += row.parts(inner, thick, angle)
        away, z = inner + row.floor + row.channel / 2.0, thick + row.length / 2.0
        x, y = away * math.cos(math.radians(angle)), away * math.sin(math.radians(angle))
        pressures.append(f'{name} = "40 kPa"')
        tables.append(f'[[body.chamber]]\nname = "{name}"\ninside = ["{x:.3f} mm", "{y:.3f} mm", "{z:.3f} mm"]\n')
    ball, fold = inner - 1.0, 0.5 * min(row.gap, row.channel, row.wall)
    text = text_with(
        "hand",
        {"chambers": "\n".join(tables), "pressure": ", ".join(pressures)}
        | {"ball": ball, "middle": thick + 0.65 * row.length}
        | {"size": max(2.0 * row.wall, 2.0), "spacing": max(row.height / 2.0, 4.0)}
        | {"least": 0.75 * min(row.wall, row.floor), "fold": fold, "touch": 0.4 * fold}
        | {"near": 2.0 * fold, "reach": 1.1 * outer},
    )
    return Start(text, tuple(parts))
