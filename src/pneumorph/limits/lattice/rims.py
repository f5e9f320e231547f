"""Rims of ports, in which a chamber meets the exterior: beside them no wall is between the two."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import combinations
from typing import Protocol

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.pieces import Patches
from pneumorph.limits.lattice.neighbours import balls

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]

REACH = 2.0
"""Points of both surfaces are beside each other if the way between them over the rim is shorter, relative to the wall:
where the surfaces meet at more than 60°, others are farther apart than the wall."""

_STEPS = np.linspace(0.0, 1.0, 9)


class InFile(Protocol):
    """Pieces of a surface as it is in the file."""

    @property
    def place(self) -> Floats:
        """Their corners (n, 3, 3), mm."""
        ...

    @property
    def bulge(self) -> Floats:
        """How far points of the surface may be from the flat triangles of the corners (n,), mm."""
        ...


@dataclass(frozen=True, eq=False)
class Rim:
    """The rim between two surfaces.

    Attributes
    ----------
    points : (k, 3) array
        Of the rim in the file, mm.
    reach : float
        The length over the rim, by the nearest of these points, up to which points are beside each other, mm.
    """

    points: Floats
    reach: float

    @cached_property
    def _tree(self) -> KDTree:
        return KDTree(self.points)

    def away(self, places: Floats) -> Floats:
        """Distances (n,) of places (n, 3) in the file from the rim, mm."""
        return np.asarray(self._tree.query(places)[0], dtype=float)

    def farthest(self, pieces: InFile) -> Floats:
        """Upper bounds (n,) of the distances of the points of pieces."""
        centres, radii = balls(pieces.place)
        return self.away(centres) + radii + pieces.bulge


Rims = dict[tuple[int, int], Rim]
"""By the numbers of the surfaces that meet, the lower one first."""


def rims_of(surfaces: Sequence[LatticeSurface], patches: Sequence[Patches], wall: float) -> Rims:
    """The rims between surfaces of a body with walls of this thickness, mm."""
    rims = {}
    for first, second in combinations(range(len(surfaces)), 2):
        shared = _shared(surfaces[first].outline, surfaces[second].outline)
        own = surfaces[first].patches
        points = []
        for edge in range(3):
            after = (edge + 1) % 3
            some = np.flatnonzero(shared[own[:, [edge, after, 3 + edge]]].all(axis=1))
            bary = np.zeros((len(_STEPS), 3))
            bary[:, edge], bary[:, after] = 1.0 - _STEPS, _STEPS
            points.append(patches[first].places(np.repeat(some, len(_STEPS)), np.tile(bary, (len(some), 1))))
        points = np.concatenate(points)
        if len(points):
            rims[first, second] = Rim(points, REACH * wall)
    return rims


def _shared(one: Floats, other: Floats) -> NDArray[np.bool_]:
    """Which points (n, 3) are among others (m, 3)."""
    both, inverse = np.unique(np.concatenate([one, other]), axis=0, return_inverse=True)
    among = np.zeros(len(both), bool)
    among[inverse.ravel()[len(one) :]] = True
    return among[inverse.ravel()[: len(one)]]
