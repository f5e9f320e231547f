"""The largest stretch, by itself or over the stated range of the rubber, as a smooth function of a state.

The aggregate is that of Kreisselmeier & Steinhauser (1979), max + ln Σ exp(ρ (s − max)) / ρ over the shares s of all
quadrature points. It is never below the largest share, and above it by at most ln(n)/ρ, which is `ABOVE`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field

import numpy as np

from pneumorph.interrupts import stop_if_asked
from pneumorph.mechanics.assembly.displacement import Displacement, displacement
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.elements.element import TET_DN, TET_WEIGHT
from pneumorph.mechanics.elements.kinematics import State, largest_stretch
from pneumorph.mechanics.elements.points import add_rows, nodal_forces, strain

ABOVE = 0.03
"""Largest difference of the aggregate and the largest share. A smaller one makes the aggregate harder to linearise."""

_NEGLIGIBLE = 1e-12
"""Relative weight below which points have no part in the derivatives."""


@dataclass(frozen=True)
class StrainShare:
    """The aggregate of a task: regions whose rubber states no range do not count.

    It is that of the stretches themselves if it is not `of_range`.
    """

    of_range: bool = True
    by_pressure: Mapping[str, float] = field(default_factory=dict)

    def at(self, model: Model, X: np.ndarray, state: State) -> float:
        """Its value for a state on nodes X (N, 3) in mm."""
        share, _, _ = _shares(model, X, state, self.of_range)
        return _aggregate(share)[0]

    def slope(self, model: Model, X: np.ndarray, state: State) -> tuple[float, np.ndarray, State]:
        """Its value, and its derivatives with respect to X (N, 3) and the unknowns."""
        share, F, A = _shares(model, X, state, self.of_range)
        value, weight = _aggregate(share)
        some = np.flatnonzero((weight > _NEGLIGIBLE).any(axis=0))
        F, A, weight = F[..., some], A[..., some], weight[:, some]
        # The largest singular value changes by the product of its vectors.
        left, stretches, right = np.linalg.svd(np.moveaxis(F, (0, 1), (-2, -1)))
        across = left[..., :, 0, None] * right[..., 0, None, :]
        # A share is a stretch over its range.
        slope = np.moveaxis(across * (weight * share[:, some] / stretches[..., 0])[..., None, None], (-2, -1), (0, 1))
        by_u, by_place = np.empty((len(some), 10, 3)), np.empty((len(some), 10, 3))
        measure = np.ones(weight.shape)
        nodal_forces(np.ascontiguousarray(slope), A, measure, TET_DN, by_u)
        # F = x_ξ A: where nodes move with their places x, it changes by (I − F) times their gradient.
        inner = slope - np.einsum("ki...,kj...->ij...", F, slope)
        nodal_forces(np.ascontiguousarray(inner), A, measure, TET_DN, by_place)
        tets = np.ascontiguousarray(model.tets.nodes[: model.elements][some])
        full_u, full_X = np.zeros(X.shape), np.zeros(X.shape)
        add_rows(by_u, tets, full_u)
        add_rows(by_place, tets, full_X)
        nodes = Displacement(model.tip, X, state)
        return value, full_X + nodes.pulled_to_nodes(full_u), nodes.pulled(full_u)


def _shares(model: Model, X: np.ndarray, state: State, of_range: bool) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Shares (4, M) of all quadrature points, F and A = ∂ξ/∂X (3, 3, 4, M) there."""
    stop_if_asked()
    tets = model.tets.nodes[: model.elements]
    F, A = np.empty((3, 3, 4, len(tets))), np.empty((3, 3, 4, len(tets)))
    strain(X[tets], displacement(model.tip, X, state)[tets], TET_DN, TET_WEIGHT, F, A, np.empty((4, len(tets))))
    if not of_range:
        return largest_stretch(F), F, A
    limit = np.full(len(tets), np.inf)
    for name, elements in model.regions.items():
        limit[elements] = model.rubbers[name].valid_stretch or np.inf
    return largest_stretch(F) / limit, F, A


def _aggregate(share: np.ndarray) -> tuple[float, np.ndarray]:
    """The aggregate, and its derivatives by the shares, which add up to 1."""
    rate, largest = np.log(share.size) / ABOVE, share.max()
    parts = np.exp(rate * (share - largest))
    return float(largest + np.log(parts.sum()) / rate), parts / parts.sum()
