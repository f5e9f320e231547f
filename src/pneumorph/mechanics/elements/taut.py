"""Metrics of covered faces as unknowns of their own in Newton's method, for sheets and fibres that hardly stretch.

A rotation by δθ changes the metric g(u) of a face by nothing to first order, but the step along it by δθ². In a stiff
sheet that tension is larger than all other forces, so Newton's method on the displacements alone needs very small
steps. With metrics m beside the displacements, Π = … + W(m) + S : (g(u) − m), m goes along the tangent plane and the
tension S = W′(m) stays right. At every point m and S are eliminated: the tangent has B = ∂g/∂u and

    BᵀW″(m) B + W′(m) : ∂²g,   and the residual   BᵀW′(m) + B₀ᵀW″(m₀) (g(u) − m),

where 0 is where the tangent was made. The solution is that of the displacements alone, m = g(u). That is the mixed
integration point of Magisano, Leonetti and Garcea (2017), Computer Methods in Applied Mechanics and Engineering 313,
986–1005, for the metric in place of the stress.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.elements.energy import ElementEnergy
from pneumorph.mechanics.elements.reinforcement import Reinforcement, metric
from pneumorph.mechanics.elements.terms import Connectivity, Loads, Local


@partial(register_dataclass, data_fields=["energy"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Taut(ElementEnergy):
    """W to second order about given metrics, the last three columns of the data, as if those were the faces' own.

    Its second derivatives are those of the tangent with metrics eliminated.
    """

    energy: Reinforcement

    def energies(self, local: Local, loads: Loads) -> Array:
        def slope(given: Array) -> Array:
            return jax.grad(lambda each: jnp.sum(self.energy.stored(each, local, loads)))(given)

        given, now = local.data[..., 15:], metric(local, local.X + local.u)
        change = now - jax.lax.stop_gradient(now)
        tension, more = jax.jvp(slope, (given,), (change,))
        return jnp.sum(now * tension + 0.5 * change * more, axis=(1, 2))


@partial(register_dataclass, data_fields=[], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Pull(ElementEnergy):
    """S : g(u) of given tensions S, the last three columns of the data: its forces are BᵀS."""

    def energies(self, local: Local, loads: Loads) -> Array:
        return jnp.sum(metric(local, local.X + local.u) * local.data[..., 15:], axis=(1, 2))


def with_data(elements: Connectivity, values: np.ndarray) -> Connectivity:
    """The connectivity with three more columns (E, 3, 3) of data."""
    return replace(elements, data=np.concatenate([elements.data, values], axis=-1))


def metrics(elements: Connectivity, at: Local) -> np.ndarray:
    """The faces' own metrics (E, 3, 3)."""
    return _by_chunks(elements, lambda chunk: _metric(at.of(chunk)))


def metrics_along(elements: Connectivity, at: Local, dx: np.ndarray) -> np.ndarray:
    """Their derivative (E, 3, 3) along a change of places (E, 6, 3)."""
    return _by_chunks(elements, lambda chunk: _metric_along(at.of(chunk), dx[chunk]))


def tensions(energy: Reinforcement, elements: Connectivity, at: Local, loads: Loads, given: np.ndarray) -> np.ndarray:
    """W′ (E, 3, 3) at given metrics.

    Parameters
    ----------
    energy : Reinforcement
    elements : Connectivity
        Of the covered faces.
    at : Local
        What they see.
    loads : Loads
        In the units of `Loads`.
    given : (E, 3, 3) array
        The metrics.
    """
    return _by_chunks(elements, lambda chunk: _tension(energy, at.of(chunk), loads, given[chunk]))


def tensions_along(
    energy: Reinforcement, elements: Connectivity, at: Local, loads: Loads, given: np.ndarray, change: np.ndarray
) -> np.ndarray:
    """W″ δm (E, 3, 3) at given metrics along a change of them.

    Parameters
    ----------
    energy : Reinforcement
    elements : Connectivity
        Of the covered faces.
    at : Local
        What they see.
    loads : Loads
        In the units of `Loads`.
    given : (E, 3, 3) array
        The metrics.
    change : (E, 3, 3) array
        Of the metrics.
    """
    return _by_chunks(elements, lambda chunk: _tension_along(energy, at.of(chunk), loads, given[chunk], change[chunk]))


def _by_chunks(elements: Connectivity, of: Callable[[slice], Array]) -> np.ndarray:
    return np.concatenate([np.asarray(of(chunk)) for chunk in elements.chunks()])


@jax.jit
def _metric(local: Local) -> Array:
    return metric(local, local.X + local.u)


@jax.jit
def _metric_along(local: Local, dx: Array) -> Array:
    return jax.jvp(lambda places: metric(local, places), (local.X + local.u,), (dx,))[1]


@jax.jit
def _tension(energy: Reinforcement, local: Local, loads: Loads, given: Array) -> Array:
    return jax.grad(lambda each: jnp.sum(energy.stored(each, local, loads)))(given)


@jax.jit
def _tension_along(energy: Reinforcement, local: Local, loads: Loads, given: Array, change: Array) -> Array:
    slope = jax.grad(lambda each: jnp.sum(energy.stored(each, local, loads)))
    return jax.jvp(slope, (given,), (change,))[1]
