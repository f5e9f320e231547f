"""A layout: chambers in a certain arrangement, and how bodies of it are drawn."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any, TypeVar

import numpy as np

from pneumorph.proposals.target import Target

MARGIN = 1.05
"""Walls of a start over the least that is allowed."""


T = TypeVar("T")


class NoRoom(Exception):
    """A body that was drawn does not fit into the space; the message says what is missing."""


class Draws:
    """The choices of one candidate, each made by the next of a sequence of numbers in [0, 1).

    Bodies of a layout ask for equally many in the same order whatever is chosen, so that the numbers are coordinates of
    the layout's bodies.
    """

    def __init__(self, numbers: Iterator[float]):
        self._numbers = numbers

    def between(self, low: float, high: float) -> float:
        """A number of an interval."""
        return low + (high - low) * next(self._numbers)

    def one_of(self, choices: Sequence[T]) -> T:
        """One of several things."""
        return choices[int(len(choices) * next(self._numbers))]


@dataclass(frozen=True)
class Drawn:
    """A body that was drawn.

    Attributes
    ----------
    tables : {key: table}
        Those of a problem file that describe the body: body, and membrane and fibres where it has them.
    places : {chamber: (2,) array}
        Where each chamber is beside the axis, in parts of the radius; at the origin those on it.
    symmetries : list of tables
        Symmetries that the body has, the one that asks least of the computation first.
    radius : float
        Of the body, mm.
    words : str
        What was drawn, in a few words.
    """

    tables: Mapping[str, Any]
    places: Mapping[str, np.ndarray]
    symmetries: tuple[Mapping[str, Any], ...]
    radius: float
    words: str = field(default="")


@dataclass(frozen=True)
class Layout:
    """A layout.

    Attributes
    ----------
    name : str
    words : str
        What it is.
    unsuited : function of the target
        Why no body of this layout can do what is asked, as a sentence; empty if nothing is known against it.
    draw : function of the target and of draws
        A body. Raises NoRoom.
    """

    name: str
    words: str
    unsuited: Callable[[Target], str]
    draw: Callable[[Target, Draws], Drawn]


def mm(value: float) -> str:
    """A length as it is written in a file: a tenth of a micrometre is nothing."""
    return f"{round(value, 4) + 0.0:g} mm"


def tube(target: Target, draws: Draws, rings: bool = True, least: float = 0.55) -> tuple[dict[str, Any], float]:
    """The table of a round body with or without rings, and its radius in mm.

    Parameters
    ----------
    target, draws : what is asked, and random numbers.
    rings : whether it may have rings, from which folds grow.
    least : of its radius over that of the space.
    """
    length, radius = target.space.length, draws.between(least, 0.85) * target.space.round
    body: dict[str, Any] = {"length": mm(length), "radius": mm(radius)}
    density = 3.0 / radius
    period = length / max(2, round(length / (draws.between(0.8, 1.6) * radius)))
    has_rings, height = draws.one_of((True, True, False)), draws.one_of((0.025, 0.05, 0.1))
    if rings and has_rings:
        # The largest curvature of a ring is half of what the limit allows, and its slope that of a gentle wave.
        steepest = 0.5 * np.sqrt(2.0 * target.limits.curvature) * (period / (2.0 * np.pi)) ** 2
        amplitude = min(height * radius, steepest, 0.05 * period)
        body["ripple"] = {"amplitude": mm(amplitude), "period": mm(period)}
        density = max(density, 5.0 / period)
    return body | {"control_density": f"{density:.3g} /mm"}, radius


def fitting(target: Target, radius: float, wanted: float, beside: float = 0.0) -> float:
    """The radius of a chamber that keeps its wall, mm: at most what is wanted.

    Raises
    ------
    NoRoom
        If the walls leave it less than a quarter of a wall.
    """
    wall = MARGIN * target.limits.wall
    largest = radius - wall - beside
    if largest < 0.25 * wall:
        raise NoRoom(f"walls of {target.limits.wall:g} mm leave no chamber in a body of radius {radius:.3g} mm")
    return min(wanted, largest)


def ends_of(target: Target) -> tuple[float, float]:
    """From where to where a chamber along the whole body goes, mm."""
    end = 1.5 * target.limits.wall
    if target.space.length < 4.0 * end:
        raise NoRoom(f"ends of {end:g} mm leave no chamber in a body {target.space.length:g} mm long")
    return end, target.space.length - end


def span(target: Target) -> list[str]:
    """The same as it is written in a file."""
    return [mm(each) for each in ends_of(target)]


def chamber(name: str, radius: float, center: np.ndarray, along: list[str]) -> dict[str, Any]:
    """The table of a chamber."""
    return {"name": name, "radius": mm(radius), "center": [mm(each) for each in center], "span": along}


def letters(count: int) -> str:
    """Names of chambers."""
    return "ABCDEFGH"[:count]


ON_AXIS = np.zeros(2)
MIRRORS = ({"mirror": ["xz", "yz"]}, {"mirror": ["xz"]}, {"mirror": ["yz"]}, {})
"""Symmetries of what lies on the axis."""
