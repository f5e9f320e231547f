"""Smooth steps: (I + α DᵀD)^(−1/2) along each direction of every control net, as a map of the design variables.

Its rows are non-negative and sum to at most one, so bounds on the raw variables bound the step: no control point moves
farther than the trust region along x, y or z (where neighbours have coordinates turned about z, see
`geometry/tube/wedge.py`, than √2 times it). Without smoothing the control nets fold after about ten designs.
"""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from scipy import linalg, sparse

from pneumorph.geometry.design_space import DesignSpace

STRENGTH = 1.0


@dataclass(frozen=True, eq=False)
class Smoothing:
    """Ψ = S z for raw variables z (n,), and the transpose."""

    space: DesignSpace
    along: tuple[np.ndarray, ...]
    around: tuple[np.ndarray, ...]
    entries: np.ndarray

    def apply(self, z: np.ndarray) -> np.ndarray:
        """S z (n,)."""
        shape = self.space.n_shape
        moved = self._nets(self._forth @ z[:shape])
        return np.concatenate([(self._back @ moved) / self.entries, z[shape:]])

    def transpose(self, g: np.ndarray) -> np.ndarray:
        """Sᵀ g (n,): the averaging matrices are symmetric."""
        shape = self.space.n_shape
        moved = self._nets(self._forth @ (g[:shape] / self.entries))
        return np.concatenate([self._back @ moved, g[shape:]])

    @cached_property
    def _forth(self) -> sparse.csr_array:
        """L with the coordinates of each row of a net one after the other, so that nets are averaged as matrices."""
        body, order = self.space.reference, []
        for where, surface in zip(body.slices, body.surfaces, strict=True):
            rows, columns, _ = surface.net.shape
            coordinate = 3 * where.start + np.arange(3 * rows * columns).reshape(rows, columns, 3)
            order.append(coordinate.transpose(0, 2, 1).ravel())
        return sparse.csr_array(self.space.L)[np.concatenate(order)]

    @cached_property
    def _back(self) -> sparse.csr_array:
        return sparse.csr_array(self._forth.T)

    @cached_property
    def moduli(self) -> Smoothing:
        """A map with entries not below |S|: images under a symmetry may move the other way, so S has both signs."""
        return replace(self, space=replace(self.space, L=abs(self.space.L)))

    def _nets(self, coordinates: np.ndarray) -> np.ndarray:
        """The coordinates, in the order of `_forth`, averaged along and around."""
        out, first = np.empty_like(coordinates), 0
        for surface, along, around in zip(self.space.reference.surfaces, self.along, self.around, strict=True):
            rows, columns, _ = surface.net.shape
            where = slice(first, first + surface.net.size)
            half = along @ coordinates[where].reshape(rows, -1)
            out[where] = (half.reshape(-1, columns) @ around).ravel()
            first = where.stop
        return out


def build_smoothing(space: DesignSpace, strength: float = STRENGTH) -> Smoothing:
    """The smoothing of a design space; `strength` is α."""
    shapes = [surface.net.shape for surface in space.reference.surfaces]
    entries = np.asarray(space.L.power(2).sum(axis=0)).ravel()
    return Smoothing(
        space,
        along=tuple(_average(rows, False, strength) for rows, _, _ in shapes),
        around=tuple(_average(columns, True, strength) for _, columns, _ in shapes),
        entries=entries,
    )


def _average(count: int, periodic: bool, strength: float) -> np.ndarray:
    difference = np.diff(np.eye(count), axis=0)
    if periodic:
        closing = np.zeros(count)
        closing[[0, -1]] = 1.0, -1.0
        difference = np.vstack([difference, closing])
    values, vectors = linalg.eigh(np.eye(count) + strength * difference.T @ difference)
    return (vectors / np.sqrt(values)) @ vectors.T
