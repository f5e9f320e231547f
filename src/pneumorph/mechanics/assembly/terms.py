"""The terms of the potential: which unknowns the elements of each see, and the energy that they have.

    Π(X, u, π) = Σ∫ψ(F, π) − Σ p_c V_c(X + u) − ∫ρ₀ g·u + ½ Σ k_i d_i² − f·d, plate d = [c, θ]

The solid, the chambers' pressure, the weight and the plate are its terms. A term is a connectivity and an energy of its
elements, written in JAX; all else, up to its part of the assembled tangent, is made of these in `potential.py` and
`hessian.py`.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from typing import Any, NamedTuple, Protocol

import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.assembly.element import tet_energies, tet_works, triangle_volumes
from pneumorph.mechanics.material.rubber import Energy

Values = Any
"""Arrays of NumPy, and of JAX inside what is compiled."""


class Loads(NamedTuple):
    """What acts: chamber pressures (C,) MPa, acceleration g (3,) mm/s², plate springs and dead loads (6,)."""

    pressure: Values
    acceleration: Values
    spring: Values
    wrench: Values


class Local(NamedTuple):
    """What the elements of a term see, element by element.

    Attributes
    ----------
    X : (E, a, 3) rest positions of their nodes, mm.
    u : (E, a, 3) displacements, mm; on the tip those of the plate.
    hydrostatic : (E, c) their hydrostatic unknowns π, MPa.
    plate : (6,) the plate's unknowns; none, (0,), where the connectivity does not ask for them.
    data : (E, k) numbers of the elements themselves.
    """

    X: Values
    u: Values
    hydrostatic: Values
    plate: Values
    data: Values

    def of(self, chunk: slice) -> Local:
        """What some of the elements see."""
        X, u, hydrostatic, plate, data = self
        return Local(X[chunk], u[chunk], hydrostatic[chunk], plate, data[chunk])


@dataclass(frozen=True, eq=False)
class Connectivity:
    """Which unknowns each of E elements sees, padded to whole chunks; see `connect`.

    Attributes
    ----------
    nodes : (E, a) int
        Nodes whose rest positions and displacements it sees.
    hydrostatics : (E, c) int
        Indices into `State.hydrostatic` of the unknowns π that it sees.
    data : (E, k) float
        Numbers that the energy wants to know of each element.
    weight : (E,) float
        1, or 0 for the copies that pad the last chunk.
    chunk : int
        Number of elements that are evaluated together.
    plate : bool
        Whether all of them see the plate's unknowns.
    """

    nodes: np.ndarray
    hydrostatics: np.ndarray
    data: np.ndarray
    weight: np.ndarray
    chunk: int
    plate: bool = False

    @property
    def count(self) -> int:
        """The number of elements without the padding, which comes last."""
        return int(np.count_nonzero(self.weight))

    def local(self, X: np.ndarray, u: np.ndarray, hydrostatic: np.ndarray, plate: np.ndarray) -> Local:
        """What the elements see of nodes X (N, 3) displaced by u, of all π and of the plate (6,)."""
        seen = hydrostatic[self.hydrostatics] if self.hydrostatics.shape[1] else self.hydrostatics.astype(float)
        return Local(X[self.nodes], u[self.nodes], seen, plate if self.plate else np.zeros(0), self.data)

    def chunks(self) -> list[slice]:
        """The elements of every chunk."""
        return [slice(first, first + self.chunk) for first in range(0, len(self.nodes), self.chunk)]


CHUNKS = (1, 16, 128, 1024)
"""Numbers of elements that kernels are compiled for: the least of them that holds all elements, or the largest as often
as it takes. So no kernel is compiled anew for another mesh; 1,024 tetrahedra fit into a core's cache."""


def connect(
    nodes: np.ndarray, hydrostatics: np.ndarray | None = None, data: np.ndarray | None = None, plate: bool = False
) -> Connectivity:
    """The connectivity of elements with `nodes` (E, a); padding is copies of the first element."""
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
    )


class ElementEnergy(Protocol):
    """The energy of the elements of a term; registered with JAX, so that its numbers are no part of what is compiled.

    It must be finite for the padding too.
    """

    def energies(self, local: Local, loads: Loads) -> Array:
        """The energies (E,) of the elements, N·mm, twice differentiable in everything that `local` holds."""
        ...


class Term(NamedTuple):
    """A part of Π: a sum over elements. Terms over one and the same connectivity are evaluated together."""

    connectivity: Connectivity
    energy: ElementEnergy


@partial(register_dataclass, data_fields=["parameters"], meta_fields=["energy_density"])
@dataclass(frozen=True, eq=False)
class Solid:
    """∫ ψ(F, π) over tetrahedra of one rubber, of ten nodes and, where they are mixed, four hydrostatic unknowns."""

    energy_density: Energy
    parameters: Array

    def energies(self, local: Local, loads: Loads) -> Array:
        return tet_energies(local.X, local.u, corner_hydrostatics(local), self.energy_density, self.parameters)


@partial(register_dataclass, data_fields=["density"], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Weight:
    """−∫ ρ₀ g·u over tetrahedra, a dead load; ρ₀ in t/mm³."""

    density: Array

    def energies(self, local: Local, loads: Loads) -> Array:
        return -tet_works(local.X, local.u, self.density * loads.acceleration)


@partial(register_dataclass, data_fields=[], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Pressure:
    """−Σ p_c V_c over the chambers' triangles; the data of a triangle are its shares (C,) in the chambers' volumes."""

    def energies(self, local: Local, loads: Loads) -> Array:
        return -(local.data @ loads.pressure) * triangle_volumes(local.X + local.u)


@partial(register_dataclass, data_fields=[], meta_fields=[])
@dataclass(frozen=True, eq=False)
class Plate:
    """½ Σ k_i d_i² − f·d: one element that sees the plate alone."""

    def energies(self, local: Local, loads: Loads) -> Array:
        d = local.plate
        return (0.5 * jnp.sum(loads.spring * d**2) - jnp.sum(loads.wrench * d))[None]


def corner_hydrostatics(local: Local) -> Array:
    """π at the corners of tetrahedra (E, 4); zero without mixed elements, whose energy asks for none."""
    return local.hydrostatic if local.hydrostatic.shape[1] else jnp.zeros((local.X.shape[0], 4))
