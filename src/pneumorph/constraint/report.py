"""The worst value of every limit on a body, sampled twice as finely as the optimiser does, in units a person reads."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import permutations
from typing import TYPE_CHECKING, NamedTuple

import jax.numpy as jnp
import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d, minimum_filter1d

from pneumorph.constraint.distance import Floats, Ints, Target, nearest, nearest_fold, target
from pneumorph.constraint.sampling import Fields, Grid, every_other, grid, heights, rim_share
from pneumorph.constraint.surface import MIN_AREA, measures
from pneumorph.geometry import Body

if TYPE_CHECKING:
    from pneumorph.problem import Limits as LimitsSpec

_UNITS = {
    "wall": "mm",
    "fold": "mm",
    "curvature": "/mm²",
    "skew": "",
    "stretch": "/mm²",
    "envelope": "mm",
    "ends": "mm",
}
_AT_LEAST = ("wall", "fold", "area")


@dataclass(frozen=True)
class Reading:
    """The worst value of one limit.

    Attributes
    ----------
    limit : str
        "wall", "fold", "curvature", "skew", "stretch", "area", "ends" or "envelope".
    value, bound : float
        In mm, 1/mm² or 1; distances and the area element must not be below the bound, all else must not be above it.
    surface : str
        Name of the surface the worst place lies on.
    q, r : float
        Its parameters; on an end disc those of the rim beside it.
    """

    limit: str
    value: float
    bound: float
    surface: str
    q: float
    r: float

    def excess(self) -> float:
        """How far beyond the bound, relative to it (in mm where it is zero: the ends); not positive when held."""
        beyond = self.bound - self.value if self.limit in _AT_LEAST else self.value - self.bound
        return beyond / (self.bound or 1.0)

    def __str__(self) -> str:
        unit = _UNITS.get(self.limit, "")
        space = " " if unit == "mm" else ""
        kind = "at least" if self.limit in _AT_LEAST else "at most"
        return (
            f"{self.limit} is {self.value:.3g}{space}{unit}, {kind} {self.bound:g}{space}{unit} is asked"
            f" (on {self.surface}, q = {self.q:.3f}, r = {self.r:.3f})"
        )


@dataclass(frozen=True)
class LimitReport:
    """Every limit's worst value over all surfaces.

    wall is the least distance between two surfaces, or between a chamber and the body's end planes; fold the least
    distance within a surface outside the neighbourhood, its own flat ends included; area the least area element
    sqrt(EG - F²) relative to the starting one; ends how far the exterior passes its own end planes; envelope the
    largest distance from the axis (absent without such a limit).
    """

    readings: tuple[Reading, ...]

    def __getitem__(self, limit: str) -> Reading:
        return next(reading for reading in self.readings if reading.limit == limit)

    def values(self) -> dict[str, float | None]:
        """As a line of the history has it: wall_mm, fold_mm, curvature, skew, stretch, envelope_mm."""
        found = {reading.limit: reading.value for reading in self.readings}
        return {
            "wall_mm": found["wall"],
            "fold_mm": found["fold"],
            "curvature": found["curvature"],
            "skew": found["skew"],
            "stretch": found["stretch"],
            "envelope_mm": found.get("envelope"),
        }

    def violated(self, tolerance: float = 0.03, distance_tolerance: float = 0.01) -> tuple[Reading, ...]:
        """The limits not held to within a fraction of their bound, which is stricter for distances and the envelope."""
        strict = {"wall", "fold", "envelope", "ends"}
        return tuple(
            reading
            for reading in self.readings
            if not reading.excess() <= (distance_tolerance if reading.limit in strict else tolerance)
        )

    def held(self, tolerance: float = 0.03, distance_tolerance: float = 0.01) -> bool:
        """Whether every limit is held; see `violated`."""
        return not self.violated(tolerance, distance_tolerance)


def report(body: Body, spec: LimitsSpec, per_span: tuple[int, int] = (8, 16)) -> LimitReport:
    """Measure a body against a problem's limits.

    Parameters
    ----------
    body : Body
    spec : problem.Limits
    per_span : (int, int)
        Samples to each knot span in q and in r.
    """
    grids = [grid(surface, per_span) for surface in body.surfaces]
    fields = [
        Fields(*(np.asarray(part) for part in grid.fields(jnp.asarray(surface.net))))
        for surface, grid in zip(body.surfaces, grids, strict=True)
    ]
    tubes = [target(field, grid, discs=False) for field, grid in zip(fields, grids, strict=True)]
    targets = [tubes[0], *(target(field, grid, discs=True) for field, grid in zip(fields[1:], grids[1:], strict=True))]
    length = float(body.exterior.net[-1, 0, 2])
    readings = [
        _worst("wall", spec.wall, _wall(targets, fields, length)),
        _worst("fold", spec.fold.distance, [*(_fold(tube, spec) for tube in tubes), *_rims(fields, grids, spec)]),
        *_shape(body, grids, spec),
        _worst("ends", 0.0, [_beyond_ends(fields[0], grids[0], length)]),
    ]
    if spec.envelope is not None:
        radius = np.hypot(fields[0].x[0], fields[0].x[1])
        readings.append(_worst("envelope", spec.envelope.radius, [_largest(radius, grids[0])]))
    return LimitReport(tuple(readings))


class Place(NamedTuple):
    """A value and where on which surface it is."""

    value: float
    surface: str
    q: float
    r: float


def _worst(limit: str, bound: float, places: Iterator[Place] | list[Place]) -> Reading:
    pick = min if limit in _AT_LEAST else max
    place = pick(places, key=lambda place: place.value)
    return Reading(limit, place.value, bound, place.surface, place.q, place.r)


def _largest(values: NDArray[np.float64], grid: Grid) -> Place:
    """The largest of the values on a grid; a value that is no number is larger than any."""
    i, j = np.unravel_index(np.argmax(np.where(np.isfinite(values), values, np.inf)), values.shape)
    return Place(float(values[i, j]), grid.name, float(grid.q[j]), float(grid.r[i]))


def _shape(body: Body, grids: list[Grid], spec: LimitsSpec) -> list[Reading]:
    bounds = {"curvature": spec.curvature, "skew": spec.skew, "stretch": spec.stretch.limit, "area": MIN_AREA}
    found = [
        measures(jnp.asarray(surface.net), grid, spec.stretch.form)
        for surface, grid in zip(body.surfaces, grids, strict=True)
    ]
    readings = []
    for name, bound in bounds.items():
        sign = -1.0 if name in _AT_LEAST else 1.0
        places = [
            _largest(sign * np.asarray(getattr(measure, name)), grid)
            for measure, grid in zip(found, grids, strict=True)
        ]
        readings.append(_worst(name, bound, [place._replace(value=sign * place.value) for place in places]))
    return readings


def _beyond_ends(fields: Fields, grid: Grid, length: float) -> Place:
    place = _largest(np.maximum(-fields.x[2], fields.x[2] - length), grid)
    return place._replace(value=max(place.value, 0.0))


def _wall(targets: list[Target], fields: list[Fields], length: float) -> Iterator[Place]:
    """Least distances of every two surfaces, asked from both sides, and of the chambers from the body's end planes."""
    for surface, field in zip(targets[1:], fields[1:], strict=True):
        place = _largest(-np.minimum(field.x[2], length - field.x[2]), surface.grid)
        yield place._replace(value=-place.value)
    least = np.inf
    for asking, asked in permutations(reversed(targets), 2):
        place = _least_wall(asking, asked, least)
        if place is not None:
            least = min(least, place.value)
            yield place


def _least_wall(asking: Target, asked: Target, bound: float) -> Place | None:
    """Least distance from one surface to another; perhaps none where it is not below a bound.

    At every other sample both ways first, then where that is least.
    """
    own = _numbers(asking)[::2, ::2]
    within, near = nearest(asking.x[own.ravel()], asked, bound + 0.1, among=_numbers(asked)[::2, ::2].ravel())
    if not within.any():
        return None
    distance = np.where(within, np.linalg.norm(asking.x[own.ravel()] - asked.x[near], axis=1), np.inf)
    close = np.flatnonzero(distance <= distance.min() + 0.1)
    distance[close], _, _ = asked.closest(asking.x[own.ravel()[close]], near[close])
    least = _lowest(distance.reshape(own.shape), 0.05).ravel()
    fine, among = _around(asking, own.ravel()[least], 2), _around(asked, near[least], 5)
    _, near = nearest(asking.x[fine], asked, np.inf, among)
    return _least_foot(asking, asked, fine, near)


def _fold(surface: Target, spec: LimitsSpec) -> Place:
    """Least distance within a tube, up to the neighbourhood's size: walls farther apart than that are no folds.

    At every fourth sample both ways first, then at every other one where that is least.
    """
    neighbourhood = spec.fold.neighbourhood
    places = [Place(neighbourhood, surface.grid.name, 0.0, 0.0)]
    own = _numbers(surface)[::4, ::4]
    source = own.ravel()
    fold = nearest_fold(surface, neighbourhood, neighbourhood + 0.1, source, among=every_other(surface.grid))
    facing = np.flatnonzero(fold.facing)
    fold.distance[facing], _, _ = surface.closest(surface.x[source[facing]], fold.near[facing])
    least = _lowest(fold.distance.reshape(own.shape), 0.2).ravel()
    if not least.any():
        return places[0]

    source = np.intersect1d(_around(surface, source[least], 4), every_other(surface.grid))
    fold = nearest_fold(surface, neighbourhood, neighbourhood, source, _around(surface, fold.near[least], 8))
    edge, facing = np.flatnonzero(np.isfinite(fold.distance) & ~fold.facing), np.flatnonzero(fold.facing)
    if len(edge):
        worst = int(edge[np.argmin(fold.distance[edge])])
        places.append(_place(fold.distance[worst], surface, int(source[worst])))
    if len(facing):
        places.append(_least_foot(surface, surface, source[facing], fold.near[facing]))
    return min(places, key=lambda place: place.value)


def _rims(fields: list[Fields], grids: list[Grid], spec: LimitsSpec) -> Iterator[Place]:
    """Least distances of tubes from the planes of their own flat ends, scaled up within the rim's neighbourhood."""
    for field, tube in zip(fields, grids, strict=True):
        if not len(tube.rings):
            continue
        shares = rim_share(tube, spec.fold.neighbourhood)
        for share, height in zip(shares, heights(field.x, tube), strict=True):
            away = np.where(share > 0.0, height / np.maximum(share, 1e-9), spec.fold.neighbourhood)
            place = _largest(-away, tube)
            yield place._replace(value=-place.value)


def _numbers(surface: Target) -> Ints:
    """Numbers of a surface's samples by row and column."""
    return np.arange(len(surface.x)).reshape(-1, surface.columns)


def _lowest(distance: Floats, slack: float) -> NDArray[np.bool_]:
    """Samples (rows, columns) no farther than their eight neighbours, and than the least of all by a slack in mm."""
    near = np.isfinite(distance) & (distance <= distance.min() + slack)
    around = minimum_filter1d(distance, 3, axis=1, mode="wrap")
    return near & (distance <= minimum_filter1d(around, 3, axis=0, mode="nearest"))


def _around(surface: Target, samples: Ints, steps: int) -> Ints:
    """The samples within so many rows and columns of some."""
    chosen = np.zeros((len(surface.x) // surface.columns, surface.columns), dtype=bool)
    chosen.ravel()[samples] = True
    around = maximum_filter1d(chosen, 2 * steps + 1, axis=1, mode="wrap")
    return np.flatnonzero(maximum_filter1d(around, 2 * steps + 1, axis=0, mode="nearest"))


def _least_foot(asking: Target, asked: Target, own: Ints, near: Ints) -> Place:
    """The least distance from samples `own` to feet near samples `near`; only such as can be the least are refined."""
    rough = np.linalg.norm(asking.x[own] - asked.x[near], axis=1)
    # A foot is at most half a cell's diagonal from its nearest sample; cells may have been stretched fourfold.
    slack = 2.0 * np.hypot(asked.across, asked.grid.step[1])
    some = np.flatnonzero(rough <= rough.min() + slack)
    distance, _, _ = asked.closest(asking.x[own[some]], near[some])
    worst = int(np.argmin(distance))
    return _place(distance[worst], asking, int(own[some[worst]]))


def _place(value: float, surface: Target, sample: int) -> Place:
    row, column = divmod(sample, surface.columns)
    row = min(max(row - surface.rings, 0), len(surface.grid.r) - 1)
    return Place(float(value), surface.grid.name, float(surface.grid.q[column]), float(surface.grid.r[row]))
