"""The plan of a mould: its stems, partings, vents and dimensions, before anything is built."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.geometry.tube.surface import TubeSurface, enclosed_volume
from pneumorph.make.mould.release import Release, partings
from pneumorph.make.mould.samples import Samples, sampled
from pneumorph.make.mould.stems import INTO, Room, Stem, ports, support
from pneumorph.make.mould.tops import tops
from pneumorph.problem import MakeSpec
from pneumorph.units import STANDARD_GRAVITY

Array = NDArray[np.float64]

FIT = 0.9
"""Diameter of a port relative to that of the tube that is pressed into it."""

PLATE, RECESS = 8.0, 6.0
"""Thickness in mm of the base plate and the lid, and how far their rims reach over the outer mould."""

GATE, FUNNEL, VENT = 2.0, 6.0, 0.6
"""Radii in mm of the gate at the rubber and outside, and of vents."""

CORE_MODULUS, CORE_DENSITY = 2000.0, 1.2e-9
"""Of printed resin and of printed soluble filament (polyvinyl alcohol), MPa and t/mm³: usual values of data sheets."""

TILT = np.radians(5.0)
"""The mould may stand at this angle to the vertical while it is filled."""


@dataclass(frozen=True, eq=False)
class Core:
    """How a core is held.

    Attributes
    ----------
    stems : tuple of Stem
    sag : float
        Sideways deflection of its free end, or of its middle if it is held at both ends, mm.
    pull : float
        Stretch of its port if it were pulled out in one piece: its widest section relative to the stem.
    """

    chamber: str
    stems: tuple[Stem, ...]
    sag: float
    pull: float

    def leaves_whole(self, stretch: float) -> bool:
        """Whether it can be pulled through its port, stretched up to `stretch`; otherwise it leaves in pieces."""
        return self.pull <= stretch and self.stems[0].way != "side"


@dataclass(frozen=True, eq=False)
class Plan:
    """What every way to make a body needs, in mm and radians.

    Attributes
    ----------
    body : Body
        The body, enlarged by the shrinkage of the rubber.
    spec : MakeSpec
    samples : tuple of Samples
        Of its surfaces, the exterior first.
    thickness : (n,) array
        Of the rubber between the points of the exterior and the nearest chamber, mm.
    stems : tuple of Stem
        All holes of the rubber part.
    stem : float
        Radius of all stems and ports.
    length, flange, outer : float
        Height of the body; radii of the flange and of what is around the rubber.
    vents : (n, 3) array
        High points of the exterior, which get a vent.
    trapped : {chamber: (n, 3) array}
        High points under the cores, which have no vent.
    """

    body: Body
    spec: MakeSpec
    samples: tuple[Samples, ...]
    thickness: Array
    stems: tuple[Stem, ...]
    stem: float
    length: float
    flange: float
    outer: float
    vents: Array
    trapped: dict[str, Array]

    @property
    def slope(self) -> float:
        """Tangent of the draft."""
        return float(np.tan(self.spec.draft))

    @property
    def bottom(self) -> float:
        """Height of the underside of the flange."""
        return -self.spec.flange.thickness


@dataclass(frozen=True, eq=False)
class SplitPlan(Plan):
    """Everything that determines the pieces of a split mould, in mm and radians.

    Attributes
    ----------
    cores : tuple of Core
        One for every chamber.
    angles : tuple of float
        Of the partings, about z.
    releases : tuple of Release
        How the pieces between them come off.
    """

    cores: tuple[Core, ...]
    angles: tuple[float, ...]
    releases: tuple[Release, ...]


def plan(body: Body, spec: MakeSpec, wall: float, density: float) -> SplitPlan:
    """Plan the split mould of a body.

    Parameters
    ----------
    body : Body
    spec : MakeSpec
        The table [make] of its problem.
    wall : float
        Rubber that must stay between stems and surfaces, mm.
    density : float
        Of the rubber, t/mm³.

    Raises
    ------
    ComputationError
        If a chamber cannot get a port, or no split of the outer mould can be pulled off the rubber; with the place.
    """
    room = before_curing(body, spec, wall)
    stems = ports(room)
    sideways = [stem.angle for stem in stems if stem.way == "side"]
    cores = tuple(_core(room, number, stem, spec, density, sideways) for number, stem in enumerate(stems, start=1))
    shared = shared_plan(room, spec, [stem for core in cores for stem in core.stems])
    given = [stem.angle for core in cores for stem in core.stems if stem.way == "side"]
    angles, releases = partings(room.samples[0], shared.thickness, given, spec.release_stretch)
    worst = max(releases, key=lambda each: each.stretch)
    if worst.stretch > spec.release_stretch:
        x, y, z = worst.place
        raise ComputationError(
            f"no split of the mould can be pulled off: at x = {x:.0f}, y = {y:.0f}, z = {z:.0f} mm the rubber would be "
            f"stretched by {worst.stretch:.2g}, more than make.release_stretch = {spec.release_stretch:g}; allow more "
            "if the rubber bears it, or design with a larger limits.fold"
        )
    return SplitPlan(**vars(shared), cores=cores, angles=tuple(angles), releases=tuple(releases))


def before_curing(body: Body, spec: MakeSpec, wall: float) -> Room:
    """The body enlarged by the shrinkage of the rubber, with what its ports keep away from."""
    body = enlarged(body, 1.0 / (1.0 - spec.shrinkage))
    return Room(body, tuple(sampled(surface) for surface in body.surfaces), FIT * spec.tube / 2.0, wall)


def shared_plan(room: Room, spec: MakeSpec, stems: Sequence[Stem]) -> Plan:
    """What every way to make a body needs, from the result of `before_curing` and the stems of all cores."""
    body, samples = room.body, room.samples
    exterior = samples[0]
    widest = np.hypot(*exterior.points[:, :2].T)
    low = exterior.points[:, 2] <= spec.flange.thickness + 1.0
    flange = float(widest[low].max()) + spec.flange.width
    return Plan(
        body=body,
        spec=spec,
        samples=tuple(samples),
        thickness=KDTree(np.concatenate([one.closed for one in samples[1:]])).query(exterior.points)[0],
        stems=tuple(stems),
        stem=room.radius,
        length=float(body.exterior.net[-1, 0, 2]),
        flange=flange,
        outer=max(float(widest.max()), flange) + spec.mould_wall,
        vents=tops(exterior),
        trapped={chamber.name: tops(one) for chamber, one in zip(body.chambers, samples[1:], strict=True)},
    )


def enlarged(body: Body, scale: float) -> Body:
    """A body magnified about the origin."""

    def larger(surface: TubeSurface) -> TubeSurface:
        return replace(surface, net=scale * surface.net, size=(scale * surface.size[0], scale * surface.size[1]))

    return Body(larger(body.exterior), tuple(larger(chamber) for chamber in body.chambers))


def _core(room: Room, number: int, port: Stem, spec: MakeSpec, density: float, angles: Sequence[float]) -> Core:
    """A core on its port's stem, with a second stem at its upper end where it would sag too far."""
    chamber, own, radius = room.body.chambers[number - 1], room.samples[number], room.radius
    away = np.hypot(*(own.points[:, :2] - port.start[:2]).T) if port.way != "side" else np.full(1, np.inf)
    pull = float(away.max() / radius)
    sag = _sag(chamber, own, port, radius, density, ends=1)
    if sag <= spec.core_sag:
        return Core(chamber.name, (port,), sag, pull)
    second = support(room, number, angles)
    if second is None:
        place, worst, why = own.points[:, 2].max(), sag, "there is no room for a second stem"
    else:
        place = np.ptp(own.points[:, 2]) / 2.0 + own.points[:, 2].min()
        worst = _sag(chamber, own, port, radius, density, ends=2)
        why = "although stems support both of its ends"
    if second is None or worst > spec.core_sag:
        raise ComputationError(
            f"chamber {chamber.name}, z = {place:.0f} mm: the core sags by {worst:.2g} mm, more than make.core_sag = "
            f"{spec.core_sag:g} mm ({why}); allow more, or take a thicker make.tube"
        )
    return Core(chamber.name, (port, second), worst, pull)


def _sag(chamber: TubeSurface, own: Samples, stem: Stem, radius: float, density: float, ends: int) -> float:
    """Sideways deflection of a core in mm under its weight or its buoyancy in a mould that does not stand upright.

    The core is a bar with the second moment of area of its narrowest section, taken for a circle, with an even load.
    Held at one end it is a cantilever on the free length of its stem; held at both ends it is simply supported.
    """
    length = float(np.ptp(own.points[:, 2]))
    weight = max(CORE_DENSITY, abs(density - CORE_DENSITY)) * STANDARD_GRAVITY * enclosed_volume(chamber)
    load = weight * np.sin(TILT) / length
    inner = own.x[len(own.x) // 10 : -len(own.x) // 10 or None]
    x, y = inner[..., 0], inner[..., 1]
    areas = np.abs(0.5 * (x * np.roll(y, -1, axis=1) - y * np.roll(x, -1, axis=1)).sum(axis=1))
    bending = CORE_MODULUS * float(areas.min()) ** 2 / (4.0 * np.pi)
    if ends == 2:
        return 5.0 * load * length**4 / (384.0 * bending)
    free, stiff = stem.wall + INTO, CORE_MODULUS * np.pi * radius**4 / 4.0
    moment, force = load * length**2 / 2.0, load * length
    turn = (moment * free + force * free**2 / 2.0) / stiff
    shift = (moment * free**2 / 2.0 + force * free**3 / 3.0) / stiff
    return float(load * length**4 / (8.0 * bending) + shift + turn * length)
