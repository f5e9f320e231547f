"""Where the cuts of a sector meet the chambers around the axis: across the wall from where they meet the exterior."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.geometry.tube.surface import TubeSurface

_AROUND, _ALONG = 240, 80  # places on a chamber that a line may go through
_FASTEST = 24  # places by which a line may go around from one place along to the next
_STEEPNESS = 1.0
"""Cost of a millimetre along the tube over which the line goes around by as much, in that of one where the distance
between the lines is twice the least."""
_NARROW = 0.3  # of the largest circumference; towards a pole, turns count as if it were no smaller


@dataclass(frozen=True)
class Slant:
    """What is added to q along a tube, by linear interpolation between the places r (k,)."""

    r: np.ndarray
    q: np.ndarray

    def at(self, r: np.ndarray) -> np.ndarray:
        """What is added at r (...)."""
        return np.interp(r, self.r, self.q)


UPRIGHT = Slant(np.array([0.0, 1.0]), np.zeros(2))


def slant_of(chamber: TubeSurface, exterior: TubeSurface, begin: float, q: float) -> Slant:
    """The slant of a chamber's line q, so that its horizontal distance from the exterior's line q = begin is small.

    It is the path of least cost: the distance relative to the least one at each r, and the square of the steepness. A
    cut between these lines goes straight through the wall, also where both wind around the axis.

    Parameters
    ----------
    chamber, exterior : TubeSurface
    begin, q : float
        The lines of the exterior and of the chamber, parameters around.
    """
    r, around = np.linspace(0.0, 1.0, _ALONG), np.arange(_AROUND) / _AROUND
    line = exterior.sample(np.array([begin]), np.linspace(0.0, 1.0, 8 * _ALONG))[:, 0]
    line = line[np.argsort(line[:, 2], kind="stable")]
    places = chamber.sample(q + around, r)
    across = np.stack([np.interp(places[..., 2], line[:, 2], line[:, axis]) for axis in (0, 1)], axis=-1)
    distance = np.linalg.norm(places[..., :2] - across, axis=-1)
    thickness = distance / distance.min(axis=1, keepdims=True) - 1.0
    girth = np.linalg.norm(np.diff(places, axis=1, append=places[:, :1]), axis=-1).sum(axis=1)
    girth = np.maximum(girth, _NARROW * girth.max())
    step = np.linalg.norm(np.diff(places, axis=0), axis=-1).mean(axis=1)

    turn = np.arange(-_FASTEST, _FASTEST + 1)
    cost, came = thickness[0] * step[0], []
    for k in range(_ALONG - 1):
        # From every place (second axis) to those after turns (first axis).
        steep = _STEEPNESS * (turn / _AROUND * girth[k]) ** 2 / step[k]
        onwards = np.stack([np.roll(cost, int(each)) for each in turn]) + steep[:, None]
        best = onwards.argmin(axis=0)
        came.append(turn[best])
        cost = onwards[best, np.arange(_AROUND)] + thickness[k + 1] * step[k]
    place, path = int(cost.argmin()), [0]
    for turns in reversed(came):
        path.append(path[-1] - int(turns[place]))
        place = (place - int(turns[place])) % _AROUND
    # The path was followed backwards; `place` is now where it begins.
    slant = (place + np.array(path[::-1]) - path[-1]) / _AROUND
    ends = np.concatenate([slant[:1], slant[:1], slant, slant[-1:], slant[-1:]])
    slant = np.convolve(ends, np.full(5, 0.2), "valid")
    return Slant(r, slant - np.round(slant.mean()))
