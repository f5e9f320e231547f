"""Bring a design within its limits by the least smooth motion of its surfaces.

Every design that the loop analyses goes through here: a feasible-point method, whose acceptance needs no more than the
objective (Wright & Tenny 2004, "A feasible trust-region sequential quadratic programming algorithm"). Limits depend on
the control points alone, so this costs no equilibrium.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pneumorph.constraint import LimitReport, certify
from pneumorph.constraint.report import Pairs, Points, joined
from pneumorph.constraint.rows import linearised
from pneumorph.constraint.sampled import KINDS, LimitSamples
from pneumorph.constraint.table import BY_NAME
from pneumorph.geometry.design_space import DesignSpace
from pneumorph.optimize.accelerated import minimise, tightened
from pneumorph.optimize.smoothing import Smoothing
from pneumorph.optimize.subproblem import limits_by_variables

MARGIN = 0.4
"""How far within their bounds limits are brought, in the tolerances that they are held to: what is left of these is for
the certificate's own gap."""

ACCURACY = 0.1
"""To what part of their tolerances limits on samples are met."""

PROJECTIONS, CERTIFICATES, MOST_ITERATIONS = 12, 5, 200
"""Most linearisations between two certificates, most certificates, and most iterations for a motion."""

HOPELESS = 2.0
"""Motions end where limits are broken by so many times their bounds: what is linear there tells nothing."""

ELASTIC = 1e-4
"""How far rows may give way for their price, in what they would move by themselves: rows that contradict each other are
then met half way instead of by ever longer motions."""

WIDEST = 0.02
"""How much margins grow at a time, at the most."""

REACH, LEAST = 0.1, -0.05
"""Distances this much (mm) within their bound, and measures from here on (0 is the bound), are held while moving."""


TOLERANCES = np.array([BY_NAME[kind].tolerance for kind in KINDS])


@dataclass(frozen=True, eq=False)
class Within:
    """A design that keeps every limit: its variables, and the report that says so."""

    phi: np.ndarray
    report: LimitReport


def within(space: DesignSpace, smooth: Smoothing, limits: LimitSamples, phi: np.ndarray) -> Within | LimitReport:
    """The design nearest to Φ, in the metric of smooth steps, that keeps every limit; else what is left broken.

    Places between samples where a certificate finds a limit broken become samples, and margins grow where that is not
    enough.
    """
    margins, places, pairs = MARGIN * TOLERANCES, None, None
    phi, places = _projected(space, smooth, limits, phi, margins, places, pairs)
    found = certify(space.body(phi), limits.spec)
    for attempt in range(1, CERTIFICATES):
        if found.satisfied():
            break
        # New places first: of those close together the first stays.
        places = {name: joined(found.places.points[name], known) for name, known in places.items()}
        new = found.places.pairs
        pairs = new if pairs is None else {name: joined(known, new[name]) for name, known in pairs.items()}
        for reading in found.violated():
            # What no sample between can mend: what the certificate is short of what is seen, and what it has not told.
            short = reading.excess() - (0.0 if attempt > 1 else reading.seen_excess())
            beyond = np.array([BY_NAME[kind].word == BY_NAME[reading.limit].word for kind in KINDS])
            margins[beyond] += min(max(short, 0.0), WIDEST)
        phi, places = _projected(space, smooth, limits, phi, margins, places, pairs)
        found = certify(space.body(phi), limits.spec)
    return Within(phi, found) if found.satisfied() else found


def _projected(
    space: DesignSpace,
    smooth: Smoothing,
    limits: LimitSamples,
    phi: np.ndarray,
    margins: np.ndarray,
    places: Mapping[str, Points] | None,
    pairs: Mapping[str, Pairs] | None,
) -> tuple[np.ndarray, Mapping[str, Points]]:
    """The design after some least motions, the best on the way where they do not settle; places that resisted them."""
    best, least = phi, np.inf
    resisting: Mapping[str, Points] = {}
    for _ in range(PROJECTIONS):
        rows = linearised(limits, space.body(phi), REACH, LEAST, places, pairs)
        places = rows.places
        excess = rows.value + margins[rows.kind]
        worst = float((excess - ACCURACY * TOLERANCES[rows.kind]).max(initial=0.0))
        if worst < least:
            best, least, resisting = phi, worst, places
        if worst == 0.0 or worst > HOPELESS:
            break
        motion = least_motion(smooth, limits_by_variables(space, rows.jacobian), excess, np.zeros(space.n))
        phi = np.clip(phi + motion.smooth, space.lower, space.upper)
    return best, resisting


@dataclass(frozen=True, eq=False)
class Motion:
    """A smooth step Ψ = S z: raw z and smooth Ψ, (n,) each."""

    raw: np.ndarray
    smooth: np.ndarray


def least_motion(smooth: Smoothing, jacobian: sparse.csr_array, excess: np.ndarray, slope: np.ndarray) -> Motion:
    """The smooth step Ψ = S z with the least slope·Ψ + ½‖z‖² that keeps c + J Ψ ≤ 0, nearly.

    By its dual, min ½‖Sᵀ(slope + Jᵀλ)‖² − cᵀλ + ½ λᵀελ over λ ≥ 0, whose z is −Sᵀ(slope + Jᵀλ); ε lets rows give way.
    """
    transposed, moduli = sparse.csr_array(jacobian.T), abs(jacobian)

    def raw(price: np.ndarray) -> np.ndarray:
        return -smooth.transpose(slope + transposed @ price)

    def product(price: np.ndarray) -> np.ndarray:
        return jacobian @ smooth.apply(smooth.transpose(transposed @ price))

    whole = moduli @ smooth.moduli.apply(smooth.moduli.transpose(moduli.T @ np.ones(len(excess))))
    scale = tightened(np.maximum(whole, 1e-12), product)
    elastic = ELASTIC * scale
    found = minimise(
        lambda price: elastic * price - (excess + jacobian @ smooth.apply(raw(price))),
        np.maximum(excess, 0.0) / scale,
        np.zeros(len(excess)),
        np.full(len(excess), np.inf),
        scale + elastic,
        MOST_ITERATIONS,
        0.0,
    )
    z = raw(found)
    return Motion(z, smooth.apply(z))
