"""Energies of the loads: weight, pressure in the chambers, and what acts on the plate."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.elements import points
from pneumorph.mechanics.elements.element import (
    TET_DN,
    TET_N,
    TET_WEIGHT,
    TRIANGLE_VOLUME,
    cap_triangles,
    tet_works,
    triangle_volumes,
)
from pneumorph.mechanics.elements.energy import Blocks, ElementEnergy, Forces, Pulled
from pneumorph.mechanics.elements.terms import Connectivity, Loads, Local, Values


@partial(register_dataclass, data_fields=["density"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Weight(ElementEnergy):
    """−∫ ρ₀ g·u over tetrahedra, a dead load; ρ₀ in t/mm³."""

    density: Values

    def energies(self, local: Local, loads: Loads) -> Array:
        return -tet_works(local.X, local.u, self.density * loads.acceleration)

    def forces(self, elements: Connectivity, at: Local, loads: Loads) -> tuple[float, Forces]:
        """−∫ ρ₀ g·u over all elements, and its derivatives by u (E, 10, 3), which are the same for all u."""
        body, found = float(self.density) * np.asarray(loads.acceleration), _no_forces(at)
        if not body.any():
            return 0.0, found
        for chunk in elements.chunks():
            carried = _strained(elements, at, chunk)[1] @ TET_N
            np.multiply(-carried[:, :, None], body, out=found.u[chunk])
        return float(np.vdot(found.u, at.u)), found

    def blocks(self, elements: Connectivity, at: Local, loads: Loads, ratios: np.ndarray | None = None) -> None:
        """None: it is linear in u.

        Parameters
        ----------
        elements, at, loads, ratios
            As for `ElementEnergy.blocks`.
        """
        return None

    def tangent_map(self, elements: Connectivity, at: Local, loads: Loads) -> Callable[[Local], Forces]:
        """Nothing along any direction: the forces are the same in all states.

        Parameters
        ----------
        elements, at, loads
            As for `ElementEnergy.tangent_map`.
        """
        none = _no_forces(at)
        return lambda along: none

    def pullback(
        self, elements: Connectivity, at: Local, loads: Loads, on_forces: bool = True
    ) -> Callable[[Forces], Pulled]:
        """A function of w: derivatives of −∫ ρ₀ g·w by X (E, 10, 3), w and g; by u there are none.

        The volumes of the points are computed once: a call for each w costs a few products of matrices.

        Parameters
        ----------
        elements, at, loads, on_forces
            As for `ElementEnergy.pullback`.
        """
        A, volumes = _strained(elements, at, slice(None))
        by_X = (volumes[:, :, None, None] * (TET_DN @ A.transpose(3, 2, 0, 1))).reshape(len(at.X), 4, 30)
        body, none = float(self.density) * np.asarray(loads.acceleration), jax.tree.map(np.zeros_like, loads)
        carried = volumes @ TET_N
        own = -carried[:, :, None] * body

        def pull(w: Forces) -> Pulled:
            work = (w.u @ body) @ TET_N.T
            gravity = -float(self.density) * (carried.ravel() @ w.u.reshape(-1, 3))
            X = -(work[:, None, :] @ by_X).reshape(w.u.shape)
            return Pulled(X, np.zeros(X.shape), own, none._replace(acceleration=gravity))

        return pull


def _no_forces(at: Local) -> Forces:
    return Forces(*(np.zeros(each.shape) for each in (at.u, at.hydrostatic, at.plate, at.objects)))


def _strained(elements: Connectivity, at: Local, some: slice) -> tuple[np.ndarray, np.ndarray]:
    """∂ξ/∂X (3, 3, 4, E) at the quadrature points of some tetrahedra, 1/mm, and their volumes (E, 4), mm³."""
    X, weight = at.X[some], elements.weight[some]
    F, A, measure = np.empty((3, 3, 4, len(X))), np.empty((3, 3, 4, len(X))), np.empty((4, len(X)))
    points.strain(X, at.u[some], TET_DN, TET_WEIGHT, F, A, measure)
    return A, (measure * weight).T


@partial(register_dataclass, data_fields=[], meta_fields=[])
@dataclass(frozen=True, eq=False)
class ChamberPressure(ElementEnergy):
    """−Σ p_c V_c over the triangles of the chambers; the data of a triangle are its shares (C,) in the volumes."""

    def energies(self, local: Local, loads: Loads) -> Array:
        return -(local.data @ loads.pressure) * triangle_volumes(local.X + local.u)

    def blocks(self, elements: Connectivity, at: Local, loads: Loads, ratios: np.ndarray | None = None) -> Blocks:
        """−p ∂²V of every triangle: V = Σ A_abc det(x_a, x_b, x_c), so ∂²V/∂x_a∂x_b is −6 Σ_c A_abc [x_c]×.

        Parameters
        ----------
        elements, at, loads, ratios
            As for `ElementEnergy.blocks`.
        """
        count, (b, a) = elements.count, np.tril_indices(6)
        pressure = at.data[:count] @ np.asarray(loads.pressure)
        turning = (6.0 * TRIANGLE_VOLUME[a, b]) @ (at.X[:count] + at.u[:count])
        x, y, z = np.moveaxis(pressure[:, None, None] * turning, -1, 0)
        zero = np.zeros_like(x)
        motion = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=-1)
        return motion, np.zeros((count, 6, 0, 3)), np.zeros((count, 0, 0))


@partial(register_dataclass, data_fields=[], meta_fields=[])
@dataclass(frozen=True, eq=False)
class CapPressure(ElementEnergy):
    """−Σ p_c V_c over the parts of caps on ports, as `ChamberPressure`."""

    def energies(self, local: Local, loads: Loads) -> Array:
        return -(local.data @ loads.pressure) * triangle_volumes(cap_triangles(local.X + local.u))


@partial(register_dataclass, data_fields=[], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Plate(ElementEnergy):
    """½ Σ k_i d_i² − f·d: a single element that sees the plate only."""

    def energies(self, local: Local, loads: Loads) -> Array:
        d = local.plate
        return (0.5 * jnp.sum(loads.spring * d**2) - jnp.sum(loads.wrench * d))[None]
