"""Limits that keep surfaces in convex regions: the planes of the body's ends, and the envelope."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.regions import Cylinder, HalfSpace, Intersection, Region
from pneumorph.limits.certify.enclosed import EnclosedBody
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.kinds.kind import SmoothBody
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.regions import rows_beyond
from pneumorph.limits.rows.sampled import Near, Placed, RowBlock, SampledBody, by_surface

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]

PLANES = Limit("planes", "wall", "mm", True, 0.002, None, lambda limits: limits.wall, "wall")
ENDS = Limit("ends", "reach beyond the ends", "mm", False, 0.002, None, lambda limits: 0.0, "wall")
ENVELOPE = Limit("envelope", "envelope", "mm", False, 0.002, "envelope_mm", lambda limits: _most(limits), "wall")


def _most(limits: Limits) -> float | None:
    """The radius of a cylinder alone, where the value is the distance from its axis; of other convex spaces a value of
    zero is on the boundary."""
    if limits.envelope is None or limits.envelope.triangles is not None:
        return None
    return 0.0 if limits.envelope.planes else limits.envelope.radius


def between_ends(spec: Limits, between: Region) -> Region:
    """What is between the planes of the body's ends."""
    return between


def within_envelope(spec: Limits, between: Region) -> Region:
    """The envelope."""
    assert spec.envelope is not None
    parts: list[Region] = [HalfSpace(*plane) for plane in spec.envelope.planes]
    if spec.envelope.radius is not None:
        parts.append(Cylinder(spec.envelope.radius))
    return parts[0] if len(parts) == 1 else Intersection(tuple(parts))


@dataclass(frozen=True)
class Inside:
    """Chambers or the exterior are in a convex region.

    Attributes
    ----------
    limit : Limit
        Its value is the bound plus how far the worst point is beyond the region, or minus that where it is a distance
        that must be kept from the region's boundary.
    region : function of the problem's limits and of what is between the planes of the body's ends
    cavities : bool
        Whether it is for the chambers or for the exterior.
    ends : bool
        Whether the end rows of samples count: those of the exterior are in the planes of its ends.
    """

    limit: Limit
    region: Callable[[Limits, Region], Region]
    cavities: bool
    ends: bool = True

    @property
    def limits(self) -> tuple[Limit, ...]:
        return (self.limit,)

    def rows(self, at: SampledBody, near: Near) -> Iterator[RowBlock]:
        for number in self._surfaces(at.body, at.spec):
            c = self._c(at.spec, at.between, at.positions(number))
            if not self.ends:
                c[at.in_end_planes(number)] = -np.inf
            yield self._rows(at, at.worst(number, c, -near.reach / self.limit.scale(at.spec)))

    def rows_at(self, at: SampledBody, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Points)
        for points in by_surface(at, places):
            yield self._rows(at, points)

    def certify(self, body: EnclosedBody, tallies: Mapping[str, Tally]) -> None:
        def value(x: Floats) -> Floats:
            return self._value(body.spec, body.between, x)

        for number in self._surfaces(body.body, body.spec):
            if number in body.own:
                tally = tallies[self.limit.name]
                tally.points(number, body.farthest(number, value, tally.accuracy, tally.worst))

    def shares(self, at: SampledBody, number: int) -> Iterator[tuple[str, Floats]]:
        bound = self.limit.read(at.spec)
        if bound is not None and self.ends and number in self._surfaces(at.body, at.spec):
            value = self.limit.sign * self._value(at.spec, at.between, at.positions(number))
            yield self.limit.name, self.limit.used(value, bound)

    def smooth(self, at: SmoothBody) -> dict[str, Any]:
        if self.limit.read(at.spec) is None:
            return {}
        parts = [self._c(at.spec, at.between, x) for cavity, x in at.positions() if cavity == self.cavities]
        return {self.limit.name: at.joined(parts)} if parts else {}

    def _surfaces(self, body: Body, spec: Limits) -> list[int]:
        """Indices of the surfaces that are kept in the region."""
        if self.limit.read(spec) is None:
            return []
        return [number for number, surface in enumerate(body.surfaces) if surface.cavity == self.cavities]

    def _value(self, spec: Limits, between: Region, x: Floats) -> Floats:
        """The value at points x (..., 3), with the limit's sign."""
        return self.region(spec, between).beyond(x) + (0.0 if self.limit.at_least else self.limit.bound(spec))

    def _c(self, spec: Limits, between: Region, x: Any) -> Any:
        """c of points x (..., 3)."""
        return (self.region(spec, between).beyond(x) + self._clearance(spec)) / self.limit.scale(spec)

    def _rows(self, at: SampledBody, points: Placed) -> RowBlock:
        region, limit = self.region(at.spec, at.between), self.limit
        return rows_beyond(at, points, region, self._clearance(at.spec), limit.scale(at.spec))

    def _clearance(self, spec: Limits) -> float:
        """What must be kept from the region's boundary, mm."""
        return self.limit.bound(spec) if self.limit.at_least else 0.0
