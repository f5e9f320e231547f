"""A row of bellows on a floor (fast PneuNet)."""

from __future__ import annotations

from typing import Any

from pneumorph.bodies.pneunet import bender
from pneumorph.bodies.rows import row_of
from pneumorph.bodies.start import Start


def fast_pneunet(
    length: Any = "80 mm",
    width: Any = "16 mm",
    height: Any = "18 mm",
    chambers: int = 7,
    wall: Any = "1.75 mm",
    gap: Any = "2 mm",
    floor: Any = "3 mm",
    channel: Any = "2 mm",
) -> Start:
    """A row of bellows on a floor (fast PneuNet; Mosadegh et al. 2014): it bends farther at a lower pressure.

    It is cast in two parts, the bellows open below and the floor, which are then bonded.

    Parameters
    ----------
    length, width, height : length with unit
        Along z, y and x.
    chambers : int
        Their number.
    wall : length with unit
        Thickness of the walls of the bellows.
    gap : length with unit
        Between neighbouring bellows.
    floor : length with unit
        Its thickness.
    channel : length with unit
        Height of the channel along the floor that joins the bellows; it is twice as wide.

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
    >>> path = pm.bodies.fast_pneunet(wall="1.5 mm").write("finger")
    >>> [chamber.name for chamber in pm.load(path).body.chamber]
    ['A']
    """
    row = row_of(chambers, length=length, width=width, height=height, wall=wall, gap=gap, floor=floor, channel=channel)
    least = min(row.wall, row.floor)
    return bender("bellows", row, least, min(row.gap, row.channel, row.wall), pressure=40.0)
