"""The plan of silicone moulds: the planes that divide the body, and how masters and parts leave the negatives.

All planes are parallel to the axis and to each other. A chamber is opened where a plane cuts each of its sections; the
planes also contain the axes of the ports, so that nothing of a part is closed.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations, pairwise

import numpy as np
from numpy.typing import NDArray

from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.make.mould.plan import GATE, VENT, Plan, before_curing, shared_plan
from pneumorph.make.mould.release import EVERY, Release, pulled
from pneumorph.make.mould.samples import Samples
from pneumorph.make.mould.stems import Room, Stem, depths, port_in_plane
from pneumorph.problem import MakeSpec

Array = NDArray[np.float64]

_DIRECTIONS = 12  # normals that are tried
_INSIDE = 0.5  # mm, by which a plane is inside every section of the chambers that it opens
_APART = 1.0  # mm, least distance between the chambers that are opened on both sides of a part
_DOME = 0.1  # fraction of a chamber's length at its poles in which the plane need not cut it


@dataclass(frozen=True, eq=False)
class Slab:
    """A part of the body between two planes, or beyond one, and the directions of its mould.

    Its mould has two negatives, which meet at the plane with the offset `parting`. Negative a is on the side of `up`;
    for a part with one bonding face this plane is that face, and negative b forms its chambers.

    Attributes
    ----------
    number : int
        From 1, along the normal.
    low, high : float
        Offsets of its bonding faces along the normal, mm; infinite where there is none.
    parting : float
    up : (3,) array
        The normal or its opposite.
    """

    number: int
    low: float
    high: float
    parting: float
    up: Array

    @property
    def inner(self) -> bool:
        """Whether it has two bonding faces."""
        return bool(np.isfinite(self.low) and np.isfinite(self.high))


@dataclass(frozen=True, eq=False)
class SiliconePlan(Plan):
    """Everything that determines the pieces of silicone moulds, in mm and radians.

    Attributes
    ----------
    normal : (3,) array
        Unit normal of the planes between parts.
    offsets : tuple of float
        Their distances from the axis along it, rising.
    opened : {chamber: number of its plane}
    slabs : tuple of Slab
    releases : {negative: Release}
        How much of each must give way when the master, or the part, is pulled out.
    deep : (float, float)
        Thickness of negatives a and b from where they meet to their backs.
    tip_vents : tuple of float
        Places of vents at both edges of the tip, across the middle of every mould; none if the tip is narrow.
    """

    normal: Array
    offsets: tuple[float, ...]
    opened: dict[str, int]
    slabs: tuple[Slab, ...]
    releases: dict[str, Release]
    deep: tuple[float, float]
    tip_vents: tuple[float, ...]


@dataclass(frozen=True)
class Size:
    """The space for silicone: half its width, and the heights of its ends along z, mm."""

    half: float
    low: float
    high: float


def size_of(plan: SiliconePlan) -> Size:
    """The space for silicone around the widest part."""
    wall = plan.spec.mould_wall
    return Size(plan.outer, plan.bottom - wall, plan.length + wall)


@dataclass(frozen=True, eq=False)
class _Division:
    """Planes with one normal: offsets, the plane of every chamber, the ports, and the parts."""

    normal: Array
    offsets: tuple[float, ...]
    planes: tuple[int, ...]
    stems: tuple[Stem, ...]
    slabs: tuple[Slab, ...]


def plan_silicone(body: Body, spec: MakeSpec, wall: float) -> SiliconePlan:
    """Plan the silicone moulds of a body.

    Parameters
    ----------
    body : Body
    spec : MakeSpec
        The table [make] of its problem.
    wall : float
        Rubber that must stay between ports and surfaces, mm.

    Raises
    ------
    ComputationError
        If no planes along the axis open every chamber, a master cannot be pulled out, or there is no room for the gate;
        with the place.
    """
    room = before_curing(body, spec, wall)
    samples = room.samples
    tried = [_divided(room, angle) for angle in _angles(samples)]
    possible = [each for each in tried if isinstance(each, _Division)]
    if not possible:
        reasons = [each for each in tried if isinstance(each, str)]
        raise ComputationError(f"the silicone mould cannot be planned: {reasons[0]}; use the split mould")
    fewest = min(len(each.offsets) for each in possible)
    # The first of those that are equally good.
    best = min(
        (each for each in possible if len(each.offsets) == fewest),
        key=lambda each: round(_worst(_releases(each, samples, spec, every=11)), 2),
    )
    releases = _releases(best, samples, spec, every=EVERY)
    name = max(releases, key=lambda each: releases[each].stretch)
    worst = releases[name]
    if worst.stretch > spec.release_stretch:
        x, y, z = worst.place
        raise ComputationError(
            f"the master cannot be pulled out of negative-{name}: at x = {x:.0f}, y = {y:.0f}, z = {z:.0f} mm the "
            f"silicone would be stretched by {worst.stretch:.2g}, more than make.release_stretch = "
            f"{spec.release_stretch:g}; allow more if the silicone bears it, or use the split mould"
        )
    shared = shared_plan(room, spec, best.stems)
    return SiliconePlan(
        **vars(shared),
        normal=best.normal,
        offsets=best.offsets,
        opened={chamber.name: plane for chamber, plane in zip(room.body.chambers, best.planes, strict=True)},
        slabs=best.slabs,
        releases=releases,
        deep=_deep(best.slabs, best.normal, shared),
        tip_vents=_tip_vents(best.slabs, best.normal, shared),
    )


def _angles(samples: Sequence[Samples]) -> list[float]:
    """Angles of normals to try: evenly spaced ones, and those of planes through two chambers."""
    middles = [one.points.mean(axis=0) for one in samples[1:]]
    ways = [other - one for one, other in combinations(middles, 2)]
    through = [np.arctan2(way[0], -way[1]) for way in ways if np.hypot(*way[:2]) > _INSIDE]
    return [*np.linspace(0.0, np.pi, _DIRECTIONS, endpoint=False), *(float(angle % np.pi) for angle in through)]


def _divided(room: Room, angle: float) -> _Division | str:
    """The fewest planes with a normal at an angle that open every chamber; or the reason why there are none."""
    body, samples = room.body, room.samples
    normal = np.array([np.cos(angle), np.sin(angle), 0.0])
    ranges = []
    for chamber, one in zip(body.chambers, samples[1:], strict=True):
        away = one.x @ normal
        skipped, beyond = (int(np.ceil(_DOME * len(away))) if pole else 0 for pole in chamber.poles)
        rows = away[skipped : len(away) - beyond]
        low, high = rows.min(axis=1), rows.max(axis=1)
        if low.max() + _INSIDE > high.min() - _INSIDE:
            height = one.x[skipped + int(np.argmin(high)), 0, 2]
            return f"chamber {chamber.name}, z = {height:.0f} mm: no plane along the axis opens all of it"
        ranges.append((float(low.max()) + _INSIDE, float(high.min()) - _INSIDE))
    # The fewest points that are in all ranges: the end of the range that ends first, and so on.
    groups: list[list[int]] = []
    for number in sorted(range(len(ranges)), key=lambda each: ranges[each][1]):
        if groups and ranges[number][0] <= min(ranges[each][1] for each in groups[-1]):
            groups[-1].append(number)
        else:
            groups.append([number])
    offsets = []
    for group in groups:
        even = np.mean([samples[number + 1].points.mean(axis=0) @ normal for number in group])
        offsets.append(float(np.clip(even, max(ranges[n][0] for n in group), min(ranges[n][1] for n in group))))
    planes = [next(k for k, group in enumerate(groups) if number in group) for number in range(len(ranges))]
    stems = []
    for number, (chamber, plane) in enumerate(zip(body.chambers, planes, strict=True), start=1):
        stem = port_in_plane(room, number, (normal, offsets[plane]))
        if stem is None:
            height = samples[number].points[:, 2].min()
            return (
                f"chamber {chamber.name}, z = {height:.0f} mm: in the plane that opens the chamber there is no room "
                f"for a port of {2 * room.radius:.2g} mm with {room.wall:.2g} mm of rubber around it; take a thinner "
                "make.tube"
            )
        stems.append(stem)
    slabs = _slabs(body, samples, normal, offsets, planes)
    return slabs if isinstance(slabs, str) else _Division(normal, tuple(offsets), tuple(planes), tuple(stems), slabs)


def _slabs(
    body: Body, samples: Sequence[Samples], normal: Array, offsets: Sequence[float], planes: Sequence[int]
) -> tuple[Slab, ...] | str:
    """The parts between planes; or the reason why the mould of one cannot be parted between its chambers."""
    slabs = [Slab(1, -np.inf, offsets[0], offsets[0], -normal)]
    reach = [(float((one.points @ normal).min()), float((one.points @ normal).max())) for one in samples[1:]]
    for number, (low, high) in enumerate(pairwise(offsets), start=1):
        first, last = ([n for n, plane in enumerate(planes) if plane == k] for k in (number - 1, number))
        below, above = max(reach[n][1] for n in first), min(reach[n][0] for n in last)
        if above - below < _APART:
            one = max(first, key=lambda n: reach[n][1])
            other = min(last, key=lambda n: reach[n][0])
            points = samples[one + 1].points
            height = points[int(np.argmax(points @ normal)), 2]
            names = f"{body.chambers[one].name} and {body.chambers[other].name}"
            return (
                f"chambers {names}, z = {height:.0f} mm: they overlap between the planes that open them, so that no "
                "plane parts them"
            )
        parting = float(np.clip((low + high) / 2.0, below + _APART / 2.0, above - _APART / 2.0))
        slabs.append(Slab(number + 1, low, high, parting, normal))
    return (*slabs, Slab(len(slabs) + 1, offsets[-1], np.inf, offsets[-1], normal))


def formed(
    slab: Slab, side: str, samples: Sequence[Samples], normal: Array, offsets: Sequence[float], planes: Sequence[int]
) -> list[tuple[int, NDArray[np.int64]]]:
    """The surfaces that a negative forms: their numbers, the exterior's being 0, and which of their samples.

    Parameters
    ----------
    side : "a" or "b"
    offsets : sequence of float
        Of the planes with this normal.
    planes : sequence of int
        For every chamber, the number of the plane that opens it.
    """
    way = slab.up if side == "a" else -slab.up
    sense = float(way @ normal)
    face = slab.high if sense > 0.0 else slab.low
    numbers = [number for number, plane in enumerate(planes, start=1) if offsets[plane] == face]
    parts = []
    for number in [0, *numbers] if side == "a" or slab.inner else numbers:
        along = samples[number].points @ normal
        own = (along >= slab.low) & (along <= slab.high)
        if slab.inner:  # one negative on each side of the parting
            own &= (along - slab.parting) * sense >= 0.0
        parts.append((number, np.flatnonzero(own)))
    return parts


def _releases(division: _Division, samples: Sequence[Samples], spec: MakeSpec, every: int) -> dict[str, Release]:
    """How every negative comes off its master: the worse of the exterior and the chambers that it forms."""
    worst = {}
    for slab in division.slabs:
        for side, way in (("a", slab.up), ("b", -slab.up)):
            surfaces = formed(slab, side, samples, division.normal, division.offsets, division.planes)
            each = [_release(samples[n], n, slab, division.normal, way, spec, own[::every]) for n, own in surfaces]
            worst[f"{slab.number}-{side}"] = max(each, key=lambda one: one.stretch)
    return worst


def _release(
    surface: Samples, number: int, slab: Slab, normal: Array, way: Array, spec: MakeSpec, chosen: NDArray[np.int64]
) -> Release:
    """Pull off what a negative forms of a surface. The exterior's silicone is a wall, that of a chamber a ridge."""
    thickness = np.full(len(chosen), spec.mould_wall)
    if number:
        middle = surface.x.mean(axis=1, keepdims=True)
        thickness = np.linalg.norm(surface.x - middle, axis=2).ravel()[chosen]
    # An outer part's chambers are formed by ridges of negative b, which reach beyond the parting plane.
    above = way if slab.inner else slab.up
    end = slab.parting * float(above @ normal)
    return pulled(surface, surface.points[chosen], thickness, way, lambda back: back @ above >= end)


def _worst(releases: dict[str, Release]) -> float:
    return max(each.stretch for each in releases.values())


def _deep(slabs: Sequence[Slab], normal: Array, plan: Plan) -> tuple[float, float]:
    """Thickness of negatives a and b, the same for all parts: `mould_wall` behind everything."""
    exterior = plan.samples[0].points @ normal
    low, high = min(float(exterior.min()), -plan.flange), max(float(exterior.max()), plan.flange)
    above, below = [], []
    for slab in slabs:
        bottom, top = max(slab.low, low), min(slab.high, high)
        up, down = (top - slab.parting, slab.parting - bottom)
        above.append(up if slab.up @ normal > 0 else down)
        below.append(down if slab.up @ normal > 0 else up)
    return max(above) + plan.spec.mould_wall, max(below) + plan.spec.mould_wall


def _tip_vents(slabs: Sequence[Slab], normal: Array, plan: Plan) -> tuple[float, ...]:
    """See `SiliconePlan`. The gate and these vents are grooves of negative a, above the middle of the tip."""
    rim = plan.body.exterior.sample(np.linspace(0.0, 1.0, 200, endpoint=False), [1.0])[0][:, :2]
    line, reach = np.linspace(-plan.outer, plan.outer, 401), np.inf
    for slab in slabs:
        across = np.cross(slab.up, [0.0, 0.0, 1.0])
        room = depths((slab.parting * normal + 0.5 * GATE * slab.up + line[:, None] * across)[:, :2], rim)
        if room[len(line) // 2] < GATE:
            raise ComputationError(f"part {slab.number}, z = {plan.length:.0f} mm: its tip is too narrow for the gate")
        reach = min(reach, *np.abs(line[room > 1.0][[0, -1]]))
    return (-reach, reach) if reach > GATE + 2.0 * VENT + 1.0 else ()
