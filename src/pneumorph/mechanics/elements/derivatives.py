"""Derivatives of element energies: by JAX for any term, by faster kernels with the same result for the solid.

Elements are evaluated in chunks of a few fixed sizes, so that a kernel is compiled once for each kind of energy and not
again for another mesh. This module works element by element; `potential.py` adds up what elements share.
"""

from __future__ import annotations

from collections.abc import Callable
from typing import NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements import solid
from pneumorph.mechanics.elements.terms import Connectivity, ElementEnergy, Loads, Local, Solid, Values


class Forces(NamedTuple):
    """Derivatives of elements' energies by their u (E, a, 3), by π (E, c), and by the plate's unknowns (6,) or (0,).

    And by those of free obstacles (J, 6), or (0, 6).
    """

    u: Values
    hydrostatic: Values
    plate: Values
    objects: Values


class Pulled(NamedTuple):
    """Derivatives of (∂Π/∂(u, π, plate))·w: by X (E, a, 3), u (E, a, 3), w's own u (E, a, 3), and the loads."""

    X: np.ndarray
    u: np.ndarray
    w: np.ndarray
    loads: Loads


def forces(energy: ElementEnergy, seen: Connectivity, at: Local, loads: Loads) -> tuple[float, Forces]:
    """The sum of the energies, and their derivatives."""
    if isinstance(energy, Solid):
        value, u, hydrostatic = solid.forces(energy, seen, at)
        return value, Forces(u, hydrostatic, np.zeros(at.plate.shape), np.zeros(at.objects.shape))
    parts = [_forces(energy, seen.weight[chunk], at.of(chunk), loads) for chunk in seen.chunks()]
    return sum(float(value) for value, _ in parts), _joined(at, [part for _, part in parts])


def change(energy: ElementEnergy, seen: Connectivity, at: Local, loads: Loads, along: Local, dloads: Loads) -> Forces:
    """Derivative of the forces along a change of X, u, π, the plate and the loads (`along.data` is unused)."""
    if isinstance(energy, Solid):
        return Forces(*solid.change(energy, seen, at, along), np.zeros(at.plate.shape), np.zeros(at.objects.shape))
    return _joined(
        at,
        [
            _change(energy, seen.weight[chunk], at.of(chunk), loads, _varied(along.of(chunk)), dloads)
            for chunk in seen.chunks()
        ],
    )


def tangent_map(energy: ElementEnergy, seen: Connectivity, at: Local, loads: Loads) -> Callable[[Local], Forces]:
    """`change` as a function of a change of the unknowns alone."""
    if isinstance(energy, Solid):
        product = solid.tangent_map(energy, seen, at)
        others = np.zeros(at.plate.shape), np.zeros(at.objects.shape)
        return lambda along: Forces(*product(along.u, along.hydrostatic), *others)
    still = jax.tree.map(np.zeros_like, loads)
    return lambda along: change(energy, seen, at, loads, along, still)


def pullback(
    energy: ElementEnergy, seen: Connectivity, at: Local, loads: Loads, several: bool, on_forces: bool = True
) -> Callable[[Forces], Pulled]:
    """A function of w: derivatives of the product (forces·w). `several` says whether more than one w is to come.

    Those by u and by w's own u are left out, or zero, without `on_forces`.
    """
    if isinstance(energy, Solid):
        pull, none = solid.pullback(energy, seen, at, several, on_forces), jax.tree.map(np.zeros_like, loads)
        return lambda w: Pulled(*pull(w.u, w.hydrostatic), none)

    def pull_by_jax(w: Forces) -> Pulled:
        parts = [
            _pullback(energy, seen.weight[each], at.of(each), loads, w._replace(u=w.u[each], hydrostatic=part))
            for each in seen.chunks()
            for part in (w.hydrostatic[each],)
        ]
        X, u, own = (_rows([part[k] for part in parts], at.X) for k in range(3))
        acting = jax.tree.map(lambda *each: np.sum(each, axis=0), *(part[3] for part in parts))
        return Pulled(X, u, own, acting)

    return pull_by_jax


def hessians(energy: ElementEnergy, seen: Connectivity, at: Local, loads: Loads) -> np.ndarray:
    """Second derivatives (E, 3a + c, 3a + c) by the elements' u and π, without the padding."""
    parts = [np.asarray(_hessians(energy, seen.weight[chunk], at.of(chunk), loads)) for chunk in seen.chunks()]
    return np.concatenate(parts)[: seen.count]


def _joined(at: Local, parts: list[Forces]) -> Forces:
    plate = sum((np.asarray(part.plate) for part in parts), np.zeros(at.plate.shape))
    objects = sum((np.asarray(part.objects) for part in parts), np.zeros(at.objects.shape))
    u, hydrostatic = (
        _rows([part.u for part in parts], at.u),
        _rows([part.hydrostatic for part in parts], at.hydrostatic),
    )
    return Forces(u, hydrostatic, plate, objects)


def _varied(at: Local) -> tuple[Values, ...]:
    """What energies are differentiated by: X, u, π, the plate's unknowns and those of free obstacles."""
    return *at[:4], at.objects


def _rows(parts: list, like: np.ndarray) -> np.ndarray:
    return np.concatenate([np.asarray(part) for part in parts]) if parts else np.zeros(like.shape)


def _summed(energy: ElementEnergy, weight: Values, at: Local, loads: Loads, X, u, hydrostatic, plate, objects) -> Array:
    return jnp.sum(weight * energy.energies(Local(X, u, hydrostatic, plate, at.data, objects), loads))


@jax.jit
def _forces(energy: ElementEnergy, weight: Values, at: Local, loads: Loads) -> tuple[Array, Forces]:
    value, found = jax.value_and_grad(_summed, argnums=(5, 6, 7, 8))(energy, weight, at, loads, *_varied(at))
    return value, Forces(*found)


@jax.jit
def _change(energy: ElementEnergy, weight: Values, at: Local, loads: Loads, along, dloads: Loads) -> Forces:
    def slopes(loads, *seen):
        return Forces(*jax.grad(_summed, argnums=(5, 6, 7, 8))(energy, weight, at, loads, *seen))

    return jax.jvp(slopes, (loads, *_varied(at)), (dloads, *along))[1]


@jax.jit
def _pullback(energy: ElementEnergy, weight: Values, at: Local, loads: Loads, w: Forces):
    def work(X, u, own, loads):
        def value(u, hydrostatic, plate, objects):
            return _summed(energy, weight, at, loads, X, u, hydrostatic, plate, objects)

        along = own, w.hydrostatic, w.plate, w.objects
        return jax.jvp(value, (u, at.hydrostatic, at.plate, at.objects), along)[1]

    return jax.grad(work, argnums=(0, 1, 2, 3))(at.X, at.u, w.u, loads)


@jax.jit
def _hessians(energy: ElementEnergy, weight: Values, at: Local, loads: Loads) -> Array:
    count, nodes = at.u.shape[:2]

    def value(seen: Array) -> Array:
        u, hydrostatic = seen[:, : 3 * nodes].reshape(count, nodes, 3), seen[:, 3 * nodes :]
        return _summed(energy, weight, at, loads, at.X, u, hydrostatic, at.plate, at.objects)

    here = jnp.concatenate([jnp.asarray(at.u).reshape(count, -1), at.hydrostatic], axis=1)
    units = jnp.eye(here.shape[1])[:, None, :]
    rows = jax.vmap(lambda unit: jax.jvp(jax.grad(value), (here,), (jnp.broadcast_to(unit, here.shape),))[1])(units)
    return jnp.moveaxis(rows, 1, 0)
