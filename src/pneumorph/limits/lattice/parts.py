"""The triangles of the surfaces of a body from a file in flat parts, and which of these can be near each other.

Pairs of parts that are near each other are found for one design and used for all that are near it: a flat triangle
moves no farther than its corners, so that a distance changes by no more than the corners of both have moved. Which
pairs are found within a distance does not depend on the design for which they were kept.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from itertools import combinations_with_replacement

import numba
import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.pieces import PARTS, Patches, displaced
from pneumorph.limits.lattice.neighbours import Links, balls, close_pairs
from pneumorph.limits.lattice.rims import Rim, Rims
from pneumorph.limits.lattice.triangles import distances

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]
Mask = NDArray[np.bool_]

KEPT = 0.5
"""How much farther pairs are kept than they were asked for, relative to that: as much as surfaces move in a design."""

_WAY = np.array([0.8, 0.55, 0.24])
"""Of images of each other the farthest along this way counts: no symmetry keeps it."""


@dataclass(frozen=True, eq=False)
class Parts:
    """The triangles of a surface, each in four flat ones between its nodes.

    Attributes
    ----------
    patch : (n,) array
        The triangle of each.
    bary : (n, 3, 3) array
        Barycentric coordinates of their corners there.
    nodes : (n, 3) array
        Numbers of their corners among the nodes of the surface.
    place : (n, 3, 3) array
        Their corners in the file, mm.
    bulge : (n,) array
        How far points of the surface in the file may be from them, mm.
    margin : (n,) array
        How far the faces of the file may be from them in any design, mm.
    """

    patch: Ints
    bary: Floats
    nodes: Ints
    place: Floats
    bulge: Floats
    margin: Floats

    @cached_property
    def ball(self) -> tuple[Floats, Floats]:
        """Centres (n, 3) and radii (n,) of balls that contain them in the file, mm."""
        centres, radii = balls(self.place)
        return centres, radii + self.bulge


def parts_of(surface: LatticeSurface, patches: Patches, margins: Floats) -> Parts:
    """The parts of a surface whose triangles have these margins (m,), mm."""
    still = displaced(surface.with_control_points(surface.lattice.points()), patches)
    pieces = still.divided(still.pieces())
    nodes = surface.patches[:, PARTS].reshape(-1, 3)
    return Parts(pieces.patch, pieces.bary, nodes, pieces.place, pieces.bulge, margins[pieces.patch])


def foremost(group: Sequence[Floats], places: Floats, spread: Floats) -> Mask:
    """Which of balls with centres (n, 3) and radii (n,) contain points that are the foremost of their images.

    Parameters
    ----------
    group : sequence of (3, 3) array
        The symmetries; places with the same image under all of them are foremost together.
    places : (n, 3) array
    spread : (n,) array
    """
    found = np.ones(len(places), bool)
    for operation in group:
        normal = _WAY - operation.T @ _WAY
        found &= places @ normal >= -spread * np.linalg.norm(normal) - 1e-9
    return found


@dataclass(eq=False)
class Kept:
    """Pairs of parts of two surfaces, or of one, that may be near each other.

    Attributes
    ----------
    one, other : Parts
    links : Links or None
        Of one surface: pairs that are wholly in the neighbourhood of each other are left out.
    neighbourhood : float
        mm.
    rim : Rim or None
        Of two surfaces: pairs that are wholly beside each other at it are left out.
    group : sequence of (3, 3) array
        Symmetries: of pairs that are images of each other only the foremost count.
    """

    one: Parts
    other: Parts
    links: Links | None
    neighbourhood: float
    rim: Rim | None
    group: Sequence[Floats] = ()
    _sought: float = -np.inf
    _corners: tuple[Floats, Floats] = field(default_factory=lambda: (np.zeros(0), np.zeros(0)))
    _pairs: tuple[Ints, Ints] = field(default_factory=lambda: (np.zeros(0, int), np.zeros(0, int)))
    _lower: Floats = field(default_factory=lambda: np.zeros(0))
    _linked: Mask = field(default_factory=lambda: np.zeros(0, bool))

    def within(
        self, one: Floats, other: Floats, far: float, beside: Mask | None = None
    ) -> tuple[Ints, Ints, Floats, Floats, Floats]:
        """Pairs within a distance, in ascending order; their distances, and the closest points (n, 3) of both.

        Distances count as less by the margins of both.

        Parameters
        ----------
        one, other : (n, 3, 3) and (m, 3, 3) arrays
            Corners of the parts as they are displaced, mm.
        far : float
            mm.
        beside : (n,) array, optional
            Parts of whose neighbours along the surface none is to be found.
        """
        moved = [_farthest(here, there) for here, there in zip((one, other), self._corners, strict=True)]
        if self._sought < far + moved[0].max(initial=0.0) + moved[1].max(initial=0.0):
            self._find(one, other, (1.0 + KEPT) * far)
            moved = [np.zeros(len(one)), np.zeros(len(other))]
        i, j = self._pairs
        change = moved[0][i] + moved[1][j]
        near = self._lower - change < far
        if beside is not None:
            near &= ~(self._linked & beside[i] & beside[j])
        near = np.flatnonzero(near)
        i, j = i[near], j[near]
        less = self.one.margin[i] + self.other.margin[j]
        distance, u, v = distances(one, other, i, j, far + less)
        distance -= less
        self._lower[near] = np.maximum(self._lower[near], distance - change[near])
        some = np.flatnonzero(distance < far)
        return i[some], j[some], distance[some], u[some], v[some]

    def _find(self, one: Floats, other: Floats, far: float) -> None:
        """Keep the pairs that may be within a distance, mm."""
        own, their = self.one.margin, self.other.margin
        i, j = close_pairs(one, other, far + own + their.max(initial=0.0), self.links is not None)
        (here, small), (there, large) = self.one.ball, self.other.ball
        counts = foremost(self.group, here[i] + there[j], small[i] + large[j])
        if self.links is not None:
            counts &= i < j
        if self.rim is not None:
            counts &= self.rim.farthest(self.one)[i] + self.rim.farthest(self.other)[j] >= self.rim.reach
        i, j = i[counts], j[counts]
        linked = np.zeros(len(i), bool)
        if self.links is not None:
            linked = self.links.hold(self.one.patch[i], self.one.patch[j])
            apart = ~(linked & _together(self.one.place, self.one.bulge, i, j, self.neighbourhood))
            i, j, linked = i[apart], j[apart], linked[apart]
        (here, small), (there, large) = balls(one), balls(other)
        lower = np.linalg.norm(here[i] - there[j], axis=1) - (small + own)[i] - (large + their)[j]
        self._sought, self._corners, self._pairs, self._lower, self._linked = far, (one, other), (i, j), lower, linked


def kept_pairs(
    parts: Sequence[Parts], links: Sequence[Links], neighbourhood: float, rims: Rims, group: Sequence[Floats] = ()
) -> dict[tuple[int, int], Kept]:
    """What is kept of each surface with itself and with those after it.

    Parameters
    ----------
    parts : sequence of Parts
        Of all surfaces.
    links : sequence of Links
        Which triangles of each are neighbours.
    neighbourhood : float
        Of the limit on folds, mm.
    rims : Rims
        Where surfaces meet.
    group : sequence of (3, 3) array
        Symmetries: of pairs that are images of each other only the foremost count.
    """
    found = {}
    for first, second in combinations_with_replacement(range(len(parts)), 2):
        own = links[first] if first == second else None
        rim = rims.get((first, second))
        found[first, second] = Kept(parts[first], parts[second], own, neighbourhood, rim, group)
    return found


def _farthest(here: Floats, there: Floats) -> Floats:
    """How far the corners of triangles (n, 3, 3) have moved at most, (n,)."""
    if here.shape != there.shape:
        return np.zeros(len(here))
    return np.sqrt(((here - there) ** 2).sum(axis=2).max(axis=1))


@numba.njit(cache=True, nogil=True)
def _together(place, bulge, i, j, neighbourhood):
    """Whether all points of both parts of a pair are nearer to each other than a distance."""
    found = np.zeros(len(i), np.bool_)
    for n in range(len(i)):
        a, b = place[i[n]], place[j[n]]
        room = neighbourhood - bulge[i[n]] - bulge[j[n]]
        inside = room > 0.0
        for k in range(9):
            if not inside:
                break
            away = 0.0
            for c in range(3):
                away += (a[k // 3, c] - b[k % 3, c]) ** 2
            inside = away < room * room
        found[n] = inside
    return found
