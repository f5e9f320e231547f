"""What a boundary surface of a body is to everything after it."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

Map = Callable[[NDArray[np.float64]], NDArray[np.float64]]
"""A function of an array that gives another of the same shape."""


class Average(Protocol):
    """Averages of the coordinates of control points over their neighbours, by which steps are smooth.

    As a matrix it is symmetric, with entries that are not negative and rows that sum to at most one.
    """

    def within(self, L: sparse.csr_array) -> tuple[sparse.csr_array, Map]:
        """The average among motions L z alone, as M and a map F with Lᵀ A L = Mᵀ F M; A is the average.

        Coordinates that are images of others under a symmetry may be left out of M, (k, n) for an L (3·n_points, n) in
        which that of point i along axis k has the row 3 i + k.
        """
        ...


@dataclass(frozen=True, eq=False)
class Triangulation:
    """Six-node triangles of surfaces, whose nodes are linear in the control points.

    Attributes
    ----------
    B : (n_nodes, n_points) sparse
        Nodes are B @ P + offset.
    offset : (n_nodes, 3) float
        mm.
    faces : dict of (nf, 6) int
        Corners, then mid-side nodes of the edges 01, 12, 20; normals point from solid to void. Names are those of
        `mesh.TetMesh.faces`.
    """

    B: sparse.csr_array
    offset: NDArray[np.float64]
    faces: dict[str, NDArray[np.int64]]


class Surface(Protocol):
    """One boundary surface of a body, all of whose points are linear functions of its control points."""

    @property
    def name(self) -> str:
        """ "exterior" or the chamber's name."""
        ...

    @property
    def cavity(self) -> bool:
        """Whether the surface bounds a chamber (void) rather than the outside of the body."""
        ...

    @property
    def n_points(self) -> int:
        """Number of control points."""
        ...

    @property
    def shape(self) -> tuple[int, ...]:
        """How control points are arranged where they are stored: (n_points,), or the rows and columns of a net."""
        ...

    def control_points(self) -> NDArray[np.float64]:
        """All control points, (n_points, 3) in mm."""
        ...

    def with_control_points(self, points: NDArray[np.float64]) -> Self:
        """The same surface with other control points, (n_points, 3) in mm."""
        ...

    def shell(self) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
        """The closed surface for pictures: points (n, 3) in mm and triangles (m, 3), normals from solid to void."""
        ...

    def average(self, strength: float) -> Average:
        """The average (I + α DᵀD)^(−1/2) over differences D of neighbouring control points; `strength` is α."""
        ...


class TriangulatedSurface(Surface, Protocol):
    """A surface that is triangulated on its own, and closed."""

    def triangulation(self, size: float) -> Triangulation:
        """Triangles with edges of about this length, mm, which are closed together."""
        ...
