"""Bodies to start from, as STEP files: rows of bellows that bend (PneuNets), and domes."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import NamedTuple

from pneumorph.cad.netgen_process import call


class Part(NamedTuple):
    """What is added to a body or cut out of it.

    Attributes
    ----------
    added : bool
    kind : "box", with two opposite corners; "cylinder" along z, with the centre of its lower end, radius and height; or
        "ball", with centre and radius
    numbers : tuple of float
        mm.
    """

    added: bool
    kind: str
    numbers: tuple[float, ...]


@dataclass(frozen=True)
class Pneunet:
    """A row of bellows along z on a floor at the lowest x: it bends towards the floor (Mosadegh et al. 2014).

    All lengths are in mm. One channel along the floor joins the chambers.

    Attributes
    ----------
    length, width, height : along z, y and x.
    chambers : their number.
    wall : thickness of the walls of the chambers.
    gap : between neighbouring bellows.
    floor : thickness of the floor.
    channel : height of the channel; it is twice as wide.
    """

    length: float = 80.0
    width: float = 16.0
    height: float = 18.0
    chambers: int = 7
    wall: float = 1.75
    gap: float = 2.0
    floor: float = 3.0
    channel: float = 2.0

    def parts(self) -> list[Part]:
        """The body; ValueError if walls leave no room."""
        end = max(2.0 * self.wall, self.gap)
        pitch = (self.length - 2.0 * end + self.gap) / self.chambers
        slot = self.floor + self.channel + self.wall
        deep, wide = self.height - self.wall - self.floor, self.width - 2.0 * self.wall
        if min(pitch - self.gap - 2.0 * self.wall, deep - self.channel, wide - 2.0 * self.channel) <= 0.0:
            raise ValueError("walls, gaps and channel leave no room for chambers; make them thinner or the body larger")
        far, low = self.width / 2.0, -self.height / 2.0
        found = [Part(True, "box", (low, -far, 0.0, -low, far, self.length))]
        for number in range(self.chambers):
            start = end + number * pitch
            if number:
                cut = (low + slot, -far - 1.0, start - self.gap, 1.0 - low, far + 1.0, start)
                found.append(Part(False, "box", cut))
        for number in range(self.chambers):
            start, stop = end + number * pitch + self.wall, end + (number + 1) * pitch - self.gap - self.wall
            void = (low + self.floor, -wide / 2.0, start, -low - self.wall, wide / 2.0, stop)
            found.append(Part(False, "box", void))
        along = end + self.wall, end + self.chambers * pitch - self.gap - self.wall
        channel = (low + self.floor, -self.channel, along[0], low + self.floor + self.channel, self.channel, along[1])
        return [*found, Part(False, "box", channel)]


@dataclass(frozen=True)
class Dome:
    """A hollow half ball on a plate, with a flat boss on its top.

    All lengths are in mm.

    Attributes
    ----------
    radius : of the outside.
    wall : thickness of the half ball.
    floor : thickness of the plate.
    boss : radius of the boss.
    """

    radius: float = 20.0
    wall: float = 3.0
    floor: float = 4.0
    boss: float = 5.0

    def parts(self) -> list[Part]:
        """The body; ValueError if the wall leaves no room."""
        if self.wall >= self.radius or self.boss >= self.radius - self.wall:
            raise ValueError("the wall or the boss leaves no room for a chamber; make it smaller or the radius larger")
        middle = (0.0, 0.0, self.floor)
        # The boss begins within the wall: its rim is where the ball is lower.
        begin = self.floor + self.radius - self.wall / 2.0
        reach = self.radius + 1.0
        return [
            Part(True, "ball", (*middle, self.radius)),
            Part(True, "cylinder", (0.0, 0.0, begin, self.boss, self.wall)),
            Part(False, "ball", (*middle, self.radius - self.wall)),
            Part(False, "box", (-reach, -reach, -reach, reach, reach, self.floor)),
            Part(True, "cylinder", (0.0, 0.0, 0.0, self.radius, self.floor)),
        ]


def write_step(body: Pneunet | Dome, path: Path) -> None:
    """Write a body as a STEP file.

    Raises
    ------
    ValueError
        If its sizes leave no room for chambers.
    ComputationError
        If it cannot be made or written.
    """
    call("compose", body.parts(), str(path), seconds=60.0)
