"""A body from a file by the triangles of its faces, as certificates ask about it."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pneumorph.geometry import Body
from pneumorph.geometry.lattice.pieces import Displaced, Patches, Pieces, displaced
from pneumorph.geometry.regions import Region
from pneumorph.interrupts import stop_if_asked
from pneumorph.limits.certify.enclosed import Accuracy, CellBounds, Gaps
from pneumorph.limits.lattice.beside import beside
from pneumorph.limits.lattice.neighbours import Links, balls, close_pairs
from pneumorph.limits.lattice.rims import Rims
from pneumorph.limits.lattice.triangles import bowed_distances, distances
from pneumorph.limits.rows.sampled import worst_of_cells

if TYPE_CHECKING:
    from pneumorph.problem import Limits

Floats = NDArray[np.float64]
Ints = NDArray[np.integer]
Mask = NDArray[np.bool_]

LEVELS = 12
"""Most divisions of a triangle: its pieces then deviate by less than rounding errors from flat ones."""

FULL = 5
"""After so many, only whether a limit holds is decided, not its worst value."""

FULL_OF_FOLDS = 1
"""The same within a surface, where points on the edge of the neighbourhood are the nearest ones far from the limit."""

MOST = 3_000_000
"""Most pieces, or pairs of them, at a time: where surfaces lie in each other, no more is found out."""

_NEAREST = 6
_STARTS = 256
_BROKEN = 0.5  # fraction of the limit: surfaces nearer than this need no accurate bounds
_FAR = 2.0  # largest distance that is measured, relative to the limit
# A convex function on a ball is at most the largest of its values at the corners of the octahedron around it.
_AROUND = np.sqrt(3.0) * np.vstack([np.eye(3), -np.eye(3)])


@dataclass(frozen=True, eq=False)
class EnclosedLattices:
    """An `EnclosedBody` whose cells are the triangles of its faces. Points are triangles with their second and third
    barycentric coordinates.

    Attributes
    ----------
    body : Body
    spec : problem.Limits
    between : Region
        See `EnclosedBody`.
    patches : sequence of Patches
        Of each surface, the exterior first.
    links : sequence of Links
        Which triangles of each surface are neighbours.
    rims : Rims
        Where surfaces meet.
    margins : sequence of (m,) array
        Of each surface, how far the faces of the file may be from its triangles, mm: distances count as less by that.
    """

    body: Body
    spec: Limits
    between: Region
    patches: Sequence[Patches]
    links: Sequence[Links]
    rims: Rims
    margins: Sequence[Floats]

    @property
    def own(self) -> range:
        return range(len(self.patches))

    @cached_property
    def surfaces(self) -> list[Displaced]:
        """Each surface with bounds of the derivatives of its map."""
        return [displaced(*each) for each in zip(self.body.surfaces, self.patches, strict=True)]

    @cached_property
    def whole(self) -> list[Pieces]:
        """The triangles of each surface."""
        return [surface.pieces() for surface in self.surfaces]

    def position(self, number: int, at: Floats) -> Floats:
        patch, bary = coordinates(at)
        return self.surfaces[number].at(patch, bary)

    def farthest(self, number: int, value: Callable[[Floats], Floats], accuracy: Accuracy, worst: float) -> CellBounds:
        """See `EnclosedBody.farthest`.

        Parameters
        ----------
        number, value, accuracy, worst
            As for `EnclosedBody.farthest`.
        """

        def bounds(pieces: Pieces) -> tuple[Floats, Floats]:
            attained = value(pieces.x)
            around = pieces.x[:, :, None] + pieces.error[:, None, None, None] * _AROUND
            above = np.maximum(value(around).max(axis=(1, 2)), attained.max(axis=1))
            # Along faces and edges that nothing moves, the hull of a box is exact.
            some = np.flatnonzero(above > accuracy.needed)
            bulge, hull = pieces.bulge[some, None], np.full(len(some), -np.inf)
            lower, upper = pieces.place[some].min(axis=1) - bulge, pieces.place[some].max(axis=1) + bulge
            for boxes, points in self.surfaces[number].hulls(lower, upper):
                hull[boxes] = np.maximum(hull[boxes], value(points).max(axis=1))
            above[some] = np.minimum(above[some], np.maximum(hull, attained[some].max(axis=1)))
            return above, attained

        return self.bounded(number, bounds, accuracy, worst)

    def faceted(
        self,
        number: int,
        bounds: Callable[[Floats, Floats], tuple[Floats, Floats]],
        accuracy: Accuracy,
        worst: float,
    ) -> CellBounds:
        """See `EnclosedBody.faceted`; the faces of the file may be nearer by the margins.

        Parameters
        ----------
        number, bounds, accuracy, worst
            As for `EnclosedBody.faceted`.
        """

        def with_margins(pieces: Pieces) -> tuple[Floats, Floats]:
            above, attained = bounds(pieces.x, pieces.error)
            margin = self.margins[number][pieces.patch]
            return above + margin, attained + margin[:, None]

        return self.bounded(number, with_margins, accuracy, worst)

    def bounded(
        self,
        number: int,
        bounds: Callable[[Pieces], tuple[Floats, Floats]],
        accuracy: Accuracy,
        worst: float,
    ) -> CellBounds:
        """Bounds of a quantity on the triangles of a surface.

        Parameters
        ----------
        number : int
            Index of the surface.
        bounds : function
            Upper bounds (n,) of the quantity on pieces, and its values (n, 3) at their corners.
        accuracy : Accuracy
        worst : float
            Worst value attained elsewhere.
        """
        surface, pieces = self.surfaces[number], self.whole[number]
        count = len(pieces.patch)
        upper, attained, at = np.full(count, -np.inf), np.full(count, -np.inf), np.zeros((count, 3))
        for level in range(LEVELS + 1):
            stop_if_asked()
            above, values = bounds(pieces)
            best = values.argmax(axis=1)
            here = values[np.arange(len(best)), best]
            order = np.argsort(here, kind="stable")
            better = order[here[order] > attained[pieces.patch[order]]]
            # The largest of each triangle is written last.
            attained[pieces.patch[better]] = here[better]
            corner = pieces.bary[better, best[better]]
            at[pieces.patch[better]] = np.column_stack([pieces.patch[better], corner[:, 1:]])
            needed = accuracy.enough(float(attained.max()), worst) if level < FULL else accuracy.needed
            # Whether the limit holds is decided where a face lies exactly at its bound, too.
            known = attained[pieces.patch]
            close = accuracy.close(known)
            close = np.where(known <= accuracy.needed, np.minimum(close, accuracy.needed), close)
            open_ = above > np.maximum(needed, close)
            if level == LEVELS or 4 * np.count_nonzero(open_) > MOST:
                open_[:] = False
            np.maximum.at(upper, pieces.patch[~open_], above[~open_])
            if not open_.any():
                break
            pieces = surface.divided(pieces[np.flatnonzero(open_)])
        return CellBounds(upper, attained, at)

    def near(self, first: int, second: int) -> Gaps:
        one, other = self.whole[first], self.whole[second]
        away, j = KDTree(other.x.mean(axis=1)).query(one.x.mean(axis=1), min(_NEAREST, len(other.patch)))
        j = np.asarray(j)
        i, j = np.repeat(np.arange(len(one.patch)), j.size // len(j)), j.ravel()
        if first == second:
            apart = ~self.links[first].hold(i, j)
            i, j, away = i[apart], j[apart], away.ravel()[apart]
        elif (first, second) in self.rims:
            rim = self.rims[first, second]
            apart = rim.away(one.place.mean(axis=1))[i] + rim.away(other.place.mean(axis=1))[j] >= rim.reach
            i, j, away = i[apart], j[apart], away.ravel()[apart]
        some = np.argsort(away.ravel(), kind="stable")[: _STARTS * _NEAREST]
        i, j = i[some], j[some]
        found = self._attained(first, second, one, other, i, j, distances(one.x, other.x, i, j))
        some = np.isfinite(found[0])
        return Gaps(
            np.full(np.count_nonzero(some), np.inf),
            found[0][some],
            np.stack([i, j], axis=1)[some],
            *(part[some] for part in found[1:]),
        )

    def gaps(self, first: int, second: int, accuracy: Accuracy, known: Gaps, worst: float) -> tuple[Gaps, float]:
        """See `EnclosedBody.gaps`.

        Parameters
        ----------
        first, second, accuracy, known, worst
            As for `EnclosedBody.gaps`.
        """

        def asked(attained: Floats) -> float:
            least = min(attained.min(initial=np.inf), known.attained.min(initial=np.inf), _FAR * -accuracy.bound)
            return float(-accuracy.enough(-least, -worst))

        one, other = self.whole[first], self.whole[second]
        beyond = asked(np.zeros(0))
        off = self._off(first, one) + self._off(second, other).max()
        i, j = close_pairs(one.x, other.x, beyond + off, first == second)
        pairs = np.stack([i, j], axis=1)
        lower, attained, a, b = self._distances(first, second, pairs, accuracy, asked)
        found = [known, Gaps(lower, attained, pairs, a, b)]
        return Gaps(*(np.concatenate(part) for part in zip(*found, strict=True))), beyond

    def _distances(
        self, first: int, second: int, pairs: Ints, accuracy: Accuracy, asked: Callable[[Floats], float]
    ) -> tuple[Floats, Floats, Floats, Floats]:
        """Lower bounds of the distances of pairs of triangles, attained distances, and points where these are."""
        count, bound = len(pairs), -accuracy.bound
        lower, attained = np.full(count, np.inf), np.full(count, np.inf)
        a, b = np.zeros((count, 3)), np.zeros((count, 3))
        one, other = self.whole[first], self.whole[second]
        origin, (i, j) = np.arange(count), pairs.T
        known = self.links[first].hold(i, j) if first == second else np.zeros(count, bool)
        for level in range(LEVELS + 1):
            stop_if_asked()
            (here, small), (there, large) = balls(one.x), balls(other.x)
            ours, their = self._off(first, one), self._off(second, other)
            small, large = small + ours, large + their
            least = np.linalg.norm(here[i] - there[j], axis=1) - small[i] - large[j]
            if first == second:
                within, beside = self._beside(one, other, i, j, known[origin])
                beside = beside - self.margins[first][one.patch[i]] - self.margins[first][other.patch[j]]
                least = np.where(within, np.inf, np.maximum(least, beside))
            elif (first, second) in self.rims:
                rim = self.rims[first, second]
                least = np.where(rim.farthest(one)[i] + rim.farthest(other)[j] < rim.reach, np.inf, least)
            full = level < (FULL_OF_FOLDS if first == second else FULL)
            needed = self._asked(attained, origin, accuracy, asked, full)
            measured = np.flatnonzero(least < needed)
            error = ours[i[measured]] + their[j[measured]]
            flat = distances(one.x, other.x, i[measured], j[measured], needed[measured] + error)
            gap = np.maximum(flat[0] - error, 0.0)
            short = np.flatnonzero((gap < needed[measured]) & (flat[0] > 0.0))
            bowed = self._bowed(
                first, second, one, other, i[measured[short]], j[measured[short]], flat[1][short], flat[2][short]
            )
            gap[short] = np.maximum(gap[short], bowed)
            least[measured] = np.maximum(least[measured], gap)
            # Only what may be nearer than all that is known is evaluated.
            nearer = np.flatnonzero(least[measured] < attained[origin[measured]])
            if first != second:
                nearer = nearer[worst_of_cells(-flat[0][nearer], origin[measured[nearer]])]
            some = measured[nearer]
            found = self._attained(first, second, one, other, i[some], j[some], tuple(part[nearer] for part in flat))
            order = np.argsort(-found[0], kind="stable")
            order = order[found[0][order] < attained[origin[some[order]]]]
            to = origin[some[order]]
            attained[to], a[to], b[to] = found[0][order], found[1][order], found[2][order]
            open_ = least < self._asked(attained, origin, accuracy, asked, full)
            last = level == LEVELS or 16 * np.count_nonzero(open_) > MOST
            if last or attained.min(initial=np.inf) < _BROKEN * bound:
                open_[:] = False
            np.minimum.at(lower, origin[~open_], least[~open_])
            if not open_.any():
                break
            some = np.flatnonzero(open_)
            origin, i, j = origin[some], i[some], j[some]
            one, other, origin, i, j = self._divided(first, second, one, other, origin, i, j)
        return np.maximum(lower, 0.0), attained, a, b

    def _bowed(
        self, first: int, second: int, one: Pieces, other: Pieces, i: Ints, j: Ints, u: Floats, v: Floats
    ) -> Floats:
        """Lower bounds (n,) of the distances of pairs of pieces with the closest points of their flat triangles."""
        sides, pairs = [], []
        for number, pieces, some in ((first, one, i), (second, other, j)):
            used, which = np.unique(some, return_inverse=True)
            used = pieces[used]
            bow, rest = self.surfaces[number].bows(used)
            sides.append((used.x, bow, rest + self.margins[number][used.patch]))
            pairs.append(which)
        return bowed_distances((sides[0], sides[1]), pairs[0], pairs[1], u, v)

    @staticmethod
    def _asked(
        attained: Floats, origin: Ints, accuracy: Accuracy, asked: Callable[[Floats], float], full: bool
    ) -> Floats:
        """Lower bounds (n,) that need no refinement, of pairs that come from `origin`."""
        enough = asked(attained) if full else min(asked(attained), -accuracy.needed)
        return np.minimum(enough, -accuracy.close(-np.minimum(attained, 1e9)))[origin]

    def _divided(
        self, first: int, second: int, one: Pieces, other: Pieces, origin: Ints, i: Ints, j: Ints
    ) -> tuple[Pieces, Pieces, Ints, Ints, Ints]:
        """The pairs of the four parts of pieces, of which each pair comes from `origin`."""
        here, i = np.unique(i, return_inverse=True)
        there, j = np.unique(j, return_inverse=True)
        one, other = self.surfaces[first].divided(one[here]), self.surfaces[second].divided(other[there])
        parts = np.arange(4)
        i = np.repeat((4 * i[:, None] + parts).ravel(), 4)
        j = np.tile(4 * j[:, None] + parts, (1, 4)).ravel()
        return one, other, np.repeat(origin, 16), i, j

    def _attained(
        self,
        first: int,
        second: int,
        one: Pieces,
        other: Pieces,
        i: Ints,
        j: Ints,
        flat: tuple[Floats, ...],
    ) -> tuple[Floats, Floats, Floats]:
        """Distances of points of pairs of pieces, and the points: those that are closest on the flat triangles.

        Of points within the neighbourhood on one surface, and of those beside each other at a rim, it is infinite.
        """
        _, u, v = flat
        here, there = (np.einsum("nc,ncb->nb", part, side.bary[k]) for part, side, k in ((u, one, i), (v, other, j)))
        a, b = one.patch[i], other.patch[j]
        away = np.linalg.norm(self.surfaces[first].at(a, here) - self.surfaces[second].at(b, there), axis=1)
        if first == second:
            patches = self.patches[first]
            between = np.linalg.norm(patches.places(a, here) - patches.places(b, there), axis=1)
            away[self.links[first].hold(a, b) & (between < self.spec.fold.neighbourhood)] = np.inf
        elif (first, second) in self.rims:
            rim, sides = self.rims[first, second], ((first, a, here), (second, b, there))
            over = sum(rim.away(self.patches[number].places(patch, bary)) for number, patch, bary in sides)
            away[over < rim.reach] = np.inf
        away -= self.margins[first][a] + self.margins[second][b]
        at = [np.column_stack([k.astype(float), p[:, 1:]]) for k, p in ((a, here), (b, there))]
        return away, at[0], at[1]

    def _off(self, number: int, pieces: Pieces) -> Floats:
        """How far the faces of the file may be from the flat triangles of pieces (n,) of a surface, mm."""
        return pieces.error + self.margins[number][pieces.patch]

    def _beside(self, one: Pieces, other: Pieces, i: Ints, j: Ints, known: Mask) -> tuple[Mask, Floats]:
        """Of pairs of pieces of a surface: which are wholly in the neighbourhood of each other, and lower bounds of the
        distances of points that count; see `beside`. Bounds are zero for pairs that are not linked.
        """
        within, lower = np.zeros(len(i), bool), np.zeros(len(i))
        ours, their = ((each.place, each.bulge, each.x, each.error) for each in (one, other))
        beside(ours, their, (i, j, known), self.spec.fold.neighbourhood, (within, lower))
        return within, lower


def coordinates(at: Floats) -> tuple[Ints, Floats]:
    """Triangles (n,) and barycentric coordinates (n, 3) of points (n, 3) given as in `places.Points`."""
    return at[:, 0].astype(int), np.column_stack([1.0 - at[:, 1] - at[:, 2], at[:, 1:]])
