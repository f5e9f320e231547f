"""What the elements of a term see: their nodes and unknowns, constants, and the loads."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, NamedTuple

import numpy as np

from pneumorph.mechanics.elements.kinematics import State

Values = Any
"""NumPy arrays, or JAX arrays inside compiled functions."""


class Loads(NamedTuple):
    """The loads: chamber pressures (C,) MPa, acceleration g (3,) mm/s², springs and dead loads of the plate (6,).

    `shift` (K, 6) are the poses of rigid obstacles, in the order of `Contact.obstacles`: the displacement of each from
    its place in mm, and its rotation vector about its centre in rad; see `pose.py`. `reinforcement` (R, 2) are
    changes of the stiffness, N/mm, and of the coverage of sheets or the winding angle of fibres, rad, in the order of
    `Model.reinforcements`. `held` (6,) are the values at which blocked components of the plate are held, mm and rad.
    """

    pressure: Values
    acceleration: Values
    spring: Values
    wrench: Values
    shift: Values = np.zeros((0, 6))
    reinforcement: Values = np.zeros((0, 2))
    held: Values = np.zeros(6)


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
        return Local(self.gathered(X), self.gathered(u), seen, plate, self.data, objects)

    def moving(self, du: np.ndarray, dstate: State) -> Local:
        """Gather what they see of a change of displacements (N, 3) and of the other unknowns, at nodes that rest."""
        u, (seen, plate, objects) = self.gathered(du), self._others(dstate)
        return Local(np.zeros(u.shape), u, seen, plate, self.data, objects)

    def gathered(self, vectors: np.ndarray) -> np.ndarray:
        """Vectors (N, 3) of all nodes as the elements see them (E, a, 3)."""
        # A quarter of the time that indexing takes.
        return np.take(vectors, self.nodes, axis=0)

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
    """The connectivity of elements with `nodes` (E, a), padded with copies of the first element.

    Parameters
    ----------
    nodes : (E, a) int
        Numbers of nodes.
    hydrostatics : (E, c) int, optional
        Indices into `State.hydrostatic`.
    data : (E, k) array, optional
        Constants of the elements.
    plate, objects : bool
        Whether they see the plate's unknowns, and those of free obstacles.
    """
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
