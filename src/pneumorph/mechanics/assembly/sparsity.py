"""The sparsity of the tangent, common to all terms, and where the element blocks go in it.

The unknowns are, in this order: three displacements for each node that has its own
(not those on the tip, nor images in the cut of a sector), in node order; π of mixed elements; six
of each free obstacle; and six of the plate. Only the upper triangle is stored, for the tangent is symmetric. Supported
unknowns stay, as rows of the identity. What free obstacles couple changes with what they touch: only their diagonal is
here.

Where a tangent is never assembled, as on meshes that are refined for estimates, the unknowns are numbered and no more:
all else is found when it is first needed.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numba
import numpy as np
from scipy import sparse

from pneumorph.mechanics.assembly.pattern import Pattern
from pneumorph.mechanics.elements.terms import Connectivity


@dataclass(frozen=True)
class Couples:
    """The pairs of unknowns that the tangent couples; see `Sparsity`."""

    indptr: np.ndarray
    indices: np.ndarray
    motion: sparse.csr_array
    coupling: sparse.csr_array
    compression: sparse.csr_array
    beside_tip: np.ndarray
    corners_beside_tip: np.ndarray


@dataclass(frozen=True, eq=False)
class Sparsity:
    """Which unknowns there are, and which pairs of them the tangent couples.

    Attributes
    ----------
    connectivities : tuple of Connectivity
        Of the terms whose elements couple unknowns.
    number : (N,) int
        Rank of each node, or of that whose image it is, among those with displacements of their own; −1 on the tip.
    images : (k,) int
        Nodes that are images of others in the cut of a sector.
    corners : (n_π,) int
        Indices into `State.hydrostatic` of the entries that are unknowns; empty without mixed elements.
    rank : (P,) int
        Rank of each entry of `State.hydrostatic` in `corners`; −1 for those that are not unknowns.
    objects : int
        Number of free obstacles.
    """

    connectivities: tuple[Connectivity, ...]
    number: np.ndarray
    images: np.ndarray
    corners: np.ndarray
    rank: np.ndarray
    objects: int
    _kept: dict[int, tuple[object, Any]] = field(default_factory=dict, repr=False)

    @cached_property
    def nodes(self) -> int:
        """Number of nodes with displacements of their own."""
        return int(self.number.max()) + 1

    @cached_property
    def size(self) -> int:
        """Number of unknowns, 3·(nodes with their own) + n_π + 6·(free obstacles) + 6."""
        return 3 * self.nodes + len(self.corners) + 6 * self.objects + 6

    @cached_property
    def couples(self) -> Couples:
        """The pairs that the tangent couples."""
        return _couples_of(self)

    @property
    def indptr(self) -> np.ndarray:
        """Starts of the rows (size + 1,) of the upper triangle in CSR."""
        return self.couples.indptr

    @property
    def indices(self) -> np.ndarray:
        """Its columns, ascending in every row."""
        return self.couples.indices

    @cached_property
    def pattern(self) -> Pattern:
        """The upper triangle, with the order in which all tangents with it are factorised."""
        return Pattern(self.indptr, self.indices)

    @property
    def motion(self) -> sparse.csr_array:
        """Its pairs of nodes."""
        return self.couples.motion

    @property
    def coupling(self) -> sparse.csr_array:
        """Its pairs of nodes with entries of π."""
        return self.couples.coupling

    @property
    def compression(self) -> sparse.csr_array:
        """Its pairs of entries of π."""
        return self.couples.compression

    @property
    def beside_tip(self) -> np.ndarray:
        """Ranks (k,) of the nodes that share an element with the tip or with the plate."""
        return self.couples.beside_tip

    @property
    def corners_beside_tip(self) -> np.ndarray:
        """Ranks (k_π,) in `corners` of the entries of π that do."""
        return self.couples.corners_beside_tip

    def places(self, connectivity: Connectivity) -> BlockPlaces:
        """Where the blocks of a connectivity go, whose elements couple no more than those that it was built for."""
        return self._once(connectivity, lambda: _places_of(self, connectivity))

    def values_of(self, fixed: np.ndarray) -> np.ndarray:
        """Indices into the tangent's values: the rows and columns of fixed unknowns (n,) bool."""

        def found() -> np.ndarray:
            rows = np.repeat(np.arange(self.size), np.diff(self.indptr))
            return np.flatnonzero(fixed[rows] | fixed[self.indices])

        return self._once(fixed, found)

    def _once(self, of: object, found: Callable[[], Any]) -> Any:
        """What is found of an object, which is kept with it."""
        if id(of) not in self._kept:
            self._kept[id(of)] = of, found()
        return self._kept[id(of)][1]


@dataclass(frozen=True)
class BlockPlaces:
    """Where the blocks of a connectivity's elements, without padding, go in the values of the tangent.

    Attributes
    ----------
    visits, visit_start : (a·E,), (n + 1,) int
        For every node with displacements of its own, the numbers element·a + local node where it or its image occurs.
    slot : (E, a, a) int
        Rank of node b in the block row of node a, or −1 where the block is below the diagonal or touches the tip.
    coupling : (E·a·c·3,) int
        Index into the values of ∂²/∂u∂π for every element, node, entry of π and component; −1 on the tip.
    compression : (E·c·c,) int
        Index into the values of ∂²/∂π∂π for every element and pair of its entries of π; −1 below the diagonal.
    turned : (k,) int
        Elements with nodes that are images in the cut of a sector.
    images : (k, a) bool
        Which of their nodes are.
    """

    visits: np.ndarray
    visit_start: np.ndarray
    slot: np.ndarray
    coupling: np.ndarray
    compression: np.ndarray
    turned: np.ndarray
    images: np.ndarray


def build_sparsity(
    connectivities: Sequence[Connectivity],
    number: np.ndarray,
    images: np.ndarray,
    hydrostatics: int,
    objects: int = 0,
) -> Sparsity:
    """The common sparsity of terms with these connectivities.

    Parameters
    ----------
    number : (N,) int
        See `Sparsity`.
    images : (k,) int
        Nodes that are images of others.
    hydrostatics : int
        Length of `State.hydrostatic`.
    objects : int
        Number of free obstacles.
    """
    corners = np.unique(np.concatenate([_rows(each)[1].ravel() for each in connectivities]))
    rank = np.full(hydrostatics, -1)
    rank[corners] = np.arange(len(corners))
    return Sparsity(tuple(connectivities), number, images, corners, rank, objects)


def _couples_of(common: Sparsity) -> Couples:
    number, rank = common.number, common.rank
    n, m = common.nodes, len(common.corners)
    seen = [_rows(connectivity) for connectivity in common.connectivities]
    pairings = [_pairings(number[nodes], rank[places]) for nodes, places in seen]
    # Every unknown has a diagonal entry, even if no element touches it.
    motion = _couples([(a, b, (a >= 0) & (b >= a)) for (a, b), _, _ in pairings], np.arange(n), (n, n))
    coupling = _couples([(a, c, a >= 0) for _, (a, c), _ in pairings], np.zeros(0, int), (n, m))
    compression = _couples([(c, d, d >= c) for _, _, (c, d) in pairings], np.arange(m), (m, m))

    # The last entry is for the tip itself.
    beside, corners_beside = np.zeros(n + 1, bool), np.zeros(m, bool)
    for connectivity, (nodes, places) in zip(common.connectivities, seen, strict=True):
        near = touching(nodes, number, connectivity.plate)
        beside[number[nodes[near]]] = True
        corners_beside[rank[places[near]]] = True
    indptr, indices = _expand(motion, coupling, compression, (beside[:n], corners_beside), 6 * common.objects)
    return Couples(
        indptr=indptr,
        indices=indices,
        motion=motion,
        coupling=coupling,
        compression=compression,
        beside_tip=np.flatnonzero(beside[:n]),
        corners_beside_tip=np.flatnonzero(corners_beside),
    )


def touching(nodes: np.ndarray, number: np.ndarray, plate: bool) -> np.ndarray:
    """Which elements (E,) depend on the plate: those with a node on the tip, or all if they see the plate."""
    return np.any(number[nodes] < 0, axis=1) | np.array(plate)


def _places_of(common: Sparsity, connectivity: Connectivity) -> BlockPlaces:
    nodes, places = _rows(connectivity)
    are_images = np.isin(nodes, common.images)
    turned = np.flatnonzero(are_images.any(axis=1))
    local, hydrostatic = common.number[nodes], common.rank[places]
    (a, b), (u, p), (c, d) = _pairings(local, hydrostatic)
    slot = _slots(common.motion, a, b, (a >= 0) & (b >= a))
    coupling_slot = _slots(common.coupling, u, p, u >= 0)
    compression_slot = _slots(common.compression, c, d, d >= c)

    # In a row of u the columns of π follow the blocks of u; in a row of π they come first.
    n = len(common.motion.indptr) - 1
    row = 3 * local[:, :, None] + np.arange(3)
    first = common.indptr[row] + 3 * np.diff(common.motion.indptr)[local][:, :, None] - np.arange(3)
    coupling = first[:, :, None, :] + coupling_slot[:, :, :, None]
    coupling[coupling_slot < 0] = -1
    compression = common.indptr[3 * n + c] + compression_slot
    compression[compression_slot < 0] = -1

    touches = local.ravel()
    order = np.argsort(touches, kind="stable")
    order = order[touches[order] >= 0]
    start = np.searchsorted(touches[order], np.arange(n + 1))
    return BlockPlaces(order, start, slot, coupling.ravel(), compression.ravel(), turned, are_images[turned])


def _rows(connectivity: Connectivity) -> tuple[np.ndarray, np.ndarray]:
    """Nodes and entries of π of the elements, without the padding."""
    count = connectivity.count
    return np.asarray(connectivity.nodes)[:count], np.asarray(connectivity.hydrostatics)[:count].astype(int)


def _pairings(local, hydrostatic):
    """All pairs in every element: of nodes (E, a, a), of nodes with entries of π (E, a, c), of those (E, c, c)."""
    return (
        np.broadcast_arrays(local[:, :, None], local[:, None, :]),
        np.broadcast_arrays(local[:, :, None], hydrostatic[:, None, :]),
        np.broadcast_arrays(hydrostatic[:, :, None], hydrostatic[:, None, :]),
    )


def _couples(pairs, diagonal: np.ndarray, shape: tuple[int, int]) -> sparse.csr_array:
    """The pattern of all used pairs (a, b) and of the given diagonal entries."""
    rows = np.concatenate([*(a[used] for a, _, used in pairs), diagonal])
    columns = np.concatenate([*(b[used] for _, b, used in pairs), diagonal])
    couples = sparse.csr_array((np.ones(len(rows), np.int8), (rows, columns)), shape=shape)
    couples.sum_duplicates()
    couples.sort_indices()
    return couples


def _slots(couples: sparse.csr_array, i: np.ndarray, j: np.ndarray, used: np.ndarray) -> np.ndarray:
    """The rank of every pair (i, j) in its row; −1 for pairs that are not used."""
    slot = np.full(used.shape, -1, dtype=np.int32)
    i, j = i[used].astype(np.int64), j[used]
    if len(i):
        starts = couples.indptr
        stride = int(max(couples.indices.max(), j.max())) + 1
        keys = np.repeat(np.arange(len(starts) - 1), np.diff(starts)) * stride + couples.indices
        places = np.searchsorted(keys, i * stride + j).clip(max=len(keys) - 1)
        if np.any(keys[places] != i * stride + j):
            raise ValueError("the sparsity was built without these elements")
        slot[used] = places - starts[i]
    return slot


def _expand(
    motion: sparse.csr_array,
    coupling: sparse.csr_array,
    compression: sparse.csr_array,
    by_plate: tuple[np.ndarray, np.ndarray],
    own: int,
) -> tuple[np.ndarray, np.ndarray]:
    """Scalar CSR (upper triangle) of 3×3 blocks of u, rows of u with π, rows of π; six plate columns where asked.

    And of `own` unknowns with nothing but their diagonal.
    """
    n, m = len(motion.indptr) - 1, len(compression.indptr) - 1
    u_plate, p_plate = (6 * beside for beside in by_plate)
    # Rows of the second and third component leave out what is left of the diagonal, which comes first.
    u = (3 * np.diff(motion.indptr) + np.diff(coupling.indptr) + u_plate)[:, None] - np.arange(3)
    counts = np.concatenate(
        [[0], u.ravel(), np.diff(compression.indptr) + p_plate, np.ones(own, int), np.arange(6, 0, -1)]
    )
    indptr = np.cumsum(counts).astype(np.int32)
    indices = np.empty(indptr[-1], np.int32)
    plate, size = 3 * n + m + own + np.arange(6), len(indptr) - 1
    _fill(indices, indptr, motion.indptr, motion.indices, coupling.indptr, coupling.indices, u_plate, plate)
    for row, beside in enumerate(p_plate, 3 * n):
        first = indptr[row]
        along = compression.indices[compression.indptr[row - 3 * n] : compression.indptr[row - 3 * n + 1]]
        indices[first : first + len(along)] = 3 * n + along
        if beside:
            indices[first + len(along) : indptr[row + 1]] = plate
    indices[indptr[3 * n + m] : indptr[3 * n + m + own]] = 3 * n + m + np.arange(own)
    indices[indptr[size - 6] :] = np.concatenate([plate[k:] for k in range(6)])
    return indptr, indices


@numba.njit(cache=True, nogil=True)
def _fill(indices, indptr, motion_start, motion, coupling_start, coupling, beside, plate):
    """The columns of the rows of u: blocks of u, then π, then the plate where it is beside."""
    n = len(motion_start) - 1
    for node in range(n):
        for component in range(3):
            at = indptr[3 * node + component]
            for k in range(motion_start[node], motion_start[node + 1]):
                for other in range(component if motion[k] == node else 0, 3):
                    indices[at] = 3 * motion[k] + other
                    at += 1
            for k in range(coupling_start[node], coupling_start[node + 1]):
                indices[at] = 3 * n + coupling[k]
                at += 1
            if beside[node]:
                for k in range(6):
                    indices[at + k] = plate[k]
