"""Wedges of a body between half-planes that begin at the axis, and what keeps designs to their sides of them.

A surface around the axis crosses such a half-plane along a line q = const. The columns of control points on which the
line depends keep their distance from its plane, with which the line is in the plane for every design, and stay on this
side of the axis. Every other control point keeps to a cone about its place in the wedge, so that any four in a row are
on one side of a plane through the axis that has no half-plane of the wedge's edges behind it: by the convex hulls of
its spans, the surface between the lines stays in the wedge.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root_scalar

from pneumorph.geometry.body import Body
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.problem.regions import REST
from pneumorph.problem.wedges import crosses, edges, gap_around, gaps

if TYPE_CHECKING:
    from pneumorph.problem import BodySpec, Problem, Region

Array = NDArray[np.float64]

_NOTHING = 1e-9
"""Values of B-splines, angles and parameters up to this do not count."""


@dataclass(frozen=True)
class Wedge:
    """A part of the body between two half-planes.

    Attributes
    ----------
    region : str
        The name of its region, `REST` if it has none.
    start, end : float
        From which angle to which it reaches, rad.
    parts : {surface: (float, float)}
        From which q to which surfaces reach through it that cross its half-planes, which may pass q = 1; (0, 1) of
        surfaces that are wholly in it. Others are not in it.
    """

    region: str
    start: float
    end: float
    parts: Mapping[str, tuple[float, float]]

    def covers(self, surface: str, q: Array) -> NDArray[np.bool_]:
        """Whether points of a surface are in it."""
        if surface not in self.parts:
            return np.zeros(q.shape, bool)
        first, last = self.parts[surface]
        return (q - first) % 1.0 <= last - first


def build_wedges(spec: BodySpec, regions: Sequence[Region]) -> tuple[Wedge, ...]:
    """The wedges of a body around the axis, those of no region included; none if no region has angles."""
    angles = edges(spec, regions)
    if not angles:
        return ()
    start, wedges = starting_body(spec), []
    for first, last in gaps(angles):
        parts = {}
        for surface, cut in zip(start.surfaces, _cut(spec), strict=True):
            if cut:
                # q runs the other way around a chamber.
                low, high = (_line(surface, angle) for angle in ((last, first) if surface.cavity else (first, last)))
                parts[surface.name] = (low, high if high > low else high + 1.0)
            elif _within(surface, first, last):
                parts[surface.name] = (0.0, 1.0)
        names = [region.name for region in regions if region.within and _inside(region.within, (first + last) / 2.0)]
        wedges.append(Wedge(names[0] if names else REST, first, last, parts))
    return tuple(wedges)


@dataclass(frozen=True, eq=False)
class Cones:
    """What places control points (n_r, n_q) of a surface may have across the axis, in turned coordinates.

    Attributes
    ----------
    angle : (n_r, n_q)
        Of the first coordinate's direction from x, rad; the second one is a quarter turn ahead.
    fixed : (n_r, n_q, 2)
        Which coordinates are those of the start.
    low, high : (n_r, n_q, 2)
        Bounds of the others, mm.
    """

    angle: Array
    fixed: NDArray[np.bool_]
    low: Array
    high: Array


def cones_of(problem: Problem, body: Body) -> tuple[Cones, ...]:
    """What keeps the surfaces of designs to their sides of all half-planes, and of the images of these.

    `body` is the starting body of the problem.

    Chambers beside the axis stay as far from them as from each other, by `limits.wall`.
    """
    spec, wall = problem.tubes, problem.limits.wall
    angles = edges(spec, problem.region, images=True)
    cones = []
    for surface, cut in zip(body.surfaces, _cut(spec), strict=True):
        shape = surface.net.shape[:2]
        if not angles:
            free = np.full((*shape, 2), np.inf)
            cones.append(Cones(np.zeros(shape), np.zeros((*shape, 2), bool), -free, free))
        elif cut:
            cones.append(_around(surface, angles))
        else:
            x, y, _ = surface.net.mean(axis=(0, 1))
            start, end = gap_around(angles, (x, y), across=False)
            apex = wall / math.sin((end - start) / 2.0) * _direction((start + end) / 2.0)
            angle, low, high = _cones(surface.net[..., :2] - apex, start, end)
            shift = _turned(np.broadcast_to(apex, (*shape, 2)), angle)
            # Waves may start nearer than the wall; they come no nearer then.
            low = np.minimum(low + shift, _turned(surface.net[..., :2], angle))
            cones.append(Cones(angle, np.zeros((*shape, 2), bool), low, high + shift))
    return tuple(cones)


def _around(surface: TubeSurface, angles: Sequence[float]) -> Cones:
    """What keeps a surface around the axis to its sides."""
    rows, columns = surface.net.shape[:2]
    angle, fixed = np.zeros((rows, columns)), np.zeros((rows, columns, 2), bool)
    low, high = np.empty((rows, columns, 2)), np.empty((rows, columns, 2))
    for column, (x, y, _) in enumerate(surface.net[rows // 2]):
        where = gap_around(angles, (x, y))
        angle[:, column], low[:, column], high[:, column] = _cones(surface.net[:, column, :2], *where)
    for (before, edge), (_, after) in zip(gaps([angles[-1] - 2.0 * math.pi, *angles[:-1]]), gaps(angles), strict=True):
        line = surface.basis_q.matrix(np.array([_line(surface, edge)]))[0] > _NOTHING
        angle[:, line], fixed[:, line, 1] = edge, True
        aside = _turned(surface.net[:, line, :2], np.full((rows, 1), edge))[..., 1]
        # Neither behind the axis nor, in narrow wedges, beyond the next half-plane.
        slopes = [1.0 / math.tan(width) if width < math.pi / 2.0 else 0.0 for width in (edge - before, after - edge)]
        low[:, line, 0] = np.maximum(np.maximum(-aside * slopes[0], aside * slopes[1]), 0.0)
        low[:, line, 1], high[:, line] = -np.inf, np.inf
    # Discs have their centres, and poles are, where the half-planes meet.
    angle[[0, -1]], fixed[[0, -1]] = 0.0, True
    return Cones(angle, fixed, low, high)


def _cones(places: Array, start: float, end: float) -> tuple[Array, Array, Array]:
    """A cone with an orthogonal frame about each place (..., 2), within that of two angles about the origin.

    Between opposite half-planes it is all on this side, in wider gaps a quadrant, and in narrow ones a box.

    Returns
    -------
    angle : (...)
        Of the frame's first direction.
    low, high : (..., 2)
        Bounds in the frame.
    """
    width, middle = end - start, (start + end) / 2.0
    low, high = np.zeros(places.shape), np.full(places.shape, np.inf)
    if abs(width - math.pi) < 1e-6:
        low[..., 0] = -np.inf
        return np.full(places.shape[:-1], start), low, high
    if width >= math.pi / 2.0:
        own = middle + (np.arctan2(places[..., 1], places[..., 0]) - middle + math.pi) % (2.0 * math.pi) - math.pi
        return np.clip(own, start + math.pi / 4.0, end - math.pi / 4.0) - math.pi / 4.0, low, high
    # The widest margin that all sides of the box can have.
    along, aside = np.moveaxis(_turned(places, np.full(places.shape[:-1], middle)), -1, 0)
    slope = math.tan(width / 2.0)
    low[..., 0] = along - (along * slope - np.abs(aside)) / (1.0 + slope)
    high[..., 1] = low[..., 0] * slope
    low[..., 1] = -high[..., 1]
    return np.full(places.shape[:-1], middle), low, high


def _line(surface: TubeSurface, angle: float) -> float:
    """q, from 0 to 1, of the line along which a surface of the starting body around the axis is in a half-plane."""
    net, count = surface.net[len(surface.net) // 2, :, :2], surface.net.shape[1]
    near = (-angle if surface.cavity else angle) / (2.0 * math.pi)

    def aside(q: float) -> float:
        return float((surface.basis_q.matrix(np.array([q])) @ net)[0] @ _direction(angle + math.pi / 2.0))

    q = root_scalar(aside, bracket=(near - 0.5 / count, near + 0.5 / count), xtol=1e-15).root % 1.0
    # On a knot three columns are enough.
    knot = round(q * count) / count
    return (knot if abs(q - knot) < _NOTHING else q) % 1.0


def _cut(spec: BodySpec) -> list[bool]:
    """Whether the half-planes cut the surfaces of a body: those around the axis."""
    return [True, *map(crosses, spec.chamber)]


def _within(surface: TubeSurface, start: float, end: float) -> bool:
    x, y, _ = surface.net.mean(axis=(0, 1))
    return _inside((start, end), math.atan2(y, x))


def _inside(angles: tuple[float, float], angle: float) -> bool:
    return (angle - angles[0]) % (2.0 * math.pi) < angles[1] - angles[0]


def _direction(angle: float) -> Array:
    return np.array([math.cos(angle), math.sin(angle)])


def _turned(places: Array, angle: Array) -> Array:
    """Coordinates (..., 2) of places in frames at angles (...)."""
    cosine, sine = np.cos(angle), np.sin(angle)
    x, y = np.moveaxis(places, -1, 0)
    return np.stack([cosine * x + sine * y, cosine * y - sine * x], axis=-1)
