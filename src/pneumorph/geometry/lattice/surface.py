"""Surfaces of any shape in a trivariate cubic B-spline lattice over their box (free-form deformation; Sederberg and
Parry 1986)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray
from scipy import linalg, sparse

from pneumorph.cad.shells import quarters
from pneumorph.geometry.bspline import Basis, uniform
from pneumorph.geometry.surface import Map

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Lattice:
    """Trivariate cubic B-splines over a box.

    Attributes
    ----------
    lower, upper : (3,) float
        Corners of the box, mm.
    spans : (3,) int
        Knot spans along x, y and z.
    """

    lower: Array
    upper: Array
    spans: tuple[int, int, int]

    @property
    def bases(self) -> list[Basis]:
        """Along x, y and z."""
        return [uniform(count) for count in self.spans]

    def points(self) -> Array:
        """Control points (n, 3), mm, with which every place is where it is."""
        axes = [self.lower[k] + basis.greville * (self.upper - self.lower)[k] for k, basis in enumerate(self.bases)]
        return np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)

    def weights(self, places: Array, order: tuple[int, int, int] = (0, 0, 0)) -> sparse.csr_array:
        """B (m, n): places (m, 3) in the box, in mm, are B @ points; or its partial derivatives along x, y and z.

        Places outside the box get the weights of the nearest ones in it.
        """
        numbers, values = self.sums(places, order)
        rows = np.repeat(np.arange(len(places)), numbers.shape[1])
        return sparse.csr_array((values.ravel(), (rows, numbers.ravel())), (len(places), self.count))

    def sums(self, places: Array, order: tuple[int, int, int] = (0, 0, 0)) -> tuple[NDArray[np.int64], Array]:
        """The same as numbers of control points and their weights, (m, 64) each."""
        values, numbers = np.ones((len(places), 1)), np.zeros((len(places), 1), int)
        for k, basis in enumerate(self.bases):
            width = self.upper[k] - self.lower[k]
            t = np.clip((places[:, k] - self.lower[k]) / width, 0.0, 1.0)
            first = np.clip((t * basis.spans).astype(int), 0, basis.spans - 1)
            near = first[:, None] + np.arange(basis.degree + 1)
            own = np.take_along_axis(basis.matrix(t, order[k]), near, axis=1) / width ** order[k]
            shape = len(places), values.shape[1] * own.shape[1]
            values = (values[:, :, None] * own[:, None, :]).reshape(shape)
            numbers = (numbers[:, :, None] * basis.count + near[:, None, :]).reshape(shape)
        return numbers, values

    @property
    def count(self) -> int:
        """Number of control points."""
        return int(np.prod([basis.count for basis in self.bases]))


@dataclass(frozen=True, eq=False)
class LatticeAverage:
    """Averages along the three directions of a lattice, by a symmetric matrix for each."""

    along: tuple[Array, ...]

    def within(self, L: sparse.csr_array) -> tuple[sparse.csr_array, Map]:
        """See `Average`."""
        n = int(np.prod([len(each) for each in self.along]))
        return L[np.arange(3 * n).reshape(n, 3).T.ravel()], self.apply

    def apply(self, coordinates: Array) -> Array:
        """The averages of coordinates (3 n,): all x of the control points, then all y, then all z."""
        x, y, z = self.along
        moved = (x @ coordinates.reshape(3, len(x), -1)).reshape(3, len(x), len(y), len(z))
        return (y @ moved @ z).ravel()


@dataclass(frozen=True, eq=False)
class LatticeSurface:
    """One boundary surface of a body from a file.

    Attributes
    ----------
    name : str
        "exterior" or that of a chamber.
    cavity : bool
        See `Surface`.
    lattice : Lattice
        In which all of it lies.
    net : (n, 3) float
        Control points, mm.
    outline : (k, 3) float, and patches (m, 6) int
        The surface as it is in the file, in six-node triangles with normals from solid to void; see `Triangulation`.
    """

    name: str
    cavity: bool
    lattice: Lattice
    net: Array
    outline: Array
    patches: NDArray[np.int64]

    @property
    def n_points(self) -> int:
        """Number of control points."""
        return len(self.net)

    @property
    def shape(self) -> tuple[int, ...]:
        """Control points are stored one after the other."""
        return (len(self.net),)

    def control_points(self) -> Array:
        """All control points, (n_points, 3) in mm."""
        return self.net

    def with_control_points(self, points: Array) -> LatticeSurface:
        """The same surface with other control points, (n_points, 3) in mm."""
        return replace(self, net=points)

    def moved(self, places: Array) -> Array:
        """Where places (n, 3) in the file are moved, mm; beside its box they are moved as the nearest ones in it."""
        return places + self.lattice.weights(places) @ (self.net - self.lattice.points())

    def shell(self) -> tuple[Array, NDArray[np.int64]]:
        """See `Surface`."""
        return self.lattice.weights(self.outline) @ self.net, quarters(self.patches)

    def average(self, strength: float) -> LatticeAverage:
        """See `Surface`."""
        averages = []
        for basis in self.lattice.bases:
            difference = np.diff(np.eye(basis.count), axis=0)
            values, vectors = linalg.eigh(np.eye(basis.count) + strength * difference.T @ difference)
            averages.append((vectors / np.sqrt(values)) @ vectors.T)
        return LatticeAverage(tuple(averages))
