"""The unknowns of a refined mesh as those of the coarser one and what new nodes have beyond them, and their blocks.

See `refined.py`, where these make up a preconditioner.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pneumorph.mechanics.assembly.displacement import Displacement, displacement
from pneumorph.mechanics.assembly.krylov import conjugate_gradients
from pneumorph.mechanics.assembly.tangent import Configuration
from pneumorph.mechanics.assembly.tip import Tied
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mesh.refine import Refined

SOFTER = 0.5
"""α: where B takes a part of them, displacements are softer than their own blocks are."""

INNER, CLOSE = 4, 0.05
"""Most steps for the Schur complement, and the relative residual at which they end."""


def hydrostatic_on(fine: Refined, at: Configuration, state: State) -> np.ndarray:
    """π of a state or a direction of the coarser mesh at all nodes of the refined one, region by region."""
    if not at.model.mixed:
        return state.hydrostatic
    coarse = np.asarray(state.hydrostatic).reshape(len(at.model.rubbers), -1)
    return (fine.linear @ coarse.T).T.ravel()


class Split:
    """The unknowns of a refined mesh: those of the coarser one (`coarse` of them), s (m, 3) of new nodes, and q."""

    def __init__(self, fine: Refined, at: Configuration, state: State, there: Configuration):
        self.fine, self.at, self.coarse = fine, at, at.model.size
        self._nodes = Displacement(at.model.tip, at.X, state)
        own = there.model.independent
        new = own >= at.model.nodes
        free = ~there.constrained[: 3 * len(own)].reshape(-1, 3)
        self.new, self.free = own[new], free[new]
        corners = there.model.sparsity.corners
        self.inside = corners[np.isin(corners % there.model.nodes, fine.mids)]

    def of_coarse(self, c: np.ndarray) -> np.ndarray:
        """Unknowns of the coarser mesh as those of the refined one."""
        return np.concatenate([c, np.zeros(3 * len(self.new) + len(self.inside))])

    def direction(self, x: np.ndarray) -> State:
        """A change of the unknowns as one of the state of the refined mesh."""
        change = self.at.model.state(x[: self.coarse])
        u, hydrostatic = self.fine.P @ self._nodes.along(change), hydrostatic_on(self.fine, self.at, change)
        u[self.new] += x[self.coarse : self.coarse + self.free.size].reshape(-1, 3)
        hydrostatic[self.inside] += x[self.coarse + self.free.size :]
        return change._replace(u=u, hydrostatic=hydrostatic)

    def forces(self, full: State) -> np.ndarray:
        """The transpose: forces on the unknowns from those on the refined mesh, zero where they are constrained."""
        model = self.at.model
        by = self._nodes.pulled(self.fine.P.T @ full.u)
        by = by._replace(plate=by.plate + full.plate, objects=full.objects)
        if model.mixed:
            every = self.fine.linear.T @ full.hydrostatic.reshape(len(model.rubbers), -1).T
            on_sources = [np.bincount(model.source, each, model.nodes) for each in every.T]
            by = by._replace(hydrostatic=np.concatenate(on_sources))
        c = np.where(self.at.constrained, 0.0, model.vector(by))
        s = np.where(self.free, full.u[self.new], 0.0)
        return np.concatenate([c, s.ravel(), full.hydrostatic[self.inside]])


@dataclass(frozen=True, eq=False)
class Surplus:
    """Blocks of s and q: (αD)⁻¹ (m, 3, 3), B (k, 3m), C (k, k), and the diagonal of the Schur complement."""

    softness: np.ndarray
    coupling: sparse.csr_array
    compression: sparse.csr_array
    diagonal: np.ndarray

    def _yielding(self, forces: np.ndarray) -> np.ndarray:
        return np.einsum("aij,aj->ai", self.softness, forces.reshape(-1, 3)).ravel()

    def solved(self, forces: np.ndarray) -> np.ndarray:
        """s and q from the forces on them."""
        end = 3 * len(self.softness)
        s = self._yielding(forces[:end])
        if end == len(forces):
            return s
        B, C = self.coupling, self.compression
        q = conjugate_gradients(
            lambda q: C @ q + B @ self._yielding(B.T @ q),
            lambda r: r / self.diagonal,
            B @ s - forces[end:],
            CLOSE,
            INNER,
        ).x
        return np.concatenate([s - self._yielding(B.T @ q), q])


def surplus_of(split: Split, there: Configuration, state: State) -> Surplus | None:
    """The blocks at a state; None where a new node alone would lower the potential."""
    model = there.model
    u, tied = displacement(model.tip, there.X, state), model.tip.tied
    rank, inside = np.full(model.nodes, -1), np.full(len(model.sparsity.rank), -1)
    rank[split.new], inside[split.inside] = np.arange(len(split.new)), np.arange(len(split.inside))
    rank[tied.nodes] = rank[tied.sources]
    D, B, C = np.zeros((len(split.new), 3, 3)), _Entries(), _Entries()
    for elements, energies in model.potential.groups:
        nodes, places = elements.nodes[: elements.count], elements.hydrostatics[: elements.count].astype(int)
        if nodes.shape[1] == 0:
            continue
        at, turn = elements.local(there.X, u, state), _turns(tied, nodes)
        for energy in energies:
            if (blocks := energy.node_blocks(elements, at, there.loads)) is None:
                continue
            motion, coupling, compression = blocks
            _add_blocks(D, rank[nodes], motion.reshape(*nodes.shape, 3, 3), turn)
            if places.shape[1]:
                coupling = coupling if turn is None else coupling @ turn
                of = 3 * rank[nodes][:, :, None, None] + np.arange(3)
                B.add(coupling, inside[places][:, None, :, None], of)
                C.add(-compression, inside[places][:, :, None], inside[places][:, None, :])
    for touch, _, _ in model.potential.touches(there.X + u, state, there.loads):
        by_places = sparse.bsr_array(touch.hessian, blocksize=(3, 3))
        row = np.repeat(np.arange(model.nodes), np.diff(by_places.indptr))
        own = np.flatnonzero(row == by_places.indices)
        _add_blocks(D, rank[row[own]], by_places.data[own], _turns(tied, row[own]))
    fixed = ~split.free
    D[fixed[:, :, None] | fixed[:, None, :]] = 0.0
    D[:, np.arange(3), np.arange(3)] += fixed
    if not all(np.all(np.linalg.det(D[:, :k, :k]) > 0.0) for k in (1, 2, 3)):
        return None
    softness = np.linalg.inv(D) / (SOFTER if model.mixed else 1.0)
    count, size = len(split.inside), 3 * len(D)
    coupling = B.matrix((count, size)) @ sparse.diags_array(split.free.ravel().astype(float))
    compression, starts = C.matrix((count, count)), np.arange(len(D) + 1)
    yielding = coupling @ sparse.bsr_array((softness, starts[:-1], starts), (size, size)).tocsr()
    diagonal = compression.diagonal() + yielding.multiply(coupling).sum(axis=1)
    return Surplus(softness, sparse.csr_array(coupling), compression, diagonal)


class _Entries:
    """The entries of a matrix, which are added up; those with a negative row or column are not in it."""

    def __init__(self) -> None:
        self._parts: list[tuple[np.ndarray, ...]] = [(np.zeros(0), np.zeros(0, int), np.zeros(0, int))]

    def add(self, values: np.ndarray, rows: np.ndarray, columns: np.ndarray) -> None:
        rows, columns = np.broadcast_to(rows, values.shape), np.broadcast_to(columns, values.shape)
        used = (rows >= 0) & (columns >= 0)
        self._parts.append((values[used], rows[used], columns[used]))

    def matrix(self, shape: tuple[int, int]) -> sparse.csr_array:
        values, rows, columns = map(np.concatenate, zip(*self._parts, strict=True))
        return sparse.csr_array((values, (rows, columns)), shape)


def _turns(tied: Tied, nodes: np.ndarray) -> np.ndarray | None:
    """The turns (…, 3, 3) from the sources of nodes to them; None where none is an image."""
    images = np.isin(nodes, tied.nodes)
    return np.where(images[..., None, None], tied.turn, np.eye(3)) if images.any() else None


def _add_blocks(D: np.ndarray, rank: np.ndarray, blocks: np.ndarray, turn: np.ndarray | None) -> None:
    """Add blocks (…, 3, 3) of nodes with these ranks to D (m, 3, 3), turned back from where they are images."""
    blocks = blocks if turn is None else turn.swapaxes(-1, -2) @ blocks @ turn
    of = rank[rank >= 0]
    for i in range(3):
        for j in range(3):
            D[:, i, j] += np.bincount(of, blocks[rank >= 0, i, j], len(D))
