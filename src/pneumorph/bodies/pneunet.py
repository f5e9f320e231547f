"""A row of chambers in one block on a floor (PneuNet)."""

from __future__ import annotations

from typing import Any

from pneumorph.bodies.rows import Row, row_of
from pneumorph.bodies.start import Start, text_with


def pneunet(
    length: Any = "60 mm",
    width: Any = "16 mm",
    height: Any = "13 mm",
    chambers: int = 7,
    wall: Any = "2 mm",
    rib: Any = "2 mm",
    floor: Any = "3 mm",
    channel: Any = "2 mm",
) -> Start:
    """A row of chambers in one block on a floor (PneuNet; Ilievski et al. 2011): it bends towards the floor.

    It is cast in two parts, the block with its chambers open below and the floor, which are then bonded.

    Parameters
    ----------
    length, width, height : length with unit
        Along z, y and x.
    chambers : int
        Their number.
    wall : length with unit
        Thickness of roof and side walls.
    rib : length with unit
        Thickness of what is between neighbouring chambers.
    floor : length with unit
        Its thickness.
    channel : length with unit
        Height of the channel along the floor that joins the chambers; it is twice as wide.

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
    >>> path = pm.bodies.pneunet(length="50 mm", chambers=5).write("block")
    >>> pm.load(path).body.length
    50.0
    """
    row = row_of(chambers, length=length, width=width, height=height, wall=wall, rib=rib, floor=floor, channel=channel)
    least = min(row.wall, row.rib, row.floor)
    return bender("block", row, least, min(row.channel, row.wall), pressure=15.0)


def bender(what: str, row: Row, wall: float, gap: float, pressure: float) -> Start:
    """A row that bends towards its floor, with its problem.

    Parameters
    ----------
    what : "block" or "bellows".
    row : its sizes.
    wall, gap : the least wall, and the least distance of faces that are opposite across a void, mm.
    pressure : kPa.
    """
    sizes = {"length": row.length, "low": -row.height / 2.0, "high": row.height / 2.0, "far": row.width / 2.0}
    limits = {"wall": 0.75 * wall, "fold": 0.5 * gap, "near": gap, "spacing": max(row.height / 3.0, 4.0)}
    shown = {"what": what, "pressure": pressure, "size": max(1.75 * row.wall, 2.0)}
    return Start(text_with("pneunet", limits | shown, sizes), tuple(row.parts(-row.height / 2.0, 0.0)))
