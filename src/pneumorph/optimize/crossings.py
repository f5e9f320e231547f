"""Keep designs from intersecting themselves where a step would have made them: gaps that the next steps are told of.

A trial whose body intersects itself shows where: places on both sides that meet. At the design before it they are
apart, and how far, along the line between the nearest points beside them, is linearised by an adjoint for each gap, as
limits on states are. The gaps are measured again at every design from then on.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from pneumorph.analysis import Analysis, Discretisation, SelfIntersecting, gap_slope
from pneumorph.geometry import DesignSpace
from pneumorph.limits.lattice.triangles import distances
from pneumorph.mechanics.contact.skin import Places
from pneumorph.objective import Gap


@dataclass(frozen=True)
class CrossingSettings:
    """Which gaps steps are told of, and what they are to leave of them."""

    around: float = 2.0
    """Radius around a place, in sizes of elements, within which its nearest points are looked for."""

    apart: float = 0.4
    """The same over the distance of both places in the body at rest, if that is less: else the bottom of a groove that
    closes would be nearer."""

    same: float = 1.0
    """Crossings that are nearer to each other than this, in sizes of elements, have one gap."""

    left: float = 0.1
    """Of the size of elements: the gap that is left in the end."""

    share: float = 0.3
    """Of the gap that there is, if that is more: gaps are known to first order only."""

    most: int = 6
    """Most gaps of a task: those that were crossed last."""


CROSSINGS = CrossingSettings()


@dataclass(frozen=True, eq=False)
class Crossing:
    """Places on both sides of a gap in the state of a task, (2, 3) in mm of the body at rest."""

    task: str
    places: np.ndarray


def pack(crossings: Sequence[Crossing]) -> dict[str, Any]:
    """Arrays from which `unpack` restores crossings."""
    places = np.reshape([each.places for each in crossings], (-1, 2, 3))
    return {"crossing tasks": np.array([each.task for each in crossings], str), "crossing places": places}


def unpack(arrays: Mapping[str, Any], tasks: Iterable[str]) -> tuple[Crossing, ...]:
    """The crossings of a checkpoint, those in tasks of the problem; none of one that does not fit."""
    names, places = (np.asarray(arrays.get(f"crossing {key}", ())) for key in ("tasks", "places"))
    if places.dtype.kind != "f" or places.shape != (len(names), 2, 3) or not np.isfinite(places).all():
        return ()
    known = set(tasks)
    return tuple(Crossing(str(name), each) for name, each in zip(names, places, strict=True) if str(name) in known)


@dataclass(frozen=True, eq=False)
class MeasuredGap:
    """A gap of a design: its width (mm), the same as a function of states on its mesh, and where it is."""

    width: float
    gap: Gap
    crossing: Crossing


def crossings_of(disc: Discretisation, crossed: SelfIntersecting) -> list[Crossing]:
    """Where the body of a trial would intersect itself: a place in each part that does, the largest parts first.

    Parameters
    ----------
    disc : the mesh of the trial.
    crossed : how it would.
    """
    assert crossed.last is not None
    both = disc.skin.crossings(crossed.X + crossed.last.u)
    # Of a symmetric body, one of all images: with a place on the part that is solved.
    own = both.only(np.any(np.all(both.nodes < len(crossed.X), axis=2), axis=1))
    left = own.at(disc.skin.whole.vectors(crossed.X))
    found: list[Crossing] = []
    times: list[int] = []
    while len(left):
        near = _near(disc, left, left[0])
        found.append(Crossing(crossed.task, left[0]))
        times.append(int(np.count_nonzero(near)))
        left = left[~near]
    return [found[number] for number in np.argsort(times)[::-1][: CROSSINGS.most]]


def joined(disc: Discretisation, known: Sequence[Crossing], new: Sequence[Crossing]) -> tuple[Crossing, ...]:
    """Crossings with new ones, which take the place of those that are near; of each task the last of them."""
    kept: list[Crossing] = []
    for each in (*new, *reversed(known)):
        of_task = sum(other.task == each.task for other in kept)
        if of_task < CROSSINGS.most and not is_known(disc, kept, each):
            kept.append(each)
    return tuple(reversed(kept))


def is_known(disc: Discretisation, known: Iterable[Crossing], crossing: Crossing) -> bool:
    """Whether a crossing is near one that is known."""
    return any(each.task == crossing.task and _near(disc, each.places, crossing.places) for each in known)


def _near(disc: Discretisation, places: np.ndarray, others: np.ndarray) -> np.ndarray:
    """Whether places on both sides (…, 2, 3) are near to others (2, 3), in any order."""
    away = np.array([np.linalg.norm(places - each, axis=-1).max(axis=-1) for each in (others, others[::-1])])
    return away.min(axis=0) <= CROSSINGS.same * disc.morph.size


def measured(disc: Discretisation, analysis: Analysis, crossings: Iterable[Crossing]) -> list[MeasuredGap]:
    """The gaps of a design, each once; those that are closed are left out.

    Parameters
    ----------
    disc, analysis : the mesh of the design, and its states.
    crossings : near which they are.
    """
    gaps: list[MeasuredGap] = []
    for each in crossings:
        found = _measured(disc, analysis, each)
        if found is not None and not is_known(disc, (gap.crossing for gap in gaps), found.crossing):
            gaps.append(found)
    return gaps


def _measured(disc: Discretisation, analysis: Analysis, crossing: Crossing) -> MeasuredGap | None:
    whole, size = disc.skin.whole, disc.morph.size
    at_rest, x = (whole.vectors(part) for part in (analysis.X, analysis.X + analysis.equilibria[crossing.task].u))
    one, other = crossing.places
    reach = min(CROSSINGS.around * size, CROSSINGS.apart * float(np.linalg.norm(one - other)))
    ends = _nearest(x, *(disc.skin.near(place, reach, analysis.X, size) for place in crossing.places))
    across = ends[0].at(x) - ends[1].at(x)
    if (width := float(np.linalg.norm(across))) == 0.0:
        return None
    weights = np.zeros_like(analysis.X)
    for end, along in zip(ends, (across / width, -across / width), strict=True):
        np.add.at(weights, whole.source[end.nodes], end.weights[:, None] * (along @ whole.turn[end.nodes]))
    return MeasuredGap(width, Gap(weights), Crossing(crossing.task, np.array([end.at(at_rest) for end in ends])))


def _nearest(x: np.ndarray, one: Places, other: Places) -> tuple[Places, Places]:
    """The nearest places on triangles on two sides, whose corners are (n, 3) and (m, 3), with nodes at x (N, 3)."""
    i, j = np.divmod(np.arange(len(one.nodes) * len(other.nodes)), len(other.nodes))
    distance, u, v = distances(one.at(x), other.at(x), i, j)
    at = int(distance.argmin())
    first, second = one.only(i[at]), other.only(j[at])
    return Places(first.nodes[0], u[at] @ first.weights), Places(second.nodes[0], v[at] @ second.weights)


def gap_rows(
    space: DesignSpace, disc: Discretisation, analysis: Analysis, gaps: Sequence[MeasuredGap]
) -> tuple[np.ndarray, np.ndarray]:
    """Rows c (k,) and J (k, n) of c + J Ψ ≤ 0, over the size of elements: c is what a step is to leave, less the gap.

    Parameters
    ----------
    space, disc, analysis : the design space, the mesh of the design, and its states.
    gaps : of the design.
    """
    size = disc.morph.size
    slopes = [-gap_slope(space, disc, analysis, each.crossing.task, each.gap) / size for each in gaps]
    values = [(_to_leave(each.width, size) - each.width) / size for each in gaps]
    return np.array(values), np.reshape(slopes, (-1, space.n))


def _to_leave(width: float, size: float) -> float:
    """What a step has to leave of a gap: at most that, for there must be such a step."""
    return max(CROSSINGS.share * width, min(CROSSINGS.left * size, width))
