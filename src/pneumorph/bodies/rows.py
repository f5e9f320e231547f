"""Rows of chambers on a floor along z, as parts."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from pneumorph.bodies.parts import Part
from pneumorph.bodies.start import LEAST, between, count_of, sizes_of

SHORTEST = 1.0
"""Least length and width of a chamber, mm."""


@dataclass(frozen=True)
class Row:
    """A row of chambers along z on a floor, joined by a channel; with a gap every chamber has walls of its own.

    Attributes
    ----------
    length, width, height : float
        Along z, y and x, mm.
    chambers : int
    wall : float
        Thickness of roof, sides and end walls of the chambers; half of it at least between chambers without a gap, mm.
    gap : float
        Between neighbouring bellows; 0 for chambers in one block with ribs of `rib` between them, mm.
    rib : float
        Thickness of what is between two chambers without a gap, mm.
    floor, channel : float
        Thickness of the floor, and height of the channel on it, which is twice as wide, mm.
    """

    length: float
    width: float
    height: float
    chambers: int
    wall: float
    floor: float
    channel: float
    gap: float = 0.0
    rib: float = 0.0

    @property
    def end(self) -> float:
        """Length of the solid ends, mm."""
        return max(2.0 * self.wall, self.gap)

    @property
    def between(self) -> float:
        """From chamber to chamber, mm."""
        return self.gap + 2.0 * self.wall if self.gap else self.rib

    @property
    def chamber(self) -> float:
        """Length of a chamber, mm."""
        ends = 2.0 * (self.end + self.wall) if self.gap else 2.0 * self.end
        return (self.length - ends - (self.chambers - 1) * self.between) / self.chambers

    def check(self) -> None:
        """Refuse walls that cannot be cast, or leave no room.

        Raises
        ------
        ProblemError
            With the name of a size.
        """
        low = self.height - SHORTEST
        between("channel", self.channel, LEAST, min(low - 2.0 * LEAST, self.width / 2.0 - LEAST), "by height and width")
        between("floor", self.floor, LEAST, low - self.channel - LEAST, "by height")
        narrow = self.width / 2.0 - max(self.channel, SHORTEST / 2.0)
        between("wall", self.wall, LEAST, min(narrow, low - self.floor - self.channel), "by height and width")
        if self.gap:
            between("gap", self.gap, LEAST, self.length / 4.0)
        else:
            between("rib", self.rib, LEAST, self.length / 4.0)
        shortest = self.length - self.chambers * (self.chamber - SHORTEST)
        between("length", self.length, shortest, max(shortest, self.length), f"for {self.chambers} chambers")

    def parts(self, x: float, z: float, turn: float = 0.0) -> list[Part]:
        """The row with the lowest x and z of its floor, mm, turned about z by an angle in degrees."""
        far, inner = self.width / 2.0, self.width / 2.0 - self.wall
        top, roof, floor = x + self.height, x + self.height - self.wall, x + self.floor
        first = z + self.end + (self.wall if self.gap else 0.0)
        starts = [first + number * (self.chamber + self.between) for number in range(self.chambers)]
        stop = starts[-1] + self.chamber
        parts = [Part(True, "box", (x, -far, z, top, far, z + self.length), turn)]
        if self.gap:
            deep = floor + self.channel + self.wall
            for start in starts[1:]:
                begin = start - self.wall - self.gap
                cut = (deep, -far - 1.0, begin, top + 1.0, far + 1.0, begin + self.gap)
                parts.append(Part(False, "box", cut, turn))
        parts += [
            Part(False, "box", (floor, -inner, start, roof, inner, start + self.chamber), turn) for start in starts
        ]
        channel = (floor, -self.channel, first, floor + self.channel, self.channel, stop)
        return [*parts, Part(False, "box", channel, turn)]


def row_of(chambers: int, **sizes: Any) -> Row:
    """A row by its number of chambers, and its sizes with units.

    Raises
    ------
    ProblemError
        For what is no number or no length, and as of `Row.check`.
    """
    row = Row(chambers=count_of("chambers", chambers), **sizes_of(**sizes))
    row.check()
    return row
