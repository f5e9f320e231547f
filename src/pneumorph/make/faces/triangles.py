"""Triangulation of bodies from files with a guaranteed chord error, closed across all faces."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np
from numpy.typing import NDArray

from pneumorph.errors import ComputationError
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.between import Interface
from pneumorph.geometry.lattice.pieces import Displaced, displaced, patches_of, places_on
from pneumorph.make.triangles import MAX_TRIANGLES, Triangles

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

# The parts of a triangle by its corners 0, 1, 2 and the middles 3, 4, 5 of its edges 01, 12, 20: where edge 01 alone is
# divided, and where all are. Other edges are turned to 01.
_HALVES = np.array([[0, 3, 2], [3, 1, 2]])
_QUARTERS = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
_TURNED = np.array([[0, 1, 2, 3, 4, 5], [1, 2, 0, 4, 5, 3], [2, 0, 1, 5, 3, 4]])
_MIDDLES = np.array([[0.5, 0.5, 0.0], [0.0, 0.5, 0.5], [0.5, 0.0, 0.5]])
SAMPLES = np.array(
    [np.bincount(each, minlength=3) / 4.0 for each in combinations_with_replacement(range(3), 4)], dtype=float
)
"""Barycentric coordinates of points of a triangle, edges included."""
_CORNERS = [SAMPLES[:, corner].argmax() for corner in range(3)]


@dataclass(frozen=True, eq=False)
class _Between:
    """The triangles of an interface, of which the distance from flat ones is measured at points."""

    interface: Interface

    def at(self, patch: Ints, bary: Array) -> Array:
        nodes = self.interface.outline[self.interface.patches]
        return self.interface.moved(places_on(nodes, patch, bary))

    def errors(self, patch: Ints, bary: Array) -> Array:
        count = len(SAMPLES)
        inside = np.einsum("sc,ncb->nsb", SAMPLES, bary).reshape(-1, 3)
        x = self.at(np.repeat(patch, count), inside).reshape(len(patch), count, 3)
        flat = np.einsum("sc,ncd->nsd", SAMPLES, x[:, _CORNERS])
        return np.linalg.norm(x - flat, axis=2).max(axis=1)


def _errors(sheet: Displaced | _Between, patch: Ints, bary: Array) -> Array:
    """How far a surface may be from flat triangles (n,), mm."""
    return sheet.errors(patch, bary) if isinstance(sheet, _Between) else sheet.between(patch, bary).error


def triangulated(parts: Sequence[LatticeSurface | Interface], chord: float) -> list[Triangles]:
    """The triangles of surfaces and interfaces, or parts of them; where these meet, they have the same edges.

    All have the same points, of which each uses some. Triangles are divided where a surface may be farther from them
    than the chord error, see `pieces`, or where an interface is.

    Parameters
    ----------
    parts : sequence of LatticeSurface or Interface
    chord : float
        Largest distance of the surfaces, in the six-node triangles of the faces in the file, from the triangles, mm.

    Raises
    ------
    ComputationError
        If that needs more than `MAX_TRIANGLES`.
    """
    surfaces = [_Between(part) if isinstance(part, Interface) else displaced(part, patches_of(part)) for part in parts]
    # Surfaces that meet in the rim of a port have the same nodes there.
    places = np.concatenate([surface.outline for surface in parts])
    _, first, number = np.unique(places, axis=0, return_index=True, return_inverse=True)
    starts = np.cumsum([0, *(len(surface.outline) for surface in parts)])
    number = number.ravel()
    points = np.concatenate([surface.shell()[0] for surface in parts])[first]
    corners = [number[start + each.patches[:, :3]] for start, each in zip(starts[:-1], parts, strict=True)]
    patches = [np.arange(len(each.patches)) for each in parts]
    bary = [np.tile(np.eye(3), (len(each), 1, 1)) for each in patches]
    while True:
        wrong = [
            _errors(surface, patch, own) > chord for surface, patch, own in zip(surfaces, patches, bary, strict=True)
        ]
        if not any(each.any() for each in wrong):
            return [Triangles(points, each) for each in corners]
        ends = _divided_edges(corners, wrong, len(points))
        if sum(map(len, corners)) + 2 * len(ends) > MAX_TRIANGLES:
            raise ComputationError(
                f"the body needs more than {MAX_TRIANGLES} triangles for a chord error of {chord:g} mm; allow a larger "
                "error"
            )
        made = np.zeros((len(ends), 3))
        for which, surface in enumerate(surfaces):
            finer = _divided(corners[which], patches[which], bary[which], ends, len(points))
            corners[which], patches[which], bary[which], at = finer
            made[at[0]] = surface.at(at[1], at[2])
        points = np.concatenate([points, made])


def _keys(corners: Ints, count: int) -> Ints:
    """A number (n, 3) for each edge of triangles between points 0 to `count`."""
    low, high = np.sort(np.stack([corners, np.roll(corners, -1, axis=1)], axis=2), axis=2).transpose(2, 0, 1)
    return low * count + high


def _divided_edges(corners: Sequence[Ints], wrong: Sequence[NDArray[np.bool_]], count: int) -> Ints:
    """The edges to divide, by their numbers in order: those of wrong triangles, and no two of any other triangle."""
    keys = [_keys(each, count) for each in corners]
    edges = np.unique(np.concatenate([each[those].ravel() for each, those in zip(keys, wrong, strict=True)]))
    while True:
        more = [each[np.isin(each, edges).sum(axis=1) == 2].ravel() for each in keys]
        larger = np.union1d(edges, np.concatenate(more))
        if len(larger) == len(edges):
            return edges
        edges = larger


def _divided(
    corners: Ints, patches: Ints, bary: Array, ends: Ints, count: int
) -> tuple[Ints, Ints, Array, tuple[Ints, Ints, Array]]:
    """Triangles with some edges divided: their corners, patches and barycentric coordinates there.

    Also the new vertices, by their place among the divided edges, with patch and barycentric coordinates.
    """
    keys = _keys(corners, count)
    divided = np.isin(keys, ends)
    six = np.concatenate([corners, count + np.searchsorted(ends, keys)], axis=1)
    places = np.concatenate([bary, np.einsum("sc,ncb->nsb", _MIDDLES, bary)], axis=1)
    many = divided.sum(axis=1)
    triangle, edge = np.nonzero(divided)
    new = six[triangle, 3 + edge] - count, patches[triangle], places[triangle, 3 + edge]
    kept, once, whole = (np.flatnonzero(many == number) for number in (0, 1, 3))
    turn = _TURNED[divided[once].argmax(axis=1)]
    found_corners, found_bary = [corners[kept]], [bary[kept]]
    for some, parts in ((once[:, None], turn[:, _HALVES]), (whole[:, None], np.tile(_QUARTERS, (len(whole), 1, 1)))):
        found_corners.append(six[some[:, :, None], parts].reshape(-1, 3))
        found_bary.append(places[some[:, :, None], parts].reshape(-1, 3, 3))
    patch = np.concatenate([patches[kept], np.repeat(patches[once], 2), np.repeat(patches[whole], 4)])
    return np.concatenate(found_corners), patch, np.concatenate(found_bary), new
