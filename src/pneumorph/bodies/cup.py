"""A suction cup."""

from __future__ import annotations

import math
from typing import Any

from pneumorph.bodies.parts import Part
from pneumorph.bodies.start import LARGEST, LEAST, Start, between, sizes_of, text_with


def cup(
    radius: Any = "15 mm",
    depth: Any = "6 mm",
    wall: Any = "2 mm",
    stem: Any = "5 mm",
    stem_length: Any = "5 mm",
) -> Start:
    """A conical suction cup on a stem, below a plate that it holds by vacuum.

    It is cast in one piece between two halves of a mould; the hole for the vacuum is drilled through the stem.

    Parameters
    ----------
    radius : length with unit
        Of the lip.
    depth : length with unit
        Of the space below the plate.
    wall : length with unit
        Thickness of the cone.
    stem, stem_length : length with unit
        Radius and length of the stem, whose end is clamped.

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
    >>> path = pm.bodies.cup(radius="12 mm").write("cup")
    >>> pm.load(path).body.chamber[0].seal
    'plate'
    """
    sizes = sizes_of(radius=radius, depth=depth, wall=wall, stem=stem, stem_length=stem_length)
    lip, deep, thick, foot, long = sizes.values()
    between("stem", foot, 1.0, 0.8 * lip, "below the radius")
    top = long + thick + deep
    slope = (lip - foot) / (top - long)
    rim = thick * math.hypot(1.0, slope)
    inner = foot + slope * thick - rim
    between("wall", thick, LEAST, 0.5 * deep, "half the depth")
    between("depth", deep, 2.0 * thick, LARGEST)
    if inner < 1.0:
        between("stem", foot, foot + 1.0 - inner, LARGEST, "so that the space below the plate is 1 mm wide")
    corners = [(0.0, 0.0), (foot, 0.0), (foot, long), (lip, top)]
    corners += [(lip - rim, top), (inner, long + thick), (0.0, long + thick)]
    part = Part(True, "turned", tuple(value for corner in corners for value in corner))
    touch = 0.2 * thick
    values = {"inside": top - 0.5 * deep, "plate": top + touch, "touch": touch, "size": max(1.5 * thick, 1.5)}
    values |= {"far": 1.05 * lip, "pull": 0.05 * lip, "least": 0.75 * thick, "spacing": max(0.2 * lip, 1.5 * thick)}
    return Start(text_with("cup", values, {"top": top}), (part,))
