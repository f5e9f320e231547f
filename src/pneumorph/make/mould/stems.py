"""Stems: the round bars that hold the cores in the mould. Where one leaves the rubber, a port or a hole to close stays.

A chamber that can be reached from below gets its stem through the base, because the base is clamped and its stiffness
does not matter there. Otherwise the stem leaves through the side, near the chamber's base.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray

from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.make.mould.samples import Samples

Array = NDArray[np.float64]
Way = Literal["base", "side", "tip"]
Plane = tuple[Array, float]
"""A vertical plane: its unit normal (3,), and its distance from the axis along the normal in mm."""

INTO = 0.6
"""Length in mm by which a stem reaches into its chamber."""

_ANGLES = np.linspace(0.0, 2.0 * np.pi, 24, endpoint=False)


@dataclass(frozen=True, eq=False)
class Stem:
    """A round bar from the inside of a chamber to the outside of the mould.

    Attributes
    ----------
    chamber : str
    way : "base", "side" or "tip"
        Where it leaves the body.
    start : (3,) array
        The centre of its end inside the chamber, mm.
    direction : (3,) array
        Unit vector out of the body.
    wall : float
        Length in mm of rubber that it passes through.
    closed : bool
        Whether the hole is closed after casting; otherwise it is the port.
    """

    chamber: str
    way: Way
    start: Array
    direction: Array
    wall: float
    closed: bool

    @property
    def angle(self) -> float:
        """Direction of a stem through the side, in radians about z."""
        return float(np.arctan2(self.direction[1], self.direction[0]))


@dataclass(frozen=True, eq=False)
class Room:
    """What the stems of a body have to keep away from.

    Attributes
    ----------
    body : Body
        Of tubes, as it is before curing.
    samples : sequence of Samples
        Of all surfaces, the exterior first. A chamber is given by its index in there, from 1.
    radius : float
        Of the stems, mm.
    wall : float
        Rubber that must remain between a stem and everything else, mm.
    """

    body: Body
    samples: Sequence[Samples]
    radius: float
    wall: float


def ports(room: Room) -> list[Stem]:
    """One port for every chamber.

    Raises
    ------
    ComputationError
        If a chamber can be reached neither from below nor from the side.
    """
    chambers = room.body.chambers
    stem_of: list[Stem | None] = [upright(room, number, tip=False) for number in range(1, len(chambers) + 1)]
    rest = [number for number, stem in enumerate(stem_of, start=1) if stem is None]
    if rest:
        # One angle for all chambers on the axis, so that few partings are needed.
        options = {angle: [_sideways(room, number, angle) for number in rest] for angle in _ANGLES}
        missing = {angle: sum(stem is None for stem in stems) for angle, stems in options.items()}
        best = min(options, key=lambda angle: (missing[angle], sum(s.wall for s in options[angle] if s is not None)))
        for number, stem in zip(rest, options[best], strict=True):
            other = next((s for a in _ANGLES if (s := options[a][rest.index(number)]) is not None), None)
            stem_of[number - 1] = stem or other
    for chamber, stem in zip(chambers, stem_of, strict=True):
        if stem is None:
            height = chamber.net[:, :, 2].min()
            raise ComputationError(
                f"chamber {chamber.name} cannot get a port of {2 * room.radius:.2g} mm: at z = {height:.0f} mm there "
                f"is no straight way out of it with {room.wall:.2g} mm of rubber around the port; take a thinner "
                "make.tube"
            )
    return [stem for stem in stem_of if stem is not None]


def port_in_plane(room: Room, number: int, plane: Plane) -> Stem | None:
    """The port of a chamber with its axis in a plane; None if no straight way is free."""
    stem = upright(room, number, tip=False, plane=plane)
    normal, offset = plane
    middle = room.samples[number].points.mean(axis=0)
    origin = middle[:2] + (offset - middle @ normal) * normal[:2]
    ahead = float(np.arctan2(normal[0], -normal[1]))  # across the normal
    for angle in (ahead, ahead + np.pi):
        stem = stem or _sideways(room, number, angle, origin=origin)
    return stem


def upright(room: Room, number: int, tip: bool, plane: Plane | None = None) -> Stem | None:
    """The stem of a chamber along z, through the base or the tip; None if no straight way is free.

    That through the tip only supports the core, and its hole is closed after casting.

    Parameters
    ----------
    room : Room
    number : int
        Of the chamber.
    tip : bool
        Whether it goes through the tip, not through the base.
    plane : Plane, optional
        In which its axis is.
    """
    chamber, samples, radius = room.body.chambers[number - 1], room.samples, room.radius
    own, length = samples[number].points, float(samples[0].points[:, 2].max())
    sign = 1.0 if tip else -1.0
    rim = chamber.sample(np.linspace(0.0, 1.0, 200, endpoint=False), [float(tip)])[0]
    place, height = rim[0, :2], float(rim[0, 2])
    if not chamber.poles[int(tip)]:
        place, widest = roomiest(rim[:, :2]) if plane is None else _roomiest_along(rim[:, :2], plane)
    else:
        if plane is not None:
            place = place + (plane[1] - place @ plane[0][:2]) * plane[0][:2]
        # A stem ends where all of it is inside the dome.
        near = own[np.hypot(*(own[:, :2] - place).T) <= radius]
        near = near[sign * (height - near[:, 2]) < (own[:, 2].max() - own[:, 2].min()) / 2.0]
        widest = radius + 1.0
        height = float(min(near[:, 2]) if tip else max(near[:, 2])) if len(near) else height
    if widest < radius + 0.1:
        return None
    end = length if tip else 0.0
    for other, one in enumerate(samples):
        if other == number:
            continue
        points = one.closed if other else one.points  # the stem passes through the ends of the exterior
        beyond = points[sign * (points[:, 2] - height) > 0.0]
        if len(beyond) and np.hypot(*(beyond[:, :2] - place).T).min() < radius + room.wall:
            return None
    start = np.array([*place, height - sign * INTO])
    return Stem(chamber.name, "tip" if tip else "base", start, np.array([0.0, 0.0, sign]), abs(end - height), tip)


def support(room: Room, number: int, angles: Sequence[float]) -> Stem | None:
    """A second stem, which holds the upper end of a core: through the tip, or else through the side; None without room.

    The angles of partings in rad are tried first.
    """
    straight = upright(room, number, tip=True)
    if straight is not None:
        return straight
    options = (_sideways(room, number, angle, top=True) for angle in (*angles, *_ANGLES))
    return next((stem for stem in options if stem is not None), None)


def _sideways(room: Room, number: int, angle: float, top: bool = False, origin: Array | None = None) -> Stem | None:
    """A stem along a line at an angle, as near to an end of the chamber as there is room for it.

    At the base it is the port; at the top it only supports the core, and its hole is closed after casting. The line
    passes through the axis, or above a point (x, y).
    """
    samples, radius, own = room.samples, room.radius, room.samples[number]
    direction, across = np.array([np.cos(angle), np.sin(angle), 0.0]), np.array([-np.sin(angle), np.cos(angle), 0.0])
    low, high = own.points[:, 2].min(), own.points[:, 2].max()
    heights = np.arange(low + radius + INTO, min(high - radius - INTO, low + 0.6 * (high - low)), 0.5)
    for height in low + high - heights if top else heights:
        ring = own.points[np.abs(own.points[:, 2] - height) < radius]
        line = np.array([*(np.zeros(2) if origin is None else origin), height])
        middle = ring.mean(axis=0) - line
        if origin is None and abs(middle @ across) > 0.2 * radius and np.hypot(*middle[:2]) > 0.5:
            return None  # a line through the axis at this angle passes beside the chamber
        along, aside = (ring - line) @ direction, (ring - line) @ across
        if min(aside.max(), -aside.min()) < radius + INTO:
            continue
        outer, inner = _crossing(samples[0], line, direction, radius), along[np.abs(aside) < radius]
        if outer is None or not len(inner[inner > middle @ direction]):
            continue
        start = max(float(middle @ direction), 0.0)
        inner_end = float(inner[inner > middle @ direction].min())
        others = [one.closed for other, one in enumerate(samples) if other not in (0, number)]
        if any(_distance(points, line, direction, start).min() < radius + room.wall for points in others):
            continue
        start_point = line + direction * (inner_end - INTO)
        name = room.body.chambers[number - 1].name
        return Stem(name, "side", start_point, direction, outer - inner_end, closed=top)
    return None


def _crossing(exterior: Samples, line: Array, direction: Array, radius: float) -> float | None:
    """Distance from the axis at which a line leaves the body; None if the body is folded there."""
    gap = exterior.points - line
    along = gap @ direction
    near = np.linalg.norm(gap - along[:, None] * direction, axis=1) < radius
    near &= along > 0.0
    if not near.any() or (exterior.normal.reshape(-1, 3)[near] @ direction).min() <= 0.0:
        return None
    return float(along[near].max())


def _distance(points: Array, line: Array, direction: Array, start: float) -> Array:
    """Distances (n,) of points from the half line that begins `start` mm from `line`."""
    gap = points - line
    along = np.maximum(gap @ direction, start)
    return np.linalg.norm(gap - along[:, None] * direction, axis=1)


def roomiest(polygon: Array) -> tuple[Array, float]:
    """Centre and radius of a largest circle inside a closed polygon (n, 2), by a search on finer and finer grids."""
    centre, step = polygon.mean(axis=0), np.ptp(polygon, axis=0).max() / 2.0
    best = depths(centre[None], polygon)[0]
    while step > 1e-3:
        offsets = np.linspace(-step, step, 9)
        tried = centre + np.stack(np.meshgrid(offsets, offsets), axis=-1).reshape(-1, 2)
        depth = depths(tried, polygon)
        if depth.max() > best:
            centre, best = tried[int(np.argmax(depth))], float(depth.max())
        step /= 3.0
    return centre, float(best)


def _roomiest_along(polygon: Array, plane: Plane) -> tuple[Array, float]:
    """Centre and radius of a largest circle inside a closed polygon (n, 2) whose centre is in a plane."""
    (a, b, _), offset = plane
    line = np.array([-b, a])
    reach = polygon @ line
    tried = offset * np.array([a, b]) + np.linspace(reach.min(), reach.max(), 400)[:, None] * line
    room = depths(tried, polygon)
    best = int(np.argmax(room))
    return tried[best], float(room[best])


def depths(points: Array, polygon: Array) -> Array:
    """Distances (n,) of points from a polygon's edges; negative outside it."""
    start, way = polygon, np.roll(polygon, -1, axis=0) - polygon
    gap = points[:, None] - start
    share = np.clip(np.einsum("nec,ec->ne", gap, way) / np.maximum((way**2).sum(axis=1), 1e-300), 0.0, 1.0)
    away = np.linalg.norm(gap - share[..., None] * way, axis=2).min(axis=1)
    angle = np.arctan2(*np.moveaxis(start - points[:, None], -1, 0)[::-1])
    turns = (np.diff(angle, axis=1, append=angle[:, :1]) + np.pi) % (2.0 * np.pi) - np.pi
    return np.where(np.abs(turns.sum(axis=1)) > np.pi, away, -away)
