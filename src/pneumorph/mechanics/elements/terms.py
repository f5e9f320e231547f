"""The terms of the potential: which unknowns the elements of each term see, and their energy.

    Π(X, u, π) = Σ∫ψ(F, π) − Σ p_c V_c(X + u) − ∫ρ₀ g·u + ½ Σ k_i d_i² − f·d, plate d = [c, θ]

The terms are the solid, the chamber pressures, the weight and the plate. A term is a connectivity and the energy of its
elements, written in JAX; `potential.py` and `hessian.py` derive everything else from these, the tangent included.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, Protocol

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.elements.element import tet_energies, tet_works, triangle_volumes
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.material.energies import Energy

Values = Any
"""NumPy arrays, or JAX arrays inside compiled functions."""


class Loads(NamedTuple):
    """The loads: chamber pressures (C,) MPa, acceleration g (3,) mm/s², springs and dead loads of the plate (6,).

    `shift` (K, 6) are the poses of rigid obstacles, in the order of `Contact.obstacles`: the displacement of each from
    its place in mm, and its rotation vector about its centre in rad; see `pose.py`. `laid` (R, 2) are changes of the
    stiffness, N/mm, and of the coverage of sheets or the winding angle of fibres, rad, in the order of
    `Model.reinforcements`.
    """

    pressure: Values
    acceleration: Values
    spring: Values
    wrench: Values
    shift: Values = np.zeros((0, 6))
    laid: Values = np.zeros((0, 2))


class Local(NamedTuple):
    """Nodal values gathered element by element: all that the elements of a term see.

    Attributes
    ----------
    X : (E, a, 3) undeformed positions of the nodes, mm.
    u : (E, a, 3) displacements, mm; nodes on the tip follow the plate.
    hydrostatic : (E, c) hydrostatic unknowns π, MPa.
    plate : (6,) plate unknowns; (0,) where the elements do not see the plate.
    data : (E, k) constants of the elements.
    objects : (J, 6) unknowns of the free obstacles; none where the elements do not see them.
    """

    X: Values
    u: Values
    hydrostatic: Values
    plate: Values
    data: Values
    objects: Values = np.zeros((0, 6))

    def of(self, chunk: slice) -> Local:
        """The values of a chunk of elements."""
        X, u, hydrostatic, plate, data, objects = self
        return Local(X[chunk], u[chunk], hydrostatic[chunk], plate, data[chunk], objects)


@dataclass(frozen=True, eq=False)
class Connectivity:
    """Which unknowns each of E elements sees, padded to whole chunks; see `connect`.

    Attributes
    ----------
    nodes : (E, a) int
        Nodes whose undeformed positions and displacements it sees.
    hydrostatics : (E, c) int
        Indices into `State.hydrostatic` of the unknowns π that it sees.
    data : (E, k) float
        Constants of each element that the energy needs.
    weight : (E,) float
        1, or 0 for the copies that fill up the last chunk.
    chunk : int
        Number of elements evaluated together.
    plate : bool
        Whether the elements see the plate unknowns.
    objects : bool
        Whether they see those of the free obstacles.
    """

    nodes: np.ndarray
    hydrostatics: np.ndarray
    data: np.ndarray
    weight: np.ndarray
    chunk: int
    plate: bool = False
    objects: bool = False

    @property
    def count(self) -> int:
        """Number of elements without the padding, which comes last."""
        return int(np.count_nonzero(self.weight))

    def local(self, X: np.ndarray, u: np.ndarray, state: State) -> Local:
        """Gather what the elements see of nodes X (N, 3), displacements u (N, 3), and the other unknowns of a state."""
        seen, plate, objects = self._others(state)
        return Local(X[self.nodes], u[self.nodes], seen, plate, self.data, objects)

    def moving(self, du: np.ndarray, dstate: State) -> Local:
        """Gather what they see of a change of displacements (N, 3) and of the other unknowns, at nodes that rest."""
        u, (seen, plate, objects) = du[self.nodes], self._others(dstate)
        return Local(np.zeros(u.shape), u, seen, plate, self.data, objects)

    def _others(self, state: State) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        seen = state.hydrostatic[self.hydrostatics] if self.hydrostatics.shape[1] else self.hydrostatics.astype(float)
        plate = state.plate if self.plate else np.zeros(0)
        return seen, plate, state.objects if self.objects else np.zeros((0, 6))

    def chunks(self) -> list[slice]:
        """The elements of every chunk."""
        return [slice(first, first + self.chunk) for first in range(0, len(self.nodes), self.chunk)]


CHUNKS = (1, 256)
"""Chunk sizes that kernels are compiled for: a single element, or as many chunks of several as hold all elements. So
another mesh needs no new kernels, and the few elements beside the tip none of their own. 256 tetrahedra fit into the
cache of a core."""


def connect(
    nodes: np.ndarray,
    hydrostatics: np.ndarray | None = None,
    data: np.ndarray | None = None,
    plate: bool = False,
    objects: bool = False,
) -> Connectivity:
    """The connectivity of elements with `nodes` (E, a), padded with copies of the first element."""
    count = len(nodes)
    nothing = np.zeros((count, 0))
    hydrostatics = nothing.astype(int) if hydrostatics is None else hydrostatics
    data = nothing if data is None else data
    chunk = next((size for size in CHUNKS if size >= count), CHUNKS[-1])
    extra = -count % chunk
    return Connectivity(
        *(np.concatenate([rows, np.repeat(rows[:1], extra, axis=0)]) for rows in (nodes, hydrostatics, data)),
        weight=np.concatenate([np.ones(count), np.zeros(extra)]),
        chunk=chunk,
        plate=plate,
        objects=objects,
    )


class ElementEnergy(Protocol):
    """The energy of a term's elements; registered with JAX, so that other parameters need no compilation.

    It must be finite for the padding too.
    """

    def energies(self, local: Local, loads: Loads) -> Array:
        """The energies (E,) of the elements, N·mm, twice differentiable in all of `local`."""
        ...


class Term(NamedTuple):
    """A summand of Π: a sum over elements. Terms that share a connectivity object are evaluated together."""

    connectivity: Connectivity
    energy: ElementEnergy


@partial(register_dataclass, data_fields=["parameters"], meta_fields=["energy_density"])
@dataclass(frozen=True, eq=False)
class Solid:
    """∫ ψ(F, π) over tetrahedra of one rubber, of ten nodes and, where they are mixed, four hydrostatic unknowns."""

    energy_density: Energy
    parameters: Values

    def energies(self, local: Local, loads: Loads) -> Array:
        return tet_energies(local.X, local.u, corner_hydrostatics(local), self.energy_density, self.parameters)


@partial(register_dataclass, data_fields=["density"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Weight:
    """−∫ ρ₀ g·u over tetrahedra, a dead load; ρ₀ in t/mm³."""

    density: Values

    def energies(self, local: Local, loads: Loads) -> Array:
        return -tet_works(local.X, local.u, self.density * loads.acceleration)


@partial(register_dataclass, data_fields=[], meta_fields=[])
@dataclass(frozen=True, eq=False)
class ChamberPressure:
    """−Σ p_c V_c over the triangles of the chambers; the data of a triangle are its shares (C,) in the volumes."""

    def energies(self, local: Local, loads: Loads) -> Array:
        return -(local.data @ loads.pressure) * triangle_volumes(local.X + local.u)


@partial(register_dataclass, data_fields=[], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Plate:
    """½ Σ k_i d_i² − f·d: a single element that sees the plate only."""

    def energies(self, local: Local, loads: Loads) -> Array:
        d = local.plate
        return (0.5 * jnp.sum(loads.spring * d**2) - jnp.sum(loads.wrench * d))[None]


def corner_hydrostatics(local: Local) -> Array:
    """π at the corners of tetrahedra (E, 4); zero, and unused, without mixed elements."""
    return local.hydrostatic if local.hydrostatic.shape[1] else jnp.zeros((local.X.shape[0], 4))
