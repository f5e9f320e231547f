"""The unknowns, and deformation measures on the elements."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pneumorph.mechanics.elements.element import TET_DN, TET_WEIGHT
from pneumorph.mechanics.elements.points import strain, straining, turn_on
from pneumorph.mechanics.material.energies import determinant

SQUARINGS = 3
"""How often the exponential by which deformation gradients change is squared, see `turn_on`."""


class State(NamedTuple):
    """Unknowns: nodal displacements u (N, 3) mm, plate motion (6,) [c mm, θ rad], hydrostatic π (regions·N,) MPa.

    Mixed elements alone have π; otherwise it is empty. It jumps where two rubbers meet, so every region has N entries,
    region after region. Rows of u on the tip, and entries of π where a region has no corner node, are unused. `objects`
    (J, 6), mm and rad, is what the poses of free obstacles have beyond the given ones; see `free.py`.
    """

    u: np.ndarray
    plate: np.ndarray
    hydrostatic: np.ndarray = np.zeros(0)
    objects: np.ndarray = np.zeros((0, 6))


@dataclass(frozen=True, eq=False)
class Guess:
    """A predicted state, or one carried over from another mesh, from which a search begins.

    Attributes
    ----------
    state : State
        Its displacements are rough in detail.
    gradients : (3, 3, 4, E) float, optional
        Deformation gradients at the quadrature points of all elements, made from those of an equilibrium: they are
        nearer to what is sought than those of the displacements.
    metrics : sequence of (E, 3, 3) float
        The same for the faces under sheets and fibres; empty if they are the state's own.
    ratios : (4, E) float, optional
        Volume ratios at the quadrature points that are nearer to what is sought; by default those of the gradients.
    """

    state: State
    gradients: np.ndarray | None = None
    metrics: Sequence[np.ndarray] = ()
    ratios: np.ndarray | None = None


def deformation_gradients(tets: np.ndarray, X: np.ndarray, u: np.ndarray) -> np.ndarray:
    """F (3, 3, 4, M) at the quadrature points of tetrahedra (M, 10) with nodes X (N, 3) displaced by u."""
    F, A = np.empty((3, 3, 4, len(tets))), np.empty((3, 3, 4, len(tets)))
    strain(X.take(tets, axis=0), u.take(tets, axis=0), TET_DN, TET_WEIGHT, F, A, np.empty((4, len(tets))))
    return F


def gradients_after(tets: np.ndarray, X: np.ndarray, u: np.ndarray, dX: np.ndarray, du: np.ndarray) -> np.ndarray:
    """F (3, 3, 4, M) after nodes X (N, 3) displaced by u move by dX and displacements change by du.

    exp(δF F⁻¹) F, where δF is the change to first order: what turns is not stretched by that, as it is by F + δF.

    Parameters
    ----------
    tets : (M, 10) int
        Nodes of the tetrahedra.
    X, u : (N, 3) array
        Nodes and their displacements, mm.
    dX, du : (N, 3) array
        How they change, mm.
    """
    F, A, dF = (np.empty((3, 3, 4, len(tets))) for _ in range(3))
    strain(X.take(tets, axis=0), u.take(tets, axis=0), TET_DN, TET_WEIGHT, F, A, np.empty(F.shape[2:]))
    straining(dX.take(tets, axis=0), du.take(tets, axis=0), TET_DN, F, A, dF, np.empty(F.shape), np.empty(F.shape[2:]))
    turn_on(F, dF, SQUARINGS)
    return F


def volume_ratio(F: Any) -> np.ndarray:
    """J = det F of deformation gradients (3, 3, …)."""
    return np.asarray(determinant(F))


def largest_stretch(F: np.ndarray) -> np.ndarray:
    """Largest singular value of 3×3 matrices (3, 3, …), from the characteristic cubic of FᵀF (Smith 1961)."""
    C = np.einsum("ki...,kj...->ij...", F, F)
    mean = (C[0, 0] + C[1, 1] + C[2, 2]) / 3
    deviator = C - mean * np.eye(3).reshape(3, 3, *[1] * (F.ndim - 2))
    spread = np.sqrt(np.maximum(np.sum(deviator**2, axis=(0, 1)) / 6, 1e-30))
    cosine = np.clip(determinant(deviator / spread) / 2, -1.0, 1.0)
    return np.sqrt(mean + 2 * spread * np.cos(np.arccos(cosine) / 3))
