"""Limits that keep surfaces in convex regions: the planes of the body's ends, and the envelope."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.regions import Cylinder, Region, box
from pneumorph.geometry.tube.local import point_weights
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.limit import Limit
from pneumorph.limits.tube.certify.hull_bounds import hull_bounds
from pneumorph.limits.tube.certify.tally import SpannedBody, Tally
from pneumorph.limits.tube.rows.samples import COARSE, Near, PointsOn, RowBlock, SampledBody, by_surface, worst_samples

if TYPE_CHECKING:
    from jax import Array

    from pneumorph.limits.tube.rows.smooth import SmoothBody
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]

PLANES = Limit("planes", "wall", "mm", True, 0.002, None, lambda limits: limits.wall, "wall")
ENDS = Limit("ends", "ends", "mm", False, 0.002, None, lambda limits: 0.0, "wall")
ENVELOPE = Limit("envelope", "envelope", "mm", False, 0.002, "envelope_mm", lambda limits: _radius(limits), "wall")


def _radius(limits: Limits) -> float | None:
    return limits.envelope.radius if limits.envelope else None


def between_ends(spec: Limits, length: float) -> Region:
    """What is between the planes of the body's ends."""
    return box((-np.inf, -np.inf, 0.0), (np.inf, np.inf, length))


def within_envelope(spec: Limits, length: float) -> Region:
    """The envelope."""
    return Cylinder(ENVELOPE.bound(spec))


@dataclass(frozen=True)
class Inside:
    """Chambers or the exterior are in a convex region.

    Attributes
    ----------
    limit : Limit
        Its value is the bound plus how far the worst point is beyond the region, or minus that where it is a distance
        that must be kept from the region's boundary.
    region : function of the problem's limits and the length of the body
    cavities : bool
        Whether it is for the chambers or for the exterior.
    ends : bool
        Whether the end rows of samples count: those of the exterior are in the planes of its ends.
    """

    limit: Limit
    region: Callable[[Limits, float], Region]
    cavities: bool
    ends: bool = True

    @property
    def limits(self) -> tuple[Limit, ...]:
        return (self.limit,)

    def rows(self, at: SampledBody, near: Near) -> Iterator[RowBlock]:
        samples = at.samples
        for number, field in enumerate(at.fields):
            if self._counts(samples.coarse[number].cavity, samples.spec):
                c = self._c(samples.spec, samples.length, np.moveaxis(field.x, 0, -1))
                if not self.ends:
                    c[[0, -1]] = -np.inf
                least = -near.reach / self.limit.scale(samples.spec)
                row, column, cell = worst_samples(c, samples.own_coarse[number], COARSE, samples.spans[number], least)
                grid = samples.coarse[number]
                yield self._rows(at, PointsOn(number, cell, grid.q[column], grid.r[row]))

    def rows_at(self, at: SampledBody, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Points)
        for points in by_surface(at.samples, places):
            yield self._rows(at, points)

    def certify(self, body: SpannedBody, tallies: Mapping[str, Tally]) -> None:
        if self.limit.name not in tallies:
            return
        tally, length = tallies[self.limit.name], float(body.body.exterior.net[-1, 0, 2])
        region, shift = self.region(body.spec, length), self._shift(body.spec)

        def value(net: Floats) -> Floats:
            return region.beyond(np.moveaxis(net, 1, -1)) + shift

        for number, (surface, spans) in enumerate(zip(body.body.surfaces, body.spans, strict=True)):
            if surface.cavity == self.cavities and spans.own.any():
                tally.points(number, hull_bounds(spans.x, value, spans, tally.accuracy, tally.worst))

    def shares(self, at: SampledBody, number: int) -> Iterator[tuple[str, Floats]]:
        spec = at.samples.spec
        bound = self.limit.read(spec)
        if bound and self._counts(at.samples.coarse[number].cavity, spec):
            beyond = self.region(spec, at.samples.length).beyond(np.moveaxis(at.fields[number].x, 0, -1))
            yield self.limit.name, self.limit.used(self.limit.sign * (beyond + self._shift(spec)), bound)

    def smooth(self, at: SmoothBody) -> dict[str, Array]:
        spec, length = at.samples.spec, at.samples.length
        found = [
            self._c(spec, length, x.reshape(3, -1).T)
            for x, grid in zip(at.tubes, at.samples.grids, strict=True)
            if self._counts(grid.cavity, spec)
        ]
        return {self.limit.name: at.joined(found)} if found else {}

    def _counts(self, cavity: bool, spec: Limits) -> bool:
        return cavity == self.cavities and self.limit.read(spec) is not None

    def _shift(self, spec: Limits) -> float:
        """What makes the value, with the limit's sign, of a distance beyond the region."""
        return 0.0 if self.limit.at_least else self.limit.bound(spec)

    def _c(self, spec: Limits, length: float, x: Any) -> Any:
        """c of points x (..., 3)."""
        clearance = self.limit.bound(spec) if self.limit.at_least else 0.0
        return (self.region(spec, length).beyond(x) + clearance) / self.limit.scale(spec)

    def _rows(self, at: SampledBody, points: PointsOn) -> RowBlock:
        spec, length, surface = at.samples.spec, at.samples.length, at.body.surfaces[points.number]
        numbers, weights = point_weights(surface, points.q, points.r)
        x = np.einsum("mk,mkc->mc", weights, surface.net.reshape(-1, 3)[numbers])
        slope = self.region(spec, length).outward(x) / self.limit.scale(spec)
        # Coordinates along which the region has no boundary are left out.
        some = np.flatnonzero(slope.any(axis=0))
        return RowBlock(
            np.zeros(len(x), dtype=np.int64),
            at.samples.first[points.number] + points.cell,
            self._c(spec, length, x),
            (3 * (at.body.slices[points.number].start + numbers)[..., None] + some).reshape(len(x), 16 * len(some)),
            (weights[..., None] * slope[:, None, some]).reshape(len(x), 16 * len(some)),
        )
