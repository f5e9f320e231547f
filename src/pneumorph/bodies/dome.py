"""A hollow half ball on a plate."""

from __future__ import annotations

from typing import Any

from pneumorph.bodies.parts import Part
from pneumorph.bodies.start import LARGEST, LEAST, Start, between, sizes_of, text_with


def dome(radius: Any = "20 mm", wall: Any = "3 mm", floor: Any = "4 mm", boss: Any = "5 mm") -> Start:
    """A hollow half ball on a plate, with a flat boss on its top: inflated, it lifts what is on the boss.

    It is cast in two parts, the half ball open below and the plate, which are then bonded.

    Parameters
    ----------
    radius : length with unit
        Of the outside.
    wall : length with unit
        Thickness of the half ball.
    floor : length with unit
        Thickness of the plate.
    boss : length with unit
        Radius of the boss.

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
    >>> path = pm.bodies.dome(radius="15 mm").write("lift")
    >>> pm.load(path).task[0].name
    'lift'
    """
    sizes = sizes_of(radius=radius, wall=wall, floor=floor, boss=boss)
    outer, thick, low, top = sizes.values()
    between("wall", thick, LEAST, 0.5 * outer, "half the radius")
    between("floor", low, LEAST, LARGEST)
    between("boss", top, 1.0, outer - thick, "the radius of the chamber")
    # The boss begins within the wall: its rim is where the ball is lower.
    begin, reach, middle = low + outer - thick / 2.0, outer + 1.0, (0.0, 0.0, low)
    parts = (
        Part(True, "ball", (*middle, outer)),
        Part(True, "cylinder", (0.0, 0.0, begin, top, thick)),
        Part(False, "ball", (*middle, outer - thick)),
        Part(False, "box", (-reach, -reach, -reach, reach, reach, low)),
        Part(True, "cylinder", (0.0, 0.0, 0.0, outer, low)),
    )
    height = begin + thick
    limits = {"least": 0.6 * min(thick, low), "spacing": max(outer / 4.0, 1.5 * thick), "size": max(thick, 1.5)}
    return Start(text_with("dome", {"far": 1.05 * outer} | limits, {"height": height}), parts)
