"""Whether a piece of the outer mould comes off: how far the rubber must give way while it is pulled off.

A piece is moved along its direction in small steps. Where one of its points is then inside the body, the rubber must
move aside by the depth of that point below the piece's surface. Divided by the thickness of the rubber there this is a
strain, and it is conservative: a thin fin of a bellows bends instead.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from pneumorph.make.mould.samples import Samples

Array = NDArray[np.float64]

EVERY = 3
"""Of the samples, half a millimetre apart, only every third one is used: depths vary over millimetres."""

_STEP = 0.6
"""mm by which a piece is moved at a time; samples are half a millimetre apart."""
_FREE = 1.02  # stretch that needs no better split


@dataclass(frozen=True, eq=False)
class Release:
    """What pulling off one piece does to the rubber.

    Attributes
    ----------
    direction : (3,) array
        Unit vector in which the piece is pulled.
    depth : float
        Largest distance in mm by which rubber must move aside.
    stretch : float
        1 + the largest ratio of that distance to the thickness of the rubber.
    place : (3,) array
        Where that is.
    """

    direction: Array
    depth: float
    stretch: float
    place: Array


def release(exterior: Samples, thickness: Array, start: float, stop: float, every: int = 1) -> Release:
    """Pull off the piece between two partings.

    Parameters
    ----------
    exterior : Samples
    thickness : (n,) array
        Of the rubber behind each sample, mm.
    start, stop : float
        Angles of the partings about z, radians, start < stop.
    every : int
        Only every `every`-th sample is used.
    """
    middle, half = (start + stop) / 2.0, (stop - start) / 2.0
    direction = np.array([np.cos(middle), np.sin(middle), 0.0])

    def inside(points: Array) -> NDArray[np.bool_]:
        angle = np.arctan2(points[:, 1], points[:, 0]) - middle
        return np.abs((angle + np.pi) % (2.0 * np.pi) - np.pi) <= half

    return pulled(exterior, exterior.points[::every], thickness[::every], direction, inside)


def pulled(
    surface: Samples,
    points: Array,
    thickness: Array,
    direction: Array,
    inside: Callable[[Array], NDArray[np.bool_]],
) -> Release:
    """Pull off a piece that a surface forms.

    Parameters
    ----------
    surface : Samples
    points : (n, 3) array
        Those of the surface that may be in the way of the piece.
    thickness : (n,) array
        Of what gives way at them, mm.
    direction : (3,) array
        Unit vector in which the piece is pulled.
    inside : callable
        Which of some points (m, 3) on the piece's side of the surface belong to the piece.
    """
    depth = np.zeros(len(points))
    for way in np.arange(_STEP, 2.0 * np.hypot(*points[:, :2].T).max(), _STEP):
        # Points of the body that lie in the piece as it has moved so far.
        back = points - way * direction
        some = np.flatnonzero(inside(back))
        if not len(some):
            break
        depth[some] = np.maximum(depth[some], surface.outside(back[some]))
    strain = depth / np.maximum(thickness, 1e-9)
    worst = int(np.argmax(strain))
    return Release(direction, float(depth.max()), 1.0 + float(strain[worst]), points[worst])


def partings(exterior: Samples, thickness: Array, given: list[float], most: float) -> tuple[list[float], list[Release]]:
    """Angles of the fewest partings that allow every piece to be pulled off, and how each piece comes off.

    Parameters
    ----------
    given : list of float
        Angles at which stems leave through the side; there must be a parting at each.
    most : float
        Largest stretch of the rubber.
    """
    best: tuple[float, list[float]] = (np.inf, [])
    for count in (2, 3, 4, 6):
        turn = 2.0 * np.pi / count
        for offset in [0.0] if given else np.arange(0.0, turn, turn / 6.0):
            angles = _with_given(given, offset, count)
            if max(np.diff([*angles, angles[0] + 2.0 * np.pi])) > np.pi + 1e-6:
                continue
            worst = max(release(exterior, thickness, *pair, every=11).stretch for pair in sectors(angles))
            if worst < best[0] - 1e-3:
                best = worst, angles
            if worst < _FREE:
                break
        if best[0] <= 1.0 + 0.8 * (most - 1.0):
            break
    return best[1], [release(exterior, thickness, *pair, every=EVERY) for pair in sectors(best[1])]


def sectors(angles: list[float]) -> list[tuple[float, float]]:
    """The ranges of angles between partings."""
    return list(zip(angles, [*angles[1:], angles[0] + 2.0 * np.pi], strict=True))


def _with_given(given: list[float], offset: float, count: int) -> list[float]:
    """Equally spaced angles; with given ones, those and the fewest more that split what is wider than the spacing."""
    turn = 2.0 * np.pi / count
    if not given:
        return [offset + k * turn for k in range(count)]
    fixed = sorted({round(angle % (2.0 * np.pi), 9) for angle in given})
    angles = []
    for start, stop in sectors(fixed):
        pieces = int(np.ceil((stop - start) / turn - 1e-6))
        angles += [start + k * (stop - start) / pieces for k in range(pieces)]
    return sorted(angles)
