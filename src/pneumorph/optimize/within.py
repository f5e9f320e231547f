"""Bring a design within its limits by the least smooth motion of its surfaces.

The loop does this with every design before it is analysed. All designs are feasible, so acceptance needs only the
objective (Wright & Tenny 2004, "A feasible trust-region sequential quadratic programming algorithm"). Limits depend on
the control points alone, so this costs no equilibrium.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pneumorph.geometry.design_space import DesignSpace
from pneumorph.limits.certify.places import Places, Points, joined, together
from pneumorph.limits.of_shape import ShapeLimits
from pneumorph.limits.report import LimitReport
from pneumorph.limits.table import BY_NAME, ROWS
from pneumorph.optimize.accelerated import minimise, tightened
from pneumorph.optimize.linear_limits import MARGIN, linear_limits
from pneumorph.optimize.smoothing import Smoothing

ACCURACY = 0.5
"""Fraction of the margins to which limits are met at samples; the rest is for the accuracy of the certificate."""

PROJECTIONS, CERTIFICATES, MOST_ITERATIONS = 16, 7, 200
"""Most linearisations between two certificates, most certificates, and most iterations for each motion."""

LOST, STUCK, NEARER = 5, 2, 0.98
"""It ends after this many motions in a row, and this many certificates, none of which leaves less than the last part of
the least excess before. Limits may come back after more, but a shorter step costs less."""

SLIGHT = 0.01
"""A certificate that finds limits exceeded by less than this part of their bounds does not count for that: such places
are few, between samples, and others each time."""

HOPELESS = 100.0
"""Motions end where a limit is exceeded by this multiple of its bound. A motion may well exceed one by ten times: what
is quadratic in the control points, such as stretch, then comes down by three quarters with each of the next."""

MET = 0.25
"""Fraction of the margins to which a motion meets the linearised limits; they are linearised again after it."""

ELASTIC = 1e-4
"""Compliance of the rows, relative to their own scale: rows that contradict each other are then met half way instead of
by ever longer motions."""

WIDEST = 0.02
"""Largest growth of a margin at a time."""

REACH, LEAST = 0.1, -0.05
"""Distances up to this far (mm) within their bound, and measures above this value (0 is the bound), are kept as limits
during motions."""


@dataclass(frozen=True, eq=False)
class Within:
    """A design that keeps every limit: its variables, and its certified report."""

    phi: np.ndarray
    report: LimitReport


def within(
    space: DesignSpace, smooth: Smoothing, limits: ShapeLimits, phi: np.ndarray, reach: float = np.inf
) -> Within | LimitReport:
    """The design nearest to Φ, in the metric of smooth steps, that keeps every limit; else the report of the last try.

    No variable moves farther than `reach`. Places between samples where the certificate finds a limit broken become
    samples; where that is not enough, margins grow.

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
    """
    margins, broken = MARGIN.copy(), None
    lower, upper = np.maximum(space.lower, phi - reach), np.minimum(space.upper, phi + reach)
    phi, places = _projected(space, smooth, limits, phi, lower, upper, margins, None, None)
    report = limits.certify(space.body(phi))
    least, stuck = np.inf, 0
    for _ in range(1, CERTIFICATES):
        if report.satisfied():
            break
        worst = max(reading.excess() for reading in report.violated())
        least, stuck = (worst, 0) if worst < NEARER * least or worst < SLIGHT else (least, stuck + 1)
        if worst > HOPELESS or stuck == STUCK:
            break
        # New places come first: of places close together the first is kept.
        places = {
            name: joined(new, known) for name, known in places.items() if isinstance(new := report.places[name], Points)
        }
        broken = report.places if broken is None else together(broken, report.places)
        for reading in report.violated():
            # Only where no point that was seen is beyond the bound: added points repair the rest, and where every limit
            # is near, a wider margin would push others beyond theirs, again and again.
            limit = BY_NAME[reading.limit]
            if limit.satisfied(reading.seen, reading.bound):
                short = abs(reading.value - reading.seen) / reading.scale
                margins[[BY_NAME[name].word == limit.word for name in ROWS]] += min(short, WIDEST)
        phi, places = _projected(space, smooth, limits, phi, lower, upper, margins, places, broken)
        report = limits.certify(space.body(phi))
    return Within(phi, report) if report.satisfied() else report


def _projected(
    space: DesignSpace,
    smooth: Smoothing,
    limits: ShapeLimits,
    phi: np.ndarray,
    lower: np.ndarray,
    upper: np.ndarray,
    margins: np.ndarray,
    places: Mapping[str, Points] | None,
    broken: Places | None,
) -> tuple[np.ndarray, Mapping[str, Points]]:
    """The design after some least motions, or the best on the way if they do not converge; and places of its limits."""
    best, least, lost = phi, np.inf, 0
    resisting: Mapping[str, Points] = {}
    for _ in range(PROJECTIONS):
        linear = linear_limits(space, limits, phi, REACH, LEAST, places, broken)
        places, excess = linear.rows.places, linear.excess(margins)
        worst = float((excess - ACCURACY * MARGIN[linear.rows.kind]).max(initial=0.0))
        lost = 0 if worst < NEARER * least else lost + 1
        if worst < least:
            best, least, resisting = phi, worst, places
        if worst == 0.0 or worst > HOPELESS or lost == LOST:
            break
        accuracy = MET * MARGIN[linear.rows.kind]
        motion = least_motion(smooth, linear.jacobian, excess, np.zeros(space.n), accuracy)
        phi = np.clip(phi + motion.smooth, lower, upper)
    return best, resisting


@dataclass(frozen=True, eq=False)
class SmoothMotion:
    """A smooth step Ψ = S z: raw z and smooth Ψ, (n,) each."""

    raw: np.ndarray
    smooth: np.ndarray


def least_motion(
    smooth: Smoothing, jacobian: sparse.csr_array, excess: np.ndarray, slope: np.ndarray, accuracy: np.ndarray | float
) -> SmoothMotion:
    """The smooth step Ψ = S z with the least slope·Ψ + ½‖z‖² that keeps c + J Ψ ≤ 0, nearly.

    By its dual, min ½‖Sᵀ(slope + Jᵀλ)‖² − cᵀλ + ½ λᵀελ over λ ≥ 0, whose z is −Sᵀ(slope + Jᵀλ); ε lets rows give way.
    Multipliers are changed until every row is met to its `accuracy` (m,), or as far as some iterations bring them.

    Parameters
    ----------
    smooth : Smoothing
    jacobian : csr (m, n)
        J, 1/mm.
    excess : (m,) array
        c.
    slope : (n,) array
        Per mm.
    accuracy : float or (m,) array
        To which rows are met.
    """
    transposed, moduli = sparse.csr_array(jacobian.T), abs(jacobian)

    def raw(multiplier: np.ndarray) -> np.ndarray:
        return -smooth.transpose(slope + transposed @ multiplier)

    def product(multiplier: np.ndarray) -> np.ndarray:
        return jacobian @ smooth.apply(smooth.transpose(transposed @ multiplier))

    whole = moduli @ smooth.moduli.apply(smooth.moduli.transpose(moduli.T @ np.ones(len(excess))))
    scale = tightened(np.maximum(whole, 1e-12), product)
    elastic = ELASTIC * scale
    multipliers = minimise(
        lambda multiplier: elastic * multiplier - (excess + jacobian @ smooth.apply(raw(multiplier))),
        np.maximum(excess, 0.0) / scale,
        np.zeros(len(excess)),
        np.full(len(excess), np.inf),
        scale + elastic,
        MOST_ITERATIONS,
        accuracy / (scale + elastic),
    )
    z = raw(multipliers)
    return SmoothMotion(z, smooth.apply(z))
