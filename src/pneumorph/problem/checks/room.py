"""Whether there is room: chambers with their walls in the envelope, and obstacles outside of the body."""

from __future__ import annotations

import math
from collections.abc import Iterator
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import linprog
from scipy.spatial import HalfspaceIntersection

from pneumorph.cad.shells import encloses, shells_of
from pneumorph.problem.body import BodySpec, ChamberSpec
from pneumorph.problem.contact import TriangulatedSpec
from pneumorph.problem.envelope import Envelope
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables

Array = NDArray[np.float64]

UNLIKE = 300.0
"""Size of an obstacle over the length of the body, or the other way around, beyond which the units are doubted."""

SIDES = 64
"""Planes around the cylinder of an envelope, which they hold."""

FAR = 0.25
"""Part of the radius of a body by which its start may leave the envelope: designs near it are within."""

LONG = 4.0
"""Length of chambers over the radius of the least circle in their sections, from which on sections are taken to be
curved as their surfaces are: shorter ones could widen like a dome."""


def check_envelope(problem: Tables) -> Iterator[tuple[str, str]]:
    """Key and reason where no body of tubes fits into the envelope.

    These are necessary conditions. Base and tip of every design stay in their planes. A ball of the radius
    `limits.wall` around a point in a chamber is in the body. A section of a chamber whose curvature is 1/r at most has
    a circle of radius r in it (Pestov & Ionin, Doklady AN SSSR 127 (1959) 1170), and `limits.curvature` is at least
    half of the square of that curvature. Circles in chambers side by side are a wall apart, and a wall away from the
    exterior; as to how many centres a convex region holds, see Oler, Acta Mathematica 105 (1961) 19.
    """
    envelope, body, wall = problem.limits.envelope, problem.tubes, problem.limits.wall
    # What is too narrow by its radius alone is found with the other limits.
    if envelope is None or (envelope.radius is not None and envelope.radius <= wall):
        return
    normals, offsets = _planes(envelope)
    for end, place, turn in zip(("base", "tip"), body.farthest, body.turns, strict=True):
        if _largest_ball(normals @ turn[:, :2], offsets - normals @ place)[0] <= ROUNDING:
            where = f"at z = {place[2]:g} mm" if turn[2, 2] == 1.0 else f"in its plane through {_words(place)}"
            yield (
                "limits.envelope",
                f"does not contain any of the body's {end}, which stays {where}; make it larger or move it",
            )
            return
    onwards = body.turns[1][:, 2]
    ends = np.array([[0.0, 0.0, -1.0], onwards])
    largest, _ = _largest_ball(
        np.vstack([normals, ends]), np.append(offsets, np.array([0.0, float(onwards @ body.farthest[1])]))
    )
    if largest < wall - ROUNDING:
        yield (
            "limits.envelope",
            f"has room for a ball of radius {largest:.3g} mm at most, so for no chamber between walls of limits.wall = "
            f"{wall:g} mm; make it larger",
        )
        return
    crowded = () if body.bent else tuple(_side_by_side(problem, normals, offsets))
    yield from crowded
    if not crowded and (beyond := _beyond(problem, normals, offsets)) > FAR * body.mean_radius:
        yield (
            "limits.envelope",
            f"is left by the body at the start by {beyond:.3g} mm, more than a quarter of its radius, which no design "
            "near it makes up for; make it larger, or begin with a body within it",
        )


def _side_by_side(problem: Tables, normals: Array, offsets: Array) -> Iterator[tuple[str, str]]:
    """Where chambers beside each other do not fit into half-spaces along z."""
    wall = problem.limits.wall
    upright = np.abs(normals[:, 2]) < ROUNDING
    across, beside = normals[upright, :2], offsets[upright]
    circle = _least_circle(problem)
    why = f"circles of {circle:.3g} mm, the least that limits.curvature allows, and walls of limits.wall = {wall:g} mm"
    if upright.any() and (radius := _largest_ball(across, beside)[0]) < wall + circle - ROUNDING:
        yield (
            "limits.envelope",
            f"has room for a circle of radius {radius:.3g} mm across the axis at most, but a chamber with its wall "
            f"needs {wall + circle:.3g} mm, for {why}; make it larger, or change these limits",
        )
        return
    side_by_side = max(sum(start < z < end for start, end in _spans(problem)) for z in _middles(problem))
    room = _most_points(across, beside - wall - circle, wall + 2.0 * circle)
    if side_by_side > room:
        yield (
            "limits.envelope",
            f"has room for at most {room} chambers side by side, for {why}, but there are {side_by_side}; make it "
            "larger, or change these limits",
        )


def _beyond(problem: Tables, normals: Array, offsets: Array) -> float:
    """How far the base and the tip of the starting body are outside of half-spaces, mm."""
    body = problem.tubes
    sizes = (1.0, body.scale_at(body.length))
    ends = zip(sizes, body.farthest, body.turns, strict=True)
    points = [place + body.outline.scaled(size).points @ turn[:, :2].T for size, place, turn in ends]
    return float((np.concatenate(points) @ normals.T - offsets).max())


def _least_circle(problem: Tables) -> float:
    """Radius of a circle that is in a section of every chamber, mm; 0 where that is not known."""
    radius = 1.0 / math.sqrt(2.0 * problem.limits.curvature)
    return radius if all(end - start >= LONG * radius for start, end in _spans(problem)) else 0.0


def _words(place: Array) -> str:
    return f"({', '.join(f'{part:.3g}' for part in place)}) mm"


def _planes(envelope: Envelope) -> tuple[Array, Array]:
    """Normals (m, 3) and offsets (m,) of half-spaces that hold the envelope."""
    planes = list(envelope.planes)
    if envelope.radius is not None:
        angles = 2.0 * math.pi * np.arange(SIDES) / SIDES
        planes += [((math.cos(angle), math.sin(angle), 0.0), envelope.radius) for angle in angles.tolist()]
    return np.array([normal for normal, _ in planes]), np.array([offset for _, offset in planes])


def _largest_ball(normals: Array, offsets: Array) -> tuple[float, Array]:
    """Radius and centre of the largest ball within half-spaces, up to 1e6 mm; a negative radius if there is none."""
    count = normals.shape[1]
    rows = np.column_stack([normals, np.linalg.norm(normals, axis=1)])
    reach = [(-1e6, 1e6)] * (count + 1)
    found = linprog(np.append(np.zeros(count), -1.0), A_ub=rows, b_ub=offsets, bounds=reach)
    return (float(found.x[-1]), found.x[:-1]) if found.success else (-math.inf, np.zeros(count))


def _most_points(normals: Array, offsets: Array, apart: float) -> float:
    """How many points that far apart a convex region of the plane holds at most."""
    radius, centre = _largest_ball(normals, offsets)
    if radius > 1e5:
        return math.inf
    if radius <= ROUNDING:
        # A line, or a point: not decided here but for the latter.
        return math.inf
    corners = HalfspaceIntersection(np.column_stack([normals, -offsets]), centre).intersections
    angle = np.arctan2(*(corners - centre).T[::-1])
    corners = corners[angle.argsort()]
    after = np.roll(corners, -1, axis=0)
    area = 0.5 * float(np.sum(corners[:, 0] * after[:, 1] - corners[:, 1] * after[:, 0]))
    around = float(np.linalg.norm(after - corners, axis=1).sum())
    if not math.isfinite(area) or around > 1e5:
        return math.inf
    return math.floor(2.0 / math.sqrt(3.0) * area / apart**2 + around / (2.0 * apart) + 1.0 + ROUNDING)


def _spans(problem: Tables) -> list[tuple[float, float]]:
    return [chamber.span for chamber in problem.tubes.chamber]


def _middles(problem: Tables) -> list[float]:
    """Heights at which every set of chambers that are side by side is met."""
    ends = sorted({end for span in _spans(problem) for end in span})
    return [0.5 * (low + high) for low, high in pairwise(ends)]


def check_obstacles(problem: Tables) -> Iterator[tuple[str, str]]:
    """Obstacles with a point in the body of the start; one that crosses its surfaces is found once it is meshed."""
    for number, obstacle in enumerate(problem.obstacle):
        if isinstance(obstacle, TriangulatedSpec):
            size = obstacle.scale * float(np.ptp(obstacle.surface.points, axis=0).max()) / problem.body.length
            if not 1.0 / UNLIKE <= size <= UNLIKE:
                scale = obstacle.scale * (1e3 if size < 1.0 else 1e-3)
                yield (
                    f"obstacle[{number}].scale",
                    f'makes "{obstacle.name}" {size:.2g} times as long as the body; is the file in another unit? Then '
                    f"give scale = {scale:g}",
                )
                continue
        point = obstacle.a_point
        where = None if point is None else _inside(problem, point)
        if where is not None:
            yield (
                f"obstacle[{number}].{obstacle.placed_by}",
                f'is in {where}: "{obstacle.name}" would be part of the body at rest; move it out',
            )


def _inside(problem: Tables, point: Array) -> str | None:
    """In which part of the body a point (3,) lies, in words; None if it lies outside."""
    if problem.solid is not None:
        faces = problem.solid.outline
        shells = shells_of(faces)
        if not encloses(faces, shells.outside, point):
            return None
        return "a chamber" if any(encloses(faces, void, point) for void in shells.voids) else "the rubber"
    axis = problem.tubes.bent
    places = [(point[0], point[1], point[2])] if axis is None else axis.coordinates(point)
    return next((found for place in places if (found := _inside_tubes(problem.tubes, *place)) is not None), None)


def _inside_tubes(body: BodySpec, x: float, y: float, z: float) -> str | None:
    """The same by x and y in the cross-section and z along the axis."""
    if not 0.0 < z < body.length:
        return None
    within = []
    for tube in (body, *body.chamber):
        start, end = tube.extent
        outline = tube.outline.scaled(tube.scale_at(z))
        place = tube.center if isinstance(tube, ChamberSpec) else (0.0, 0.0)
        within.append(start < z < end and bool(outline.moved(*place).contains(np.array([[x, y]]))[0]))
    if not within[0]:
        return None
    return next(
        (f'chamber "{each.name}"' for each, inside in zip(body.chamber, within[1:], strict=True) if inside),
        "the rubber",
    )
