"""Certified worst values of all limits on a body: bounds that hold on the whole surfaces, not only at samples.

A value is the safe end of an enclosure, and `seen` is what some point attains. Near a limit the two differ by at most
0.3 % of its bound. Rounding errors, about 1e-13 relative, are neglected.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from typing import TYPE_CHECKING, NamedTuple, TypeVar

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.limits.certify import hull_bounds
from pneumorph.limits.certify.cells import FINE, Accuracy, SpanBounds, knot_spans
from pneumorph.limits.certify.patch_distances import Gaps, gaps, nearest, nearest_uncertified, patches, without_discs
from pneumorph.limits.certify.shape_bounds import NAMES, enclosed
from pneumorph.limits.table import BY_NAME, OF_SHAPE, Limit

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]
Mask = NDArray[np.bool_]

# Allowed difference of certified and attained values far from a limit, relative to the distance from it. Far from its
# limit a fold's nearest points are mostly on the edge of the neighbourhood, where accuracy has no use.
_RELATIVE_GAP, _FOLD_RELATIVE_GAP = 0.01, 0.8


NOISE = 1e-9
"""Values below it, in mm, 1/mm² or 1, are shown as 0."""


def without_rounding(value: float) -> float:
    """A value as it is shown: zero where it is no more than rounding."""
    return 0.0 if abs(value) < NOISE else value


@dataclass(frozen=True)
class LimitReading:
    """The worst value of one limit.

    Attributes
    ----------
    limit : str
        "wall", "fold", "curvature", "skew", "stretch", "area", "ends" or "envelope".
    value, bound : float
        In mm, 1/mm² or 1; distances and the area element must not be below the bound, all others not above it. The
        value is certified: no point of the surfaces is worse.
    surface : str
        Name of the surface with the worst point found.
    q, r : float
        Parameters of that point; on an end disc those of the nearest point of its rim.
    seen : float
        The value attained there.
    """

    limit: str
    value: float
    bound: float
    surface: str
    q: float
    r: float
    seen: float

    def excess(self) -> float:
        """Distance beyond the bound, relative to it (in mm for the ends, whose bound is zero); positive if violated."""
        return BY_NAME[self.limit].excess(self.value, self.bound)

    def seen_excess(self) -> float:
        """The same for the worst point found."""
        return BY_NAME[self.limit].excess(self.seen, self.bound)

    def __str__(self) -> str:
        limit = BY_NAME[self.limit]
        unit = f" {limit.unit}" if limit.unit == "mm" else limit.unit
        kind = "at least" if limit.at_least else "at most"
        return (
            f"{self.limit} is {without_rounding(self.value):.3g}{unit}, must be {kind} {self.bound:g}{unit}"
            f" (on {self.surface}, q = {self.q:.3f}, r = {self.r:.3f})"
        )


class Points(NamedTuple):
    """Points where a limit on single points is not certified, n of them.

    Attributes
    ----------
    surface : (n,) array
        Index of the surface; the exterior is 0.
    q, r : (n,) arrays
    seen, certified : (n,) arrays
        The value there, and the certified one for its knot span, in the limit's unit.
    """

    surface: Ints
    q: Floats
    r: Floats
    seen: Floats
    certified: Floats


class Pairs(NamedTuple):
    """Pairs of points where a limit on distances is not certified, n of them.

    Attributes
    ----------
    surface_a, surface_b : (n,) arrays
        Indices of the surfaces; the exterior is 0.
    a, b : (n, 3) arrays
        q, r and s of the closest points found: s is 1 on the tube; on an end disc (r = 0 or 1) it is the fraction of
        the way from its centre to its rim.
    seen, certified : (n,) arrays
        Their distance in mm, and the certified one of the two patches that contain them.
    """

    surface_a: Ints
    surface_b: Ints
    a: Floats
    b: Floats
    seen: Floats
    certified: Floats


@dataclass(frozen=True, eq=False)
class Places:
    """All places where limits are not certified to hold, not only the worst ones.

    Attributes
    ----------
    points : {name: Points}
        By knot span, for "curvature", "skew", "stretch", "area", "planes" (chambers too close to the
        body's end planes), "ends" (the exterior beyond them), "rim" and, if there is one, "envelope".
    pairs : {name: Pairs}
        For "wall" and "fold": for every patch the nearest other patch.
    """

    points: Mapping[str, Points]
    pairs: Mapping[str, Pairs]

    def with_others(self, other: Places) -> Places:
        """These places and those of another certificate of the same problem."""
        return Places(
            {name: joined(known, other.points[name]) for name, known in self.points.items()},
            {name: joined(known, other.pairs[name]) for name, known in self.pairs.items()},
        )

    def count(self) -> int:
        """Number of all places."""
        return sum(len(found.seen) for found in (*self.points.values(), *self.pairs.values()))


_Kind = TypeVar("_Kind", Points, Pairs)


def joined(one: _Kind, other: _Kind) -> _Kind:
    """Concatenate places of the same limit."""
    return type(one)._make(np.concatenate(parts) for parts in zip(one, other, strict=True))


@dataclass(frozen=True)
class LimitReport:
    """Certified worst values of all limits on a body, and all places where they are not certified to hold.

    wall is the smallest distance between two surfaces, or between a chamber and the body's end planes; fold the
    smallest distance within a surface outside the neighbourhood, including the surface's flat ends; area the smallest
    area element sqrt(EG - F²) relative to the starting one; ends the distance by which the exterior passes its own end
    planes; envelope the largest distance from the axis (absent without an envelope).
    """

    readings: tuple[LimitReading, ...]
    places: Places

    def __getitem__(self, limit: str) -> LimitReading:
        return next(reading for reading in self.readings if reading.limit == limit)

    def values(self) -> dict[str, float | None]:
        """Certified values by their keys in the history; None for limits that the problem does not have."""
        found = {reading.limit: reading.value for reading in self.readings}
        return {limit.key: found.get(limit.name) for limit in OF_SHAPE if limit.key is not None}

    def violated(self, slack: float = 1.0) -> tuple[LimitReading, ...]:
        """Limits that are not certified to hold within `slack` times their tolerances."""
        return tuple(
            reading for reading in self.readings if not reading.excess() <= slack * BY_NAME[reading.limit].tolerance
        )

    def satisfied(self, slack: float = 1.0) -> bool:
        """Whether every limit is held; see `violated`."""
        return not self.violated(slack)


def certify(body: Body, spec: Limits, slack: float = 1.0, own: Sequence[Mask] | None = None) -> LimitReport:
    """Certify a body against a problem's limits.

    Parameters
    ----------
    body : Body
    spec : problem.Limits
    slack : float
        The report's `places` are those where a limit is not certified within `slack` times its tolerance.
    own : sequence of (n,) bool
        For a symmetric body the knot spans of each surface that are not images of others; the report is that of all,
        with places in these alone. See `LimitSamples`.
    """
    masks = [None] * len(body.surfaces) if own is None else own
    parts = [knot_spans(surface, mask) for surface, mask in zip(body.surfaces, masks, strict=True)]
    some = [number for number, part in enumerate(parts) if part.own.any()]
    length = float(body.exterior.net[-1, 0, 2])
    tallies = {limit.name: _Tally(limit, bound, slack) for limit in OF_SHAPE if (bound := limit.read(spec)) is not None}

    tally = tallies["ends"]
    tally.points(0, hull_bounds.beyond(parts[0], length, tally.accuracy, 0.0))
    if "envelope" in tallies:
        tally = tallies["envelope"]
        tally.points(0, hull_bounds.radius(parts[0], tally.accuracy, tally.worst))
    tally = tallies["planes"]
    for number in some[1:]:
        tally.points(number, hull_bounds.beyond(parts[number], length, tally.accuracy, tally.worst))
    tally = tallies["rim"]
    for number in some:
        surface, part = body.surfaces[number], parts[number]
        if surface.ends == "flat":
            for found in hull_bounds.rims(surface, part, spec.fold.neighbourhood, tally.accuracy, tally.worst):
                tally.points(number, found)

    shapes = [tallies[name] for name in NAMES]
    for number in some:
        accuracies, worst = [tally.accuracy for tally in shapes], [tally.worst for tally in shapes]
        bounds = enclosed(body.surfaces[number], parts[number], spec.stretch.form, accuracies, worst)
        for name, found in bounds.items():
            tallies[name].points(number, found)

    sides = [patches(surface, part) for surface, part in zip(body.surfaces, parts, strict=True)]
    wall, fold = tallies["wall"], tallies["fold"]
    tubes = [without_discs(side) for side in sides]
    pairs = combinations(range(len(sides)), 2)
    couples = {(a, b): (sides[a], sides[b], 0.0) for a, b in pairs if a in some or b in some}
    single = {(a, a): (tubes[a], tubes[a], spec.fold.neighbourhood) for a in some}
    for tally, other, measured in ((wall, "planes", couples), (fold, "rim", single)):
        known = {number: nearest(*parts) for number, parts in measured.items()}
        least = min([-tallies[other].worst, *(found.seen.min(initial=np.inf) for found in known.values())])
        for number, parts in measured.items():
            tally.pairs(*number, *gaps(*parts, tally.accuracy, known[number], min(least, -tally.worst)))

    names = [surface.name for surface in body.surfaces]
    return LimitReport(
        readings=tuple(_readings(tallies, names)),
        places=Places(
            points={name: tally.single() for name, tally in tallies.items() if name not in ("wall", "fold")},
            pairs={name: tallies[name].double() for name in ("wall", "fold")},
        ),
    )


class _Tally:
    """Collects the values of one limit over all surfaces, with a sign such that larger is worse."""

    def __init__(self, limit: Limit, bound: float, slack: float) -> None:
        self.limit, self.bound = limit, bound
        self.sign = -1.0 if limit.at_least else 1.0
        scale = bound or limit.tolerance
        self.accuracy = Accuracy(
            bound=self.sign * bound,
            needed=limit.needed(bound, slack) * self.sign,
            gap=FINE * scale,
            relative_gap=_FOLD_RELATIVE_GAP if limit.name == "fold" else _RELATIVE_GAP,
        )
        self.worst, self.upper = -np.inf, -np.inf
        self.place = (0, 0.0, 0.0)
        self._points: list[Points] = []
        self._pairs: list[Pairs] = []

    def points(self, surface: int, found: SpanBounds) -> None:
        """Add the bounds on a surface's knot spans."""
        self._worst(found.upper, found.seen, surface, found.q, found.r)
        some = ~(found.upper <= self.accuracy.needed)
        self._points.append(
            Points(
                np.full(np.count_nonzero(some), surface),
                found.q[some],
                found.r[some],
                self.sign * found.seen[some],
                self.sign * found.upper[some],
            )
        )

    def pairs(self, first: int, second: int, found: Gaps, beyond: float) -> None:
        """Add the distances between two surfaces, and the lower bound `beyond` of all other pairs of patches."""
        self._worst(-found.lower, -found.seen, first, found.a[:, 0], found.a[:, 1])
        self.upper = max(self.upper, -beyond)
        some = nearest_uncertified(found, -self.accuracy.needed)
        n = len(some)
        self._pairs.append(
            Pairs(
                np.full(n, first), np.full(n, second), found.a[some], found.b[some], found.seen[some], found.lower[some]
            )
        )

    def single(self) -> Points:
        """All places of a limit on single points."""
        return Points(*(np.concatenate(part) for part in zip(*self._points, strict=True))) if self._points else _NONE

    def double(self) -> Pairs:
        """All places of a limit on distances."""
        return Pairs(*(np.concatenate(part) for part in zip(*self._pairs, strict=True))) if self._pairs else _NO_PAIRS

    def _worst(self, upper: Floats, seen: Floats, surface: int, q: Floats, r: Floats) -> None:
        if not len(upper):
            return
        self.upper = max(self.upper, float(upper.max()))
        k = int(np.argmax(seen))
        if seen[k] > self.worst:
            self.worst, self.place = float(seen[k]), (surface, float(q[k]), float(r[k]))


_NONE = Points(np.zeros(0, dtype=int), *(np.zeros(0) for _ in range(4)))
_NO_PAIRS = Pairs(
    np.zeros(0, dtype=int), np.zeros(0, dtype=int), np.zeros((0, 3)), np.zeros((0, 3)), np.zeros(0), np.zeros(0)
)

# Limits that are reported under one name.
_COUNTED = {"wall": ("wall", "planes"), "fold": ("fold", "rim")}


def _readings(tallies: Mapping[str, _Tally], names: list[str]) -> list[LimitReading]:
    readings = []
    for name, tally in tallies.items():
        if name in ("planes", "rim"):
            continue
        counted = [tallies[part] for part in _COUNTED.get(name, (name,))]
        upper, worst = max(part.upper for part in counted), max(part.worst for part in counted)
        surface, q, r = max(counted, key=lambda part: part.worst).place
        if name == "ends":
            upper, worst = max(upper, 0.0), max(worst, 0.0)
        # Nothing is attained if all patches are farther apart than the largest distance that is measured.
        worst = min(worst, upper)
        readings.append(LimitReading(name, tally.sign * upper, tally.bound, names[surface], q, r, tally.sign * worst))
    return readings
