"""Walls and folds: which patches are near which, and how near they certainly are not."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from pneumorph.constraint.cells import Aim, Homes, power
from pneumorph.constraint.extent import FROM_POWERS
from pneumorph.constraint.separation import candidates, least_distances, nearest_centres, spheres
from pneumorph.geometry import TubeSurface

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

_FIRST = 256  # pairs that tell how near patches come before the others are looked at
_MOST = 16  # pairs to each patch: more are near each other only where surfaces cross
# Parts of a pair looked at, at first and where that was not enough; at last, whether only to show what is needed.
_PASSES = ((60, False), (240, False), (960, False), (4000, True), (100_000, True))
_WORK = 700  # parts of all pairs looked at each time, to each patch
_BROKEN = 0.5  # part of the limit: where surfaces are nearer, nothing finer matters
_FAR = 2.0  # times the limit: up to which distance patches are measured


@dataclass(frozen=True, eq=False)
class Patches:
    """A surface as cubic patches, the chambers' flat end discs among them.

    Attributes
    ----------
    nets : (n, 4, 4, 3) array
        Control points in mm, along r (on a disc along s) and q.
    boxes : (n, 8) array
        q and its width, r and its width, and the coefficients of S(v).
    disc : (n,) array of bool
        Whether a patch is of a disc, where r is that of the rim and v is s.
    centres, radii : (n, 3) and (n,) arrays
        Balls around the patches.
    size : (2,) array
        τ_q and τ_r in mm.
    """

    nets: Floats
    boxes: Floats
    disc: NDArray[np.bool_]
    centres: Floats
    radii: Floats
    size: Floats


class Gaps(NamedTuple):
    """Pairs of places between surfaces or within one, n of them.

    Certified and seen distances in mm, the numbers (n, 2) of the patches on either side, and both places (n, 3): q, r
    and s, the part of the way from an end disc's centre to its rim (1 on the tube).
    """

    lower: Floats
    seen: Floats
    patch: Ints
    a: Floats
    b: Floats


def patches(surface: TubeSurface, homes: Homes) -> Patches:
    """The patches of a surface."""
    nets = np.moveaxis(FROM_POWERS @ homes.x @ FROM_POWERS.T, 1, -1)
    columns = surface.basis_q.spans
    shrink = np.einsum("aij,j->ai", power(surface.basis_r), surface.parallels)
    boxes = np.concatenate([homes.q, homes.r, np.repeat(shrink, columns, axis=0)], axis=1)
    if surface.ends == "pole":
        # The last row runs backwards; here it need not, so that S and the nets have one direction.
        nets[-columns:] = nets[-columns:, ::-1]
        boxes[-columns:, 2:4] = 1.0 - 1.0 / surface.basis_r.spans, 1.0 / surface.basis_r.spans
    disc, tube = np.zeros(len(nets), dtype=bool), nets
    if surface.cavity and surface.ends == "flat":
        for tip, part in ((False, slice(0, columns)), (True, slice(-columns, None))):
            rim = tube[part][:, -1 if tip else 0]
            ray = np.linspace(0.0, 1.0, 4)[None, :, None, None]
            centre = surface.end_centres[int(tip)]
            nets = np.concatenate([nets, centre + ray * (rim[:, None] - centre)])
            ring = np.concatenate([homes.q[:columns], np.tile([float(tip), 0.0, 1.0, 0.0, 0.0, 0.0], (columns, 1))], 1)
            boxes = np.concatenate([boxes, ring])
            disc = np.concatenate([disc, np.ones(columns, dtype=bool)])
    nets = np.ascontiguousarray(nets)
    centres, radii = spheres(nets)
    return Patches(nets, np.ascontiguousarray(boxes), disc, centres, radii, np.array(surface.size))


def without_discs(surface: Patches) -> Patches:
    """The tube alone."""
    some = ~surface.disc
    nets, boxes = surface.nets[some], surface.boxes[some]
    return Patches(nets, boxes, surface.disc[some], surface.centres[some], surface.radii[some], surface.size)


def gaps(first: Patches, second: Patches, neighbourhood: float, aim: Aim, worst: float) -> tuple[Gaps, float]:
    """Bound the distances of two surfaces' patches, or of one's among each other.

    Parameters
    ----------
    first, second : Patches
        Without discs where they are the same, to measure a fold.
    neighbourhood : float
        Points nearer each other on the starting tube do not count; zero for walls.
    aim : Aim
        In distances with their sign turned.
    worst : float
        The least distance known elsewhere.

    Returns
    -------
    Gaps
        Of the pairs of patches that are near each other; the first is the two whose middles are nearest, with no bound
        of its own.
    beyond : float
        A distance that all other pairs certainly keep.
    """
    same = first is second
    bound = -aim.bound
    parts = (first.centres, second.centres, first.boxes, second.boxes)
    known, *nearest = nearest_centres(*parts, first.size, neighbourhood)

    def enough(seen: float) -> float:
        return -aim.enough(-min(seen, _FAR * bound), -worst)

    asked = enough(known)
    pairs, away = candidates(first.centres, first.radii, second.centres, second.radii, asked, same)
    beyond = asked
    order = np.argsort(away, kind="stable")
    most = _MOST * (len(first.nets) + len(second.nets))
    if len(order) > most:
        beyond = min(beyond, max(float(away[order[most]]), 0.0))
        order = order[:most]
    middle = np.full((1, 2), 0.5)
    rough_a, rough_b = _place(first, np.array(nearest[:1]), middle), _place(second, np.array(nearest[1:]), middle)
    work = _WORK * (len(first.nets) + len(second.nets))
    found = [Gaps(np.full(1, np.inf), np.array([known]), np.array([nearest]), rough_a, rough_b)]
    # The nearest first; then the others, no two neighbours beside each other, so that all threads have like work.
    for some in (order[:_FIRST], np.random.default_rng(0).permutation(order[_FIRST:])):
        if not len(some):
            continue
        lower, seen, at = _bounded(pairs[some], first, second, neighbourhood, asked, aim, work)
        i, j = pairs[some].T
        found.append(Gaps(lower, seen, pairs[some], _place(first, i, at[:, :2]), _place(second, j, at[:, 2:])))
        asked = min(asked, enough(min(known, float(seen.min()))))
        beyond = min(beyond, asked)
        if seen.min() < _BROKEN * bound:
            work *= 0.1
    return Gaps(*(np.concatenate(part) for part in zip(*found, strict=True))), beyond


def foremost(found: Gaps, needed: float) -> NDArray[np.integer]:
    """Numbers of the pairs seen but not certified to be so far apart: of those of each patch, the nearest."""
    some = np.flatnonzero(~(found.lower >= needed))
    some = some[np.isfinite(found.seen[some])]
    some = some[np.argsort(found.seen[some], kind="stable")]
    first = [np.unique(found.patch[some, side], return_index=True)[1] for side in (0, 1)]
    return some[np.unique(np.concatenate(first))]


def _bounded(
    pairs: Ints,
    first: Patches,
    second: Patches,
    neighbourhood: float,
    asked: float,
    aim: Aim,
    work: float,
) -> tuple[Floats, Floats, Floats]:
    """Lower bounds, seen distances and their u, v for pairs of patches; hard ones get more work, within limits."""
    lower, seen, at = np.zeros(len(pairs)), np.full(len(pairs), np.inf), np.full((len(pairs), 4), 0.5)
    bound = -aim.bound
    for most, modest in _PASSES:
        target = min(asked, -aim.needed) if modest else asked
        known = np.minimum(seen, 1e9)
        some = np.flatnonzero(lower < np.minimum(target, known - aim.gap * np.maximum(1.0, known / bound)))
        if not len(some) or seen.min() < _BROKEN * bound:
            break
        found, near, where = least_distances(
            pairs[some],
            first.nets,
            second.nets,
            first.boxes,
            second.boxes,
            first.size,
            neighbourhood,
            target,
            aim.gap,
            bound,
            int(min(most, max(work / len(some), 4))),
        )
        lower[some] = np.maximum(lower[some], found)
        closer = near < seen[some]
        seen[some[closer]], at[some[closer]] = near[closer], where[closer]
    return lower, seen, at


def _place(surface: Patches, patch: Ints, at: Floats) -> Floats:
    """q, r and s (n, 3) of places u, v (n, 2) on patches."""
    box, disc = surface.boxes[patch], surface.disc[patch]
    q = (box[:, 0] + at[:, 0] * box[:, 1]) % 1.0
    return np.stack([q, box[:, 2] + at[:, 1] * box[:, 3], np.where(disc, at[:, 1], 1.0)], axis=1)
