"""Smooth steps: (I + α DᵀD)^(−1/2) along each direction of every control net, as a map of the design variables.

Its rows are non-negative and sum to at most one, so bounds on the raw variables bound the step: no control point moves
farther than the trust region along x, y or z (where neighbours have coordinates turned about z, see
`geometry/wedge.py`, than √2 times it). Without smoothing the control nets fold after about ten designs.
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
        moved = self._nets((self.space.L @ z[:shape]).reshape(-1, 3))
        return np.concatenate([(self._back @ moved.ravel()) / self.entries, z[shape:]])

    def transpose(self, g: np.ndarray) -> np.ndarray:
        """Sᵀ g (n,): the averaging matrices are symmetric."""
        shape = self.space.n_shape
        moved = self._nets((self.space.L @ (g[:shape] / self.entries)).reshape(-1, 3))
        return np.concatenate([self._back @ moved.ravel(), g[shape:]])

    @cached_property
    def _back(self) -> sparse.csr_array:
        return sparse.csr_array(self.space.L.T)

    @cached_property
    def moduli(self) -> Smoothing:
        """A map with entries not below |S|: images under a symmetry may move the other way, so S has both signs."""
        return replace(self, space=replace(self.space, L=abs(self.space.L)))

    def _nets(self, points: np.ndarray) -> np.ndarray:
        out = np.empty_like(points)
        body = self.space.reference
        for where, surface, along, around in zip(body.slices, body.surfaces, self.along, self.around, strict=True):
            rows, columns, _ = surface.net.shape
            half = (along @ points[where].reshape(rows, -1)).reshape(rows, columns, 3)
            out[where] = (around @ half).reshape(-1, 3)
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
