"""Certified worst values of all limits on a body: bounds that hold on the whole surfaces, not only at samples.

A value is the conservative end of an enclosure, and `attained` is what some point attains. Near a limit the two differ
by at most 0.3 % of its bound. Rounding errors, about 1e-13 relative, are neglected.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from pneumorph.doing import doing
from pneumorph.limits.certify.enclosed import EnclosedBody
from pneumorph.limits.certify.places import Places
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.kinds.kind import Enclosed, Kind
from pneumorph.limits.kinds.region import ENVELOPE
from pneumorph.limits.table import BY_NAME, OF_SHAPE
from pneumorph.threads import each

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
        Its name, see `Limit`.
    value, bound : float
        In mm, 1/mm² or 1; distances and the area element must not be below the bound, all others not above it. The
        value is certified: no point of the surfaces is worse.
    surface : str
        Name of the surface with the worst point found.
    q, r : float
        Parameters of that point on a tube; on an end disc those of the nearest point of its rim.
    attained : float
        The value attained there.
    scale : float
        What distances from the bound are divided by in rows, see `Limit.scale`.
    point : (float, float, float)
        Where it is, mm.
    """

    limit: str
    value: float
    bound: float
    surface: str
    q: float
    r: float
    attained: float
    scale: float = 1.0
    point: tuple[float, float, float] = (0.0, 0.0, 0.0)

    def satisfied(self) -> bool:
        """Whether no point of the surfaces is beyond the bound."""
        return BY_NAME[self.limit].satisfied(self.value, self.bound)

    def excess(self) -> float:
        """Distance beyond the bound, relative to it (in mm for the ends, whose bound is zero); positive if violated."""
        return BY_NAME[self.limit].excess(self.value, self.bound)

    def attained_excess(self) -> float:
        """The same for the worst point found."""
        return BY_NAME[self.limit].excess(self.attained, self.bound)

    def touched(self) -> bool:
        """Whether the worst point found is at the bound, as near as the optimiser keeps designs within it."""
        return self.bound != 0.0 and abs(self.attained - self.bound) <= BY_NAME[self.limit].aim * self.scale

    def shown(self) -> str:
        """The value, with as many digits as tell it from its bound where it is beyond."""
        value = without_rounding(self.value)
        digits = next((n for n in range(3, 9) if self.satisfied() or f"{value:.{n}g}" != f"{self.bound:.{n}g}"), 9)
        return f"{value:.{digits}g}"

    def __str__(self) -> str:
        limit = BY_NAME[self.limit]
        unit = limit.suffix
        kind = "at least" if limit.at_least else "at most"
        # Rounded before it is written, so that no -0.0 is shown.
        x, y, z = (round(part, 1) + 0.0 for part in self.point)
        where = "" if limit.of_all else f" (on {self.surface}, at ({x:.1f}, {y:.1f}, {z:.1f}) mm)"
        return f"{limit.word} is {self.shown()}{unit}, must be {kind} {self.bound:g}{unit}{where}"


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
        values = {reading.limit: reading.value for reading in self.readings}
        own = (limit for limit in OF_SHAPE if limit.name in values or limit.name == ENVELOPE.name)
        return {limit.key: values.get(limit.name) for limit in own if limit.key is not None}

    def violated(self) -> tuple[LimitReading, ...]:
        """Limits that are not certified to be satisfied."""
        return tuple(reading for reading in self.readings if not reading.satisfied())

    def satisfied(self) -> bool:
        """Whether every limit is certified to be satisfied."""
        return not self.violated()


def certify(kinds: Sequence[Kind[Any, Enclosed, Any]], body: Enclosed) -> LimitReport:
    """Certify a body, as it encloses its surfaces, against its limits of some kinds, on all threads that there are."""
    tallies = {
        limit.name: Tally(limit, body.spec)
        for kind in kinds
        for limit in kind.limits
        if limit.read(body.spec) is not None
    }

    def certified(group: list[Kind[Any, Enclosed, Any]]) -> None:
        # Distances come last: they take longest, and need not be finer than what is known of end planes and rims.
        for kind in reversed(group):
            with doing(f"certifying {', '.join(dict.fromkeys(_words(kind)))}"):
                kind.certify(body, tallies)

    each(certified, _apart(kinds))
    return LimitReport(
        readings=tuple(_readings(body, tallies)),
        places={name: tally.places() for name, tally in tallies.items()},
    )


def _apart(kinds: Sequence[Kind[Any, Enclosed, Any]]) -> list[list[Kind[Any, Enclosed, Any]]]:
    """The kinds in groups: those whose limits share a name for users, of which one may be known by another."""
    groups: list[list[Kind[Any, Enclosed, Any]]] = []
    for kind in kinds:
        alike = [group for group in groups if any(set(_words(kind)) & set(_words(other)) for other in group)]
        groups = [group for group in groups if group not in alike]
        groups.append([*(one for group in alike for one in group), kind])
    return groups


def _words(kind: Kind[Any, Enclosed, Any]) -> list[str]:
    return [limit.word for limit in kind.limits]


def _readings(body: EnclosedBody, tallies: Mapping[str, Tally]) -> list[LimitReading]:
    """One reading for all limits that have the same name for users."""
    readings = []
    for word in dict.fromkeys(tally.limit.word for tally in tallies.values()):
        alike = [tally for tally in tallies.values() if tally.limit.word == word]
        limit, bound = alike[0].limit, alike[0].bound
        upper, worst = max(tally.upper for tally in alike), max(tally.worst for tally in alike)
        worst_one = max(alike, key=lambda tally: tally.worst)
        x, y, z = body.position(worst_one.surface, worst_one.at[None])[0].tolist()
        readings.append(
            LimitReading(
                limit=limit.name,
                value=limit.sign * upper,
                bound=bound,
                surface=body.body.surfaces[worst_one.surface].name,
                q=float(worst_one.at[0]),
                r=float(worst_one.at[1]),
                # Nothing is attained if all pieces are farther apart than the largest distance that is measured.
                attained=limit.sign * min(worst, upper),
                scale=alike[0].scale,
                point=(x, y, z),
            )
        )
    return readings
