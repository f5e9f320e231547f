"""The limit on the volume of rubber."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.cad.shells import quarters
from pneumorph.geometry.lattice.pieces import Pieces
from pneumorph.limits.certify.enclosed import CellBounds
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.lattice.enclosed import EnclosedLattices
from pneumorph.limits.lattice.sampled import SampledLattices
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.sampled import Near, RowBlock

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

VOLUME = Limit(
    "volume", "volume of rubber", "mm³", False, 0.005, "volume_mm3", lambda limits: limits.volume, of_all=True
)

LEVELS = 3
"""Most divisions of all triangles, each into four."""

ENOUGH = 0.001
"""Error of the volume, relative to its bound, below which triangles are not divided further."""


@dataclass(frozen=True)
class Volumes:
    """The volume between all surfaces."""

    limits: tuple[Limit, ...] = (VOLUME,)

    def rows(self, at: SampledLattices, near: Near) -> Iterator[RowBlock]:
        bound = VOLUME.read(at.spec)
        if bound is None:
            return
        volume, slope = 0.0, np.zeros((at.body.n_points, 3))
        for surface, where in zip(at.body.surfaces, at.body.slices, strict=True):
            own, by = volume_within(surface.shell()[0], surface.patches)
            volume += own
            slope[where] = surface.lattice.weights(surface.outline).T @ by
        value = volume / bound - 1.0
        if value > near.least:
            column = np.arange(slope.size)
            yield RowBlock(
                np.zeros(1, int), np.zeros(1, int), np.array([value]), column[None], slope.reshape(1, -1) / bound
            )

    def rows_at(self, at: SampledLattices, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        # What it depends on has its row already.
        yield from ()

    def certify(self, body: EnclosedLattices, tallies: Mapping[str, Tally]) -> None:
        """Enclose the volume, by flat triangles and by what may be between these and the faces.

        Points of a face are nowhere farther from those of its flat triangle than `Pieces.error`, and the faces of the
        file by no more than the margin from those.
        """
        bound = VOLUME.read(body.spec)
        if bound is None:
            return
        pieces = list(body.whole)
        volume, error = _enclosed(pieces, body.margins)
        for _ in range(LEVELS):
            if volume + error <= bound or error <= ENOUGH * bound:
                break
            pieces = [surface.divided(each) for surface, each in zip(body.surfaces, pieces, strict=True)]
            volume, error = _enclosed(pieces, body.margins)
        attained = sum(volume_within(each.shell()[0], each.patches)[0] for each in body.body.surfaces)
        middle = np.array([[0.0, 1.0 / 3.0, 1.0 / 3.0]])
        upper = np.array([max(volume + error, attained)])
        tallies[VOLUME.name].points(0, CellBounds(upper, np.array([attained]), middle))

    def shares(self, at: SampledLattices, number: int) -> Iterator[tuple[str, Floats]]:
        # It is used everywhere alike.
        yield from ()

    def smooth(self, at: Any) -> dict[str, Any]:
        return {}


def _enclosed(pieces: Sequence[Pieces], margins: Sequence[Floats]) -> tuple[float, float]:
    """The volume within the flat triangles of the pieces of all surfaces, and a bound of its error, mm³."""
    volume, error = 0.0, 0.0
    for own, margin in zip(pieces, margins, strict=True):
        volume += _flat(own.x.reshape(-1, 3), np.arange(3 * len(own.x)).reshape(-1, 3))[0]
        error += float((own.error + margin[own.patch]) @ own.area)
    return volume, error


def volume_within(points: Floats, patches: Ints) -> tuple[float, Floats]:
    """The volume within six-node triangles with these nodes (k, 3), and its derivatives (k, 3) by them.

    The error of flat triangles is a quarter with halves of their edges.
    """
    (fine, by_fine), (rough, by_rough) = _flat(points, quarters(patches)), _flat(points, patches[:, :3])
    return (4.0 * fine - rough) / 3.0, (4.0 * by_fine - by_rough) / 3.0


def _flat(points: Floats, triangles: Ints) -> tuple[float, Floats]:
    """The same within flat triangles (m, 3)."""
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    slopes = np.cross(b, c) / 6.0, np.cross(c, a) / 6.0, np.cross(a, b) / 6.0
    by = np.zeros_like(points)
    for corner, slope in zip(triangles.T, slopes, strict=True):
        np.add.at(by, corner, slope)
    return float(np.einsum("ti,ti->", a, slopes[0])), by
