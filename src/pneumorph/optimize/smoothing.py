"""Smooth steps: averages of the motion of each control point and its neighbours, as a map of the design variables.

Its rows are non-negative and sum to at most one, so bounds on the raw variables bound the step: no control point moves
farther than the trust region along x, y or z (where neighbours have coordinates turned about z, than √2 times it).
Without smoothing the control nets fold after about ten designs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import sparse

from pneumorph.geometry import DesignSpace
from pneumorph.geometry.surface import Average, Map

STRENGTH = 1.0
"""Of the averages, see `Surface.average`: with it control nets do not fold."""


@dataclass(frozen=True, eq=False)
class Smoothing:
    """Ψ = S z for raw variables z (n,), and the transpose; with the average of every surface."""

    space: DesignSpace
    averages: tuple[Average, ...]
    entries: np.ndarray

    def apply(self, z: np.ndarray) -> np.ndarray:
        """S z (n,)."""
        shape = self.space.n_shape
        moved = self._averaged(self._forth @ z[:shape])
        return np.concatenate([(self._back @ moved) / self.entries, z[shape:]])

    def transpose(self, g: np.ndarray) -> np.ndarray:
        """Sᵀ g (n,): averages are symmetric."""
        shape = self.space.n_shape
        moved = self._averaged(self._forth @ (g[:shape] / self.entries))
        return np.concatenate([self._back @ moved, g[shape:]])

    @cached_property
    def _parts(self) -> list[tuple[sparse.csr_array, Map]]:
        """What each surface's average is within the motions that there are, see `Average.within`."""
        L = sparse.csr_array(self.space.L)
        slices = self.space.reference.slices
        return [
            average.within(L[3 * where.start : 3 * where.stop])
            for where, average in zip(slices, self.averages, strict=True)
        ]

    @cached_property
    def _forth(self) -> sparse.csr_array:
        return sparse.csr_array(sparse.vstack([moved for moved, _ in self._parts]))

    @cached_property
    def _back(self) -> sparse.csr_array:
        return sparse.csr_array(self._forth.T)

    @cached_property
    def moduli(self) -> Smoothing:
        """A map with entries not below |S|: images under a symmetry may move the other way, so S has both signs."""
        return replace(self, space=replace(self.space, L=abs(self.space.L)))

    def _averaged(self, coordinates: np.ndarray) -> np.ndarray:
        """The averages of coordinates, in the order of `_forth`."""
        out, first = np.empty_like(coordinates), 0
        for moved, average in self._parts:
            own = slice(first, first + len(moved.indptr) - 1)
            out[own], first = average(coordinates[own]), own.stop
        return out


def build_smoothing(space: DesignSpace) -> Smoothing:
    """The smoothing of a design space."""
    averages = tuple(surface.average(STRENGTH) for surface in space.reference.surfaces)
    return Smoothing(space, averages, np.asarray(space.L.power(2).sum(axis=0)).ravel())
