"""The energy of a term's elements with its derivatives: by JAX, unless a kind of energy has faster ones.

Elements are evaluated in chunks of a few fixed sizes, so that a kernel is compiled once for each kind of energy and not
again for another mesh. This works element by element; `assembly/potential.py` adds up what elements share.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import ClassVar, NamedTuple

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.terms import Connectivity, Loads, Local, Values


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


PullSeveral = Callable[[Sequence[np.ndarray], Sequence[State]], np.ndarray]
"""Of the motions (N, 3) of all nodes in k adjoints, and these: derivatives (k, N, 3) of (∂Π/∂(u, π))·w by all nodes."""

Blocks = tuple[np.ndarray, np.ndarray, np.ndarray]
"""Second derivatives by u and u, node pairs a ≤ b (E, a(a + 1)/2, 9), by u and π (E, a, c, 3), by π and π (E, c, c)."""


class ElementEnergy:
    """The energy of a term's elements: a dataclass registered with JAX, so that other parameters need no compilation.

    A kind of energy has to have `energies`. It overrides those derivatives of which it knows faster ways with the same
    results.
    """

    of_rubber: ClassVar[bool] = False
    """Whether it is the energy of a region's rubber, which no load enters."""

    of_cover: ClassVar[bool] = False
    """Whether it is the energy of a sheet or of fibres, a `Reinforcement`."""

    @property
    def drags(self) -> int | None:
        """The number of the obstacle along which it drags the body by friction, if it does that."""
        return None

    def energies(self, local: Local, loads: Loads) -> Array:
        """The energies (E,) of the elements, N·mm, twice differentiable in all of `local`.

        They must be finite for the padding too.
        """
        raise NotImplementedError

    def forces(self, elements: Connectivity, at: Local, loads: Loads) -> tuple[float, Forces]:
        """The sum of the energies, and their derivatives."""
        parts = [_forces(self, elements.weight[chunk], at.of(chunk), loads) for chunk in elements.chunks()]
        return sum(float(value) for value, _ in parts), _joined(at, [part for _, part in parts])

    def change(self, elements: Connectivity, at: Local, loads: Loads, along: Local, dloads: Loads) -> Forces:
        """Derivative of the forces along a change of X, u, π, the plate and the loads (`along.data` is unused).

        Parameters
        ----------
        elements : Connectivity
            Of the E elements of a nodes and c unknowns π.
        at : Local
            What the elements see: X and u (E, a, 3) in mm, π (E, c) in MPa.
        loads : Loads
            In the units of `Loads`.
        along : Local
            Change of what the elements see.
        dloads : Loads
            Change of the loads.
        """
        return _joined(
            at,
            [
                _change(self, elements.weight[chunk], at.of(chunk), loads, _varied(along.of(chunk)), dloads)
                for chunk in elements.chunks()
            ],
        )

    def tangent_map(self, elements: Connectivity, at: Local, loads: Loads) -> Callable[[Local], Forces]:
        """`change` as a function of a change of the unknowns alone."""
        still = jax.tree.map(np.zeros_like, loads)
        return lambda along: self.change(elements, at, loads, along, still)

    def pullback(
        self, elements: Connectivity, at: Local, loads: Loads, on_forces: bool = True
    ) -> Callable[[Forces], Pulled]:
        """A function of w: derivatives of the product (forces·w).

        Those by u and by w's own u are left out, or zero, without `on_forces`.

        Parameters
        ----------
        elements : Connectivity
            Of the E elements of a nodes and c unknowns π.
        at : Local
            What the elements see: X and u (E, a, 3) in mm, π (E, c) in MPa.
        loads : Loads
            In the units of `Loads`.
        on_forces : bool
            Whether the derivatives by u and by w's own u are wanted; without it they may be zero.
        """

        def pull_by_jax(w: Forces) -> Pulled:
            parts = [
                _pullback(self, elements.weight[each], at.of(each), loads, w._replace(u=w.u[each], hydrostatic=part))
                for each in elements.chunks()
                for part in (w.hydrostatic[each],)
            ]
            X, u, own = (_rows([part[k] for part in parts], at.X) for k in range(3))
            acting = jax.tree.map(lambda *each: np.sum(each, axis=0), *(part[3] for part in parts))
            return Pulled(X, u, own, acting)

        return pull_by_jax

    def pullback_of_several(self, elements: Connectivity, at: Local) -> PullSeveral | None:
        """A function of several w, faster than `pullback` for each of them; None where there is none.

        Of an energy that no load enters.
        """
        return None

    def blocks(
        self, elements: Connectivity, at: Local, loads: Loads, ratios: np.ndarray | None = None
    ) -> Blocks | None:
        """The blocks of the elements without the padding; None where the energy is linear in u and π, or sees neither.

        Volume ratios (4, E) at the quadrature points, if given, are those of the volumetric stress of plain rubber.

        Parameters
        ----------
        elements : Connectivity
            Of the E elements of a nodes and c unknowns π.
        at : Local
            What the elements see: X and u (E, a, 3) in mm, π (E, c) in MPa.
        loads : Loads
            In the units of `Loads`.
        ratios : (4, E) array, optional
            Volume ratios at the quadrature points.
        """
        nodes = elements.nodes.shape[1]
        if nodes + elements.hydrostatics.shape[1] == 0:
            return None
        parts = [
            np.asarray(_hessians(self, elements.weight[chunk], at.of(chunk), loads)) for chunk in elements.chunks()
        ]
        return _cut(np.concatenate(parts)[: elements.count], nodes)

    def node_blocks(self, elements: Connectivity, at: Local, loads: Loads) -> Blocks | None:
        """The blocks of the elements as `blocks` has them, but by u and u only of every node with itself (E, a, 9).

        Parameters
        ----------
        elements : Connectivity
            Of the E elements of a nodes and c unknowns π.
        at : Local
            What the elements see: X and u (E, a, 3) in mm, π (E, c) in MPa.
        loads : Loads
            In the units of `Loads`.
        """
        blocks = self.blocks(elements, at, loads)
        if blocks is None:
            return None
        motion, coupling, compression = blocks
        ranks = np.arange(1, elements.nodes.shape[1] + 1)
        return motion[:, ranks * (ranks + 1) // 2 - 1], coupling, compression


class Term(NamedTuple):
    """A summand of Π: a sum over elements. Terms that share a connectivity object are evaluated together."""

    connectivity: Connectivity
    energy: ElementEnergy


def _cut(matrices: np.ndarray, nodes: int) -> Blocks:
    """Split element matrices (E, 3a + c, 3a + c) into blocks."""
    count, end = len(matrices), 3 * nodes
    b, a = np.tril_indices(nodes)
    motion = matrices[:, :end, :end].reshape(count, nodes, 3, nodes, 3)[:, a, :, b].transpose(1, 0, 2, 3)
    coupling = matrices[:, :end, end:].reshape(count, nodes, 3, -1).transpose(0, 1, 3, 2)
    return np.ascontiguousarray(motion).reshape(count, -1, 9), coupling, matrices[:, end:, end:]


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
    value, slopes = jax.value_and_grad(_summed, argnums=(5, 6, 7, 8))(energy, weight, at, loads, *_varied(at))
    return value, Forces(*slopes)


@jax.jit
def _change(energy: ElementEnergy, weight: Values, at: Local, loads: Loads, along, dloads: Loads) -> Forces:
    def slopes(loads, *unknowns):
        return Forces(*jax.grad(_summed, argnums=(5, 6, 7, 8))(energy, weight, at, loads, *unknowns))

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

    def value(unknowns: Array) -> Array:
        u, hydrostatic = unknowns[:, : 3 * nodes].reshape(count, nodes, 3), unknowns[:, 3 * nodes :]
        return _summed(energy, weight, at, loads, at.X, u, hydrostatic, at.plate, at.objects)

    here = jnp.concatenate([jnp.asarray(at.u).reshape(count, -1), at.hydrostatic], axis=1)
    units = jnp.eye(here.shape[1])[:, None, :]
    rows = jax.vmap(lambda unit: jax.jvp(jax.grad(value), (here,), (jnp.broadcast_to(unit, here.shape),))[1])(units)
    return jnp.moveaxis(rows, 1, 0)
