"""The state on a refined mesh near one of the coarser mesh, without a factorisation there.

The fields of the coarser mesh are fields of the refined mesh too. So unknowns of the refined mesh are those of the
coarser one, c, and what new nodes have beyond the coarser fields: displacements s, and q of π. In these, K δ = −R is
solved by a few products. The preconditioner has the tangent of the coarser mesh for c, whose factorisation there is,
and for s the blocks D of every new node with itself (Yserentant 1986, Numerische Mathematik 49, 379–412). With π the
part of s and q is

    [ αD   Bᵀ ]
    [ B   −C  ]

with the couplings B of both: of its Schur complement C + B D⁻¹Bᵀ/α, which is like a mass matrix, a few steps of
conjugate gradients are enough.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import sparse

from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.displacement import Displacement, displacement
from pneumorph.mechanics.assembly.krylov import conjugate_gradients, minimal_residuals
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.products import tangent_map
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.assembly.tip import Tied
from pneumorph.mechanics.elements.kinematics import Guess, State, deformation_gradients, volume_ratio
from pneumorph.mechanics.solve.balance import apart, bulk_over_shear, free_share
from pneumorph.mechanics.solve.border import Border, border_at, enclosed_in, missing_volumes, pushes, with_pressures
from pneumorph.mesh.refine import PARTS_OF_TET, Refined

PLAIN, MIXED = 20, 60
"""Most products with the tangent: of plain elements, and of those with π."""

PLAIN_LEFT, MIXED_LEFT = 0.1, 0.02
"""The part of the residual, in the norm of the preconditioner, at which they end. With a third left, a motion to which
parts of both signs contribute may be wrong in sign; with π with 6 % left too, and it may lack two thirds."""

SOFTER = 0.5
"""α: where B takes a part of them, displacements are softer than their own blocks are."""

INNER, CLOSE = 4, 0.05
"""Most steps for the Schur complement, and the relative residual at which they end."""

LOCKING = 50.0
"""κ/μ from which elements without π are so much too stiff that a few products do not show it."""

CONTRACTING = 0.35
"""The largest part of the residual that may be left, in the norm of the preconditioner."""


def on_refined(fine: Refined, at: Configuration, state: State) -> State:
    """A state of a mesh as one of the refined mesh."""
    u = fine.P @ displacement(at.model.tip, at.X, state)
    return state._replace(u=u, hydrostatic=_pressures(fine, at, state))


def guess_on_refined(fine: Refined, at: Configuration, state: State) -> Guess:
    """A state of a mesh as a start on the refined mesh: its displacements, and the mean volume ratio of every element.

    In the parts of an element the ratios of its displacements vary as they like, since only their mean is in balance
    there; where κ is large, their stress makes the tangent indefinite.
    """
    tets = at.model.tets.nodes[: at.model.elements]
    ratios = volume_ratio(deformation_gradients(tets, at.X, displacement(at.model.tip, at.X, state)))
    means = np.repeat(ratios.mean(axis=0), len(PARTS_OF_TET))
    return Guess(on_refined(fine, at, state), ratios=np.tile(means, (len(ratios), 1)))


def near_refined(
    fine: Refined, at: Configuration, tangent: Tangent, state: State, there: Configuration
) -> tuple[Configuration, State] | None:
    """The state on a refined mesh, with its configuration (enclosed chambers have other pressures there).

    None where the residual does not fall, where surfaces would meet, where small parts of the body are unstable, and
    for nearly incompressible rubber without π.

    Parameters
    ----------
    fine : Refined
        The mesh.
    at, state : of the coarser mesh, an equilibrium.
    tangent : Tangent
        The linear solver of the coarser mesh; it is factorised at the state if it is not yet.
    there : Configuration
        The refined mesh under the same loads.
    """
    start = on_refined(fine, at, state)
    vector = there.model.vector(start)
    if not apart(there, vector) or (not at.model.mixed and bulk_over_shear(at) >= LOCKING):
        return None
    try:
        tangent.move_to(at, state)
    except SingularMatrix:
        return None
    border = None if at.enclosed is None else border_at(at, tangent, state)
    split = Split(fine, at, state, there)
    surplus = surplus_of(split, there, start)
    if surplus is None:
        return None
    model = there.model
    product = tangent_map(model.potential, there.X, start, there.loads)

    def pulled(vector: np.ndarray) -> np.ndarray:
        """−R, by the split unknowns."""
        residual = kernels.value_and_residual(model.potential, there.X, model.state(vector), there.loads)[1]
        return -split.forces(residual)

    def precondition(r: np.ndarray) -> np.ndarray:
        return np.concatenate([tangent.precondition(r[: split.coarse]), surplus.solved(r[split.coarse :])])

    before, definite = pulled(vector), not model.mixed and tangent.negative_pivots == 0
    method, left, most = (
        (conjugate_gradients, PLAIN_LEFT, PLAIN) if definite else (minimal_residuals, MIXED_LEFT, MIXED)
    )
    solution = method(lambda x: split.forces(product(split.direction(x))), precondition, before, left, most)
    step = model.vector(split.direction(solution.x))
    if border is not None:
        there, step = _with_pressures(there, border, split, vector, step)
    if not np.isfinite(solution.spread) or not np.all(np.isfinite(step)) or free_share(there, vector, step) < 1.0:
        return None
    after = pulled(vector + step)
    first, last = precondition(before), precondition(after)
    sizes = [np.sqrt(r @ z) if definite else np.linalg.norm(z) for r, z in ((before, first), (after, last))]
    if not sizes[1] <= CONTRACTING * sizes[0]:
        return None
    # Forces on the plate and on obstacles need balance where they are passed on, which is in the coarser fields.
    balanced = split.of_coarse(last[: split.coarse])
    return there, model.state(vector + step + model.vector(split.direction(balanced)))


def _pressures(fine: Refined, at: Configuration, state: State) -> np.ndarray:
    """π of a state or a direction of the coarser mesh at all nodes of the refined one, region by region."""
    if not at.model.mixed:
        return state.hydrostatic
    coarse = np.asarray(state.hydrostatic).reshape(len(at.model.rubbers), -1)
    return (fine.linear @ coarse.T).T.ravel()


def _with_pressures(
    there: Configuration, border: Border, split: Split, vector: np.ndarray, step: np.ndarray
) -> tuple[Configuration, np.ndarray]:
    """The pressures of enclosed chambers after a step at constant ones, and the step with their change.

    How the body yields to them is taken from the coarser mesh.
    """
    model, given = there.model, enclosed_in(there)
    state = model.state(vector)
    push = pushes(there, given, state)
    change = np.linalg.solve(border.schur, push.T @ step - missing_volumes(there, state))
    step = step + model.vector(split.direction(split.of_coarse(border.along @ change)))
    return with_pressures(there, given, np.asarray(there.loads.pressure)[given.rows(model)] + change), step


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
        u, hydrostatic = self.fine.P @ self._nodes.along(change), _pressures(self.fine, self.at, change)
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
