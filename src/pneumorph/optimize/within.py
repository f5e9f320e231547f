"""Bring a design within its limits by the least smooth motion of its surfaces.

The loop does this with every design before it is analysed. All designs are feasible, so acceptance needs only the
objective (Wright & Tenny 2004, "A feasible trust-region sequential quadratic programming algorithm"). Limits depend on
the control points alone, so this costs no equilibrium.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import NamedTuple

import numpy as np
from scipy import sparse

from pneumorph.doing import counted, doing
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.limits.certify.places import Places, Points, joined, together
from pneumorph.limits.of_shape import ShapeLimits
from pneumorph.limits.report import LimitReport
from pneumorph.limits.table import BY_NAME, ROWS
from pneumorph.optimize.least_motion import least_motion
from pneumorph.optimize.linear_limits import MARGIN, LinearLimits, linear_limits
from pneumorph.optimize.settings import RepairSettings
from pneumorph.optimize.smoothing import Smoothing

REPAIR = RepairSettings()


@dataclass(frozen=True, eq=False)
class Within:
    """A design that satisfies every limit: its variables, and its certified report."""

    phi: np.ndarray
    report: LimitReport


@dataclass(frozen=True, eq=False)
class Kept:
    """Linear limits c + J (Φ − Φ₀) ≤ 0 on other things than the shape, which a repair of the shape is to keep.

    Attributes
    ----------
    phi : (n,) Φ₀, mm.
    value : (k,) c, relative to the bounds.
    jacobian : (k, n) J, 1/mm.
    accuracy : to which they are met.
    """

    phi: np.ndarray
    value: np.ndarray
    jacobian: np.ndarray
    accuracy: float

    def at(self, phi: np.ndarray) -> np.ndarray:
        """c (k,) at the design Φ (n,)."""
        return self.value + self.jacobian @ (phi - self.phi)

    def resists(self, phi: np.ndarray) -> bool:
        """Whether one is about at its bound at the design Φ (n,)."""
        return bool((self.at(phi) > -self.accuracy).any())

    def without(self) -> Kept:
        """Nothing that is to be kept."""
        return replace(self, value=self.value[:0], jacobian=self.jacobian[:0])


def within(
    space: DesignSpace,
    smooth: Smoothing,
    limits: ShapeLimits,
    phi: np.ndarray,
    reach: float = np.inf,
    settings: RepairSettings = REPAIR,
    kept: Kept | None = None,
) -> Within | LimitReport:
    """The design nearest to Φ, in the metric of smooth steps, that satisfies every limit; else the best try's report.

    No variable moves farther than `reach`. Points between samples where the certificate finds a limit violated become
    samples; where that is not enough, margins grow. Where none was found that also meets those that are to be kept,
    they are not kept.

    Parameters
    ----------
    space : DesignSpace
    smooth : Smoothing
        Of steps.
    limits : ShapeLimits
    phi : (n,) array
        Φ, mm.
    reach : float
        mm.
    settings : RepairSettings
    kept : Kept, optional
        Other limits that are to be met besides.
    """
    kept = kept or Kept(phi, np.zeros(0), np.zeros((0, space.n)), 0.0)
    lower, upper = np.maximum(space.lower, phi - reach), np.minimum(space.upper, phi + reach)
    search = _Search(space, smooth, limits, settings, reach, lower, upper, kept)
    with doing("moving surfaces within their limits") as far:
        end, resisted = _within(search, phi, far)
        if resisted and not isinstance(end, Within):
            end, _ = _within(replace(search, kept=kept.without()), phi, far)
    return end


def _within(search: _Search, phi: np.ndarray, far: Callable[[str], None]) -> tuple[Within | LimitReport, bool]:
    """What `within` does, and whether what is to be kept was in the way; `far` is told how far it is."""
    space, limits, settings = search.space, search.limits, search.settings
    margins, violated = MARGIN.copy(), None
    phi, places = search.nearest(phi, margins, None, None)
    resisted = search.kept.resists(phi)
    report = best = limits.certify(space.body(phi))
    least, stuck = np.inf, 0
    for tries in range(1, settings.certificates):
        if report.satisfied():
            break
        worst = _worst(report)
        far(f"a limit is {100 * worst:.3g} % beyond its bound after try {tries} of {settings.certificates}")
        best = report if worst <= _worst(best) else best
        progress = worst < settings.progress * least or worst < settings.slight
        least, stuck = (worst, 0) if progress else (least, stuck + 1)
        if worst > settings.hopeless or stuck == settings.certificates_in_vain:
            break
        places = {
            name: joined(new, known) for name, known in places.items() if isinstance(new := report.places[name], Points)
        }
        violated = report.places if violated is None else together(violated, report.places)
        for reading in report.violated():
            # Only where no sample is beyond the bound: added samples repair the rest, and where every limit is near, a
            # wider margin would push others beyond theirs, again and again.
            limit = BY_NAME[reading.limit]
            if limit.satisfied(reading.attained, reading.bound):
                short = abs(reading.value - reading.attained) / reading.scale
                margins[[BY_NAME[name].word == limit.word for name in ROWS]] += min(short, settings.widest)
        phi, places = search.nearest(phi, margins, places, violated)
        resisted |= search.kept.resists(phi)
        report = limits.certify(space.body(phi))
    return Within(phi, report) if report.satisfied() else min(best, report, key=_worst), resisted


def _worst(report: LimitReport) -> float:
    """The largest excess of a limit."""
    return max(reading.excess() for reading in report.readings)


@dataclass(frozen=True, eq=False)
class _Search:
    """What stays the same in a repair; no variable leaves the range from `lower` to `upper` (n,), `reach` at most."""

    space: DesignSpace
    smooth: Smoothing
    limits: ShapeLimits
    settings: RepairSettings
    reach: float
    lower: np.ndarray
    upper: np.ndarray
    kept: Kept

    def nearest(
        self, phi: np.ndarray, margins: np.ndarray, places: Mapping[str, Points] | None, violated: Places | None
    ) -> tuple[np.ndarray, Mapping[str, Points]]:
        """The design after some least motions, or the best on the way if these do not converge; its limits' places."""
        settings, kept = self.settings, self.kept
        others = sparse.csr_array(kept.jacobian)
        best, least, in_vain = phi, np.inf, 0
        resisting: Mapping[str, Points] = {}
        distances = None
        for _ in range(settings.motions):
            counted("motion")
            linear, distances = self._linear(phi, places, violated, distances)
            places = linear.rows.places
            excess = np.concatenate([linear.excess(margins), kept.at(phi)])
            margin = np.concatenate([MARGIN[linear.rows.kind], np.full(len(kept.value), kept.accuracy)])
            worst = float((excess - settings.accuracy * margin).max(initial=0.0))
            in_vain = 0 if worst < settings.progress * least else in_vain + 1
            if worst < least:
                best, least, resisting = phi, worst, places
            if worst == 0.0 or worst > settings.hopeless or in_vain == settings.motions_in_vain:
                break
            shape = slice(len(linear.rows.value))
            if in_vain and (excess[shape] <= settings.accuracy * margin[shape]).all():
                # What is to be kept besides comes no nearer, and nothing else is left to be done.
                break
            motion = least_motion(
                self.smooth,
                sparse.csr_array(sparse.vstack([linear.jacobian, others])) if len(kept.value) else linear.jacobian,
                excess,
                np.zeros(self.space.n),
                settings.met * margin,
                settings.farthest / (1.0 + worst) * min(self.reach, self._narrowest),
                len(kept.value),
                settings.motion,
            )
            phi = self.space.within_bounds(np.clip(phi + motion.smooth, self.lower, self.upper))
        return best, resisting

    @property
    def _narrowest(self) -> float:
        """The smallest distance that there may be between surfaces, mm."""
        return min(self.limits.spec.wall, self.limits.spec.fold.distance)

    def _linear(
        self,
        phi: np.ndarray,
        places: Mapping[str, Points] | None,
        violated: Places | None,
        known: _Distances | None,
    ) -> tuple[LinearLimits, _Distances]:
        """All limits linearised at Φ, where distances known near it are not measured again; and what is known then."""
        settings = self.settings
        of_distances, of_others = self.limits.of_distances
        near = settings.straight * self._narrowest
        if known is None or np.abs(phi - known.phi).max() > near:
            reach, least = settings.reach, settings.least
            known = _Distances(phi, linear_limits(self.space, of_distances, phi, reach, least, places, violated))
        others = linear_limits(self.space, of_others, phi, settings.reach, settings.least, places, violated)
        return known.linear.moved(phi - known.phi).with_others(others), known


class _Distances(NamedTuple):
    """The limits on distances as they are linearised at Φ (n,)."""

    phi: np.ndarray
    linear: LinearLimits
