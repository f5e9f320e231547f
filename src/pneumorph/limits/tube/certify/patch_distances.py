"""Walls and folds: pairs of patches that are near each other, and certified lower bounds of their distances."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.certify.enclosed import Accuracy, Gaps
from pneumorph.limits.tube.certify.branch_and_bound import (
    Sides,
    approach,
    candidates,
    least_distances,
    nearest_that_count,
    spheres,
)
from pneumorph.limits.tube.certify.cells import KnotSpans, power
from pneumorph.limits.tube.certify.hull_bounds import FROM_POWERS

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

_TO_POWERS = np.round(np.linalg.inv(FROM_POWERS))

_STARTS = 256  # pairs of patches from which the nearest points of two surfaces are sought
_MAX_PAIRS = 256  # per patch: more pairs are near each other only where surfaces cross
# Passes: most subdivisions of each pair, and whether only the needed bound is to be certified, not the full accuracy.
_PASSES = ((240, False), (960, False), (4000, True), (100_000, True))
_WORK = 700  # subdivisions of all pairs in each pass, per patch
_BROKEN = 0.5  # fraction of the limit: surfaces nearer than this need no accurate bounds
_FAR = 2.0  # largest distance that is measured, relative to the limit


@dataclass(frozen=True, eq=False)
class Patches:
    """A surface as cubic Bézier patches, including the flat end discs of chambers.

    Attributes
    ----------
    nets : (n, 4, 4, 3) array
        Control points in mm, along r (s on a disc) and q.
    powers : (n, 4, 4, 3) array
        Coefficients of v^i u^j, mm.
    boxes : (n, 8) array
        Start and width in q, start and width in r, and the four coefficients of S(v).
    disc : (n,) array of bool
        Whether a patch is part of a disc, where r is that of the rim and v is s.
    own : (n,) array of bool
        Whether its knot span, or the one at its rim, is bounded; see `KnotSpans`.
    centres, radii : (n, 3) and (n,) arrays
        Balls that contain the patches.
    size : (2,) array
        τ_q and τ_r in mm.
    """

    nets: Floats
    powers: Floats
    boxes: Floats
    disc: NDArray[np.bool_]
    own: NDArray[np.bool_]
    centres: Floats
    radii: Floats
    size: Floats


def patches(surface: TubeSurface, spans: KnotSpans) -> Patches:
    """The patches of a surface with the given knot spans."""
    nets = np.moveaxis(FROM_POWERS @ spans.x @ FROM_POWERS.T, 1, -1)
    columns = surface.basis_q.spans
    shrink = np.einsum("aij,j->ai", power(surface.basis_r), surface.parallels)
    boxes = np.concatenate([spans.q, spans.r, np.repeat(shrink, columns, axis=0)], axis=1)
    if surface.poles[1]:
        # Undo the reversed direction of r in the last row, so that S and all nets have the same direction.
        nets[-columns:] = nets[-columns:, ::-1]
        boxes[-columns:, 2:4] = 1.0 - 1.0 / surface.basis_r.spans, 1.0 / surface.basis_r.spans
    disc, own, tube = np.zeros(len(nets), dtype=bool), spans.own, nets
    parts = slice(0, columns), slice(len(nets) - columns, len(nets))
    for tip, (pole, part) in enumerate(zip(surface.poles, parts, strict=True)):
        if surface.cavity and not pole:
            rim = tube[part][:, -1 if tip else 0]
            ray = np.linspace(0.0, 1.0, 4)[None, :, None, None]
            centre = surface.end_centres[tip]
            nets = np.concatenate([nets, centre + ray * (rim[:, None] - centre)])
            ring = np.concatenate([spans.q[:columns], np.tile([float(tip), 0.0, 1.0, 0.0, 0.0, 0.0], (columns, 1))], 1)
            boxes = np.concatenate([boxes, ring])
            disc = np.concatenate([disc, np.ones(columns, dtype=bool)])
            own = np.concatenate([own, spans.own[part]])
    nets = np.ascontiguousarray(nets)
    powers = np.moveaxis(_TO_POWERS @ np.moveaxis(nets, -1, 1) @ _TO_POWERS.T, 1, -1)
    centres, radii = spheres(nets)
    return Patches(nets, powers, np.ascontiguousarray(boxes), disc, own, centres, radii, np.array(surface.size))


def without_discs(surface: Patches) -> Patches:
    """The patches of the tube alone."""
    some = ~surface.disc
    names = ("nets", "powers", "boxes", "disc", "own", "centres", "radii")
    return replace(surface, **{name: getattr(surface, name)[some] for name in names})


def nearest(first: Patches, second: Patches, neighbourhood: float) -> Gaps:
    """Near points of two surfaces, or of one, without lower bounds: from the patches with the nearest centres."""
    own = np.flatnonzero(first.own)
    (q, r, S), (other_q, other_r, other_S) = _middles(first), _middles(second)

    def count(i: Ints, j: Ints) -> NDArray[np.bool_]:
        aside = np.sin(np.pi * (q[own[i]] - other_q[j])) / np.pi * np.minimum(S[own[i]], other_S[j])
        return np.hypot(aside * first.size[0], r[own[i]] - other_r[j]) >= neighbourhood

    partner, away = nearest_that_count(first.centres[own], second.centres, count)
    some = np.argsort(away, kind="stable")[:_STARTS]
    some = some[np.isfinite(away[some])]
    pairs = np.stack([own[some], partner[some]], axis=1)
    attained, at = approach(pairs, _sides(first, second), neighbourhood)
    return _gaps_of(first, second, pairs, np.full(len(pairs), np.inf), attained, at)


def _middles(surface: Patches) -> tuple[Floats, Floats, Floats]:
    """q, r in mm and S (n,) in the middle of patches."""
    box = surface.boxes.T
    S = box[4] + 0.5 * (box[5] + 0.5 * (box[6] + 0.5 * box[7]))
    return box[0] + 0.5 * box[1], (box[2] + 0.5 * box[3]) * surface.size[1], S


def _sides(first: Patches, second: Patches) -> Sides:
    """The patches of both surfaces for `branch_and_bound`."""
    nets, powers = (
        np.concatenate([getattr(each, name).reshape(-1, 48) for each in (first, second)]) for name in ("nets", "powers")
    )
    return Sides(nets, powers, np.concatenate([first.boxes, second.boxes]), first.size, len(first.nets))


def gaps(
    first: Patches, second: Patches, neighbourhood: float, accuracy: Accuracy, known: Gaps, worst: float
) -> tuple[Gaps, float]:
    """Bound the distances between the patches of two surfaces, or between those of one.

    Parameters
    ----------
    first, second : Patches
        The same object, without discs, to measure a fold.
    neighbourhood : float
        Pairs of points nearer than this on the starting tube are ignored, mm; zero for walls.
    accuracy : Accuracy
        For distances with their sign changed.
    known : Gaps
        Their near points, see `nearest`.
    worst : float
        Smallest distance attained elsewhere, mm.

    Returns
    -------
    Gaps
        Pairs of patches that are near each other, after those that were known.
    beyond : float
        Certified lower bound of the distance of all other pairs, mm.
    """
    asked = _asked(known.attained, accuracy, worst)
    pairs, away = candidates(first.centres, first.radii, second.centres, second.radii, asked, first is second)
    # One of every set of images is kept: on other surfaces either of its patches may be the one that is bounded.
    own = first.own[pairs[:, 0]] | second.own[pairs[:, 1]]
    pairs, away = pairs[own], away[own]
    beyond = asked
    most = _MAX_PAIRS * (len(first.nets) + len(second.nets))
    if len(pairs) > most:
        order = np.argsort(away, kind="stable")
        beyond = min(beyond, max(float(away[order[most]]), 0.0))
        pairs = pairs[order[:most]]
    # In random order, so that all threads have similar work.
    pairs = np.random.default_rng(0).permutation(pairs)
    lower, attained, at = _bounded(pairs, first, second, neighbourhood, accuracy, known.attained, worst)
    both = [known, _gaps_of(first, second, pairs, lower, attained, at)]
    return Gaps(*(np.concatenate(part) for part in zip(*both, strict=True))), beyond


def _asked(attained: Floats, accuracy: Accuracy, worst: float) -> float:
    """Distance beyond which nothing is refined, from attained distances on these surfaces and the least elsewhere."""
    least = min(attained.min(initial=np.inf), _FAR * -accuracy.bound)
    return -accuracy.enough(-least, -worst)


def _bounded(
    pairs: Ints,
    first: Patches,
    second: Patches,
    neighbourhood: float,
    accuracy: Accuracy,
    known: Floats,
    worst: float,
) -> tuple[Floats, Floats, Floats]:
    """Lower bounds, attained distances and their u, v for pairs of patches; difficult pairs are subdivided further."""
    lower, attained, at = np.zeros(len(pairs)), np.full(len(pairs), np.inf), np.full((len(pairs), 4), 0.5)
    bound = -accuracy.bound
    broken = known.min(initial=np.inf) < _BROKEN * bound
    sides = _sides(first, second)
    work = _WORK * (len(first.nets) + len(second.nets)) * (0.1 if broken else 1.0)
    for most, modest in _PASSES:
        asked = _asked(np.append(known, attained), accuracy, worst)
        sufficient = min(asked, -accuracy.needed) if modest else asked
        nearest = np.minimum(attained, 1e9)
        some = np.flatnonzero(lower < np.minimum(sufficient, -accuracy.close(-nearest)))
        if not len(some) or attained.min() < _BROKEN * bound:
            break
        least, near, where = least_distances(
            pairs[some],
            sides,
            neighbourhood,
            sufficient,
            (accuracy.gap, accuracy.decided, bound, -accuracy.needed),
            int(min(most, max(work / len(some), 4))),
        )
        lower[some] = np.maximum(lower[some], least)
        closer = near < attained[some]
        attained[some[closer]], at[some[closer]] = near[closer], where[closer]
    return lower, attained, at


def _gaps_of(first: Patches, second: Patches, pairs: Ints, lower: Floats, attained: Floats, at: Floats) -> Gaps:
    """The gaps of pairs of patches, with the u, v (n, 4) of their points."""
    i, j = pairs.T
    return Gaps(lower, attained, pairs, _place(first, i, at[:, :2]), _place(second, j, at[:, 2:]))


def _place(surface: Patches, patch: Ints, at: Floats) -> Floats:
    """q, r and s (n, 3) of points u, v (n, 2) on patches."""
    box, disc = surface.boxes[patch], surface.disc[patch]
    q = (box[:, 0] + at[:, 0] * box[:, 1]) % 1.0
    return np.stack([q, box[:, 2] + at[:, 1] * box[:, 3], np.where(disc, at[:, 1], 1.0)], axis=1)
