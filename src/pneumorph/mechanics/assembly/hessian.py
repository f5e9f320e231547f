"""Assembly of the tangent: the element blocks of all terms are added up in one sparsity, then the plate's columns.

The blocks come from the energies of the terms themselves, so no term can be forgotten.
"""

from __future__ import annotations

import numpy as np
from scipy import sparse

from pneumorph.mechanics.assembly.displacement import Displacement, displacement
from pneumorph.mechanics.assembly.metrics import Metrics, taut
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.potential import Potential
from pneumorph.mechanics.assembly.products import object_columns, plate_columns
from pneumorph.mechanics.assembly.sparsity import BlockPlaces
from pneumorph.mechanics.elements.energy import Blocks
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.stiffness import gather, scatter
from pneumorph.mechanics.elements.terms import Loads


def tangent(
    model: Model,
    X: np.ndarray,
    state: State,
    loads: Loads,
    blocked: np.ndarray,
    ratios: np.ndarray | None = None,
    metrics: Metrics = (),
) -> np.ndarray:
    """Values of the tangent ∂²Π, in the order of the sparsity.

    Rows and columns of supported unknowns and of `blocked` (6,) plate unknowns are those of the identity. With volume
    ratios (4, E) the volumetric stress of plain elements is that of these, not of the state's own; with metrics the
    tension of sheets and fibres is theirs.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    blocked : (6,) bool
        Components of the plate that are held.
    ratios : (4, E) array, optional
        Volume ratios at the quadrature points of all elements.
    metrics : Metrics
        Of the faces under sheets and fibres.
    """
    return with_supports(model, unsupported(model, X, state, loads, ratios, metrics), blocked)


def unsupported(
    model: Model,
    X: np.ndarray,
    state: State,
    loads: Loads,
    ratios: np.ndarray | None = None,
    metrics: Metrics = (),
) -> np.ndarray:
    """The same without supports and blocks, from which `with_supports` makes that of every model of the same mesh.

    Parameters
    ----------
    model, X, state, loads, ratios, metrics
        As for `tangent`.
    """
    potential = taut(model, metrics) if metrics else model.potential
    regions = iter(model.regions.values())
    common = model.sparsity
    data = np.zeros(len(common.indices))
    u = displacement(model.tip, X, state)
    for (elements, energies), places in zip(potential.groups, model.places, strict=True):
        at = elements.local(X, u, state)
        for energy in energies:
            own = None
            if ratios is not None and energy.of_rubber:
                own = ratios[:, next(regions)]
            blocks = energy.blocks(elements, at, loads, own)
            if blocks is None:
                continue
            motion, coupling, compression = _turned_back(blocks, places, model.tip.tied.turn)
            gather(motion, places.visits, places.visit_start, places.slot, common.indptr, data)
            scatter(coupling.ravel(), places.coupling, data)
            scatter(compression.ravel(), places.compression, data)
    if model.plate:
        _add_plate(model, potential, X, state, loads, data)
    return data


def with_supports(model: Model, data: np.ndarray, blocked: np.ndarray) -> np.ndarray:
    """The values of `unsupported` with rows and columns of the identity, in place.

    Parameters
    ----------
    model : Model
        With its supports.
    data : array
        The values, which are changed.
    blocked : (6,) bool
        Components of the plate that are held.
    """
    data[model.supported_values] = 0.0
    data[model.diagonal[model.fixed]] = 1.0
    if model.plate and blocked.any():
        _hold(model, data, blocked)
    return data


def contact_in_pairs(
    model: Model, X: np.ndarray, state: State, loads: Loads, constrained: np.ndarray
) -> sparse.coo_array:
    """What contact in pairs and free obstacles add to the tangent: the upper triangle, without constrained unknowns.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    constrained : (n,) bool
        Unknowns that keep their value.
    """
    nodes = Displacement(model.tip, X, state)
    by_places, turned = _by_places(model.potential, nodes, loads)
    own, on, first = model.independent, model.tip.nodes, model.size - 6
    axes, tied = np.arange(3), model.tip.tied
    rows, columns = [(3 * own[:, None] + axes).ravel()], [np.arange(3 * len(own))]
    values = [np.ones(3 * len(own))]
    if len(tied.nodes):
        rows.append(np.repeat((3 * tied.nodes[:, None] + axes).ravel(), 3))
        columns.append(np.repeat(3 * model.sparsity.number[tied.nodes], 9) + np.tile(axes, 3 * len(tied.nodes)))
        values.append(np.tile(tied.turn.ravel(), len(tied.nodes)))
    if len(on):
        rows.append(np.repeat((3 * on[:, None] + axes).ravel(), 6))
        columns.append(np.tile(first + np.arange(6), 3 * len(on)))
        values.append(np.stack([nodes.ride.along(unit) for unit in np.eye(6)], axis=-1).ravel())
    entries = tuple(map(np.concatenate, (values, rows, columns)))
    by = sparse.csr_array((entries[0], entries[1:]), shape=(X.size, model.size))
    whole = sparse.coo_array(sparse.triu(by.T @ by_places @ by))
    corner = sparse.coo_array(np.triu(turned))
    objects = _objects(model, X, state, loads)
    row = np.concatenate([whole.coords[0], first + corner.coords[0], objects.coords[0]])
    column = np.concatenate([whole.coords[1], first + corner.coords[1], objects.coords[1]])
    data = np.concatenate([whole.data, corner.data, objects.data])
    free = ~(constrained[row] | constrained[column])
    summed = sparse.coo_array((data[free], (row[free], column[free])), shape=(model.size, model.size))
    summed.sum_duplicates()
    return summed


def _by_places(potential: Potential, nodes: Displacement, loads: Loads) -> tuple[sparse.csr_array, np.ndarray]:
    """Of contact in pairs: ∂²E/∂x∂x (3N, 3N) by the places of all nodes, and what the plate's turn adds (6, 6)."""
    x, tip = nodes.X + nodes.u, nodes.tip.nodes
    hessian, turned = sparse.csr_array((x.size, x.size)), np.zeros((6, 6))
    for touch, _, _ in potential.touches(x, nodes.state, loads):
        hessian = hessian + touch.hessian
        if len(tip):
            on_tip = touch.slope[tip]
            turned += np.stack([nodes.ride.on_plate_changed(on_tip, unit) for unit in np.eye(6)], axis=-1)
    return hessian, turned


def _objects(model: Model, X: np.ndarray, state: State, loads: Loads) -> sparse.coo_array:
    """The columns of free obstacles' unknowns in the upper triangle (n, n); some may be beside what they touch."""
    own = np.arange(model.size)[model.object_unknowns]
    shape = model.size, model.size
    if not len(own):
        return sparse.coo_array(shape)
    columns = [model.vector(each) for each in object_columns(model.potential, X, state, loads)]
    matrix = sparse.coo_array(np.stack(columns, axis=1))
    row, column = matrix.coords[0], own[matrix.coords[1]]
    # What follows them in the order of the unknowns, the plate, is in rows of theirs.
    above, after = row <= column, row > own[-1]
    rows, others = np.concatenate([row[above], column[after]]), np.concatenate([column[above], row[after]])
    return sparse.coo_array((np.concatenate([matrix.data[above], matrix.data[after]]), (rows, others)), shape=shape)


def _turned_back(blocks: Blocks, places: BlockPlaces, turn: np.ndarray) -> Blocks:
    """The blocks by the displacements of the nodes in the first cut, where there are those of their images."""
    if not len(places.turned):
        return blocks
    motion, coupling, compression = blocks
    some, (b, a) = places.turned, np.tril_indices(places.images.shape[1])
    by = np.where(places.images[..., None, None], turn, np.eye(3))
    motion, coupling = motion.copy(), coupling.copy()
    pairs = motion[some].reshape(len(some), -1, 3, 3)
    motion[some] = np.einsum("enji,enjk,enkl->enil", by[:, a], pairs, by[:, b]).reshape(len(some), -1, 9)
    coupling[some] = np.einsum("eaji,eacj->eaci", by, coupling[some])
    return motion, coupling, compression


def _add_plate(model: Model, potential: Potential, X: np.ndarray, state: State, loads: Loads, data: np.ndarray) -> None:
    """The six columns of the plate, which moves the nodes of the tip; for all terms at once."""
    common = model.sparsity
    columns = plate_columns(potential, X, state, loads)
    number = common.beside_tip
    row_ends = common.indptr[(3 * number[:, None] + np.arange(3)) + 1]
    data[row_ends[:, :, None] + np.arange(-6, 0)] = columns.u[model.independent[number]]
    if model.mixed:
        beside = common.corners_beside_tip
        row_ends = common.indptr[3 * len(model.independent) + beside + 1]
        data[row_ends[:, None] + np.arange(-6, 0)] = columns.hydrostatic[common.corners[beside]]
    data[-21:] = columns.plate[np.triu_indices(6)]


def _hold(model: Model, data: np.ndarray, blocked: np.ndarray) -> None:
    columns = model.size - 6 + np.flatnonzero(blocked)
    data[np.isin(model.sparsity.indices, columns)] = 0.0
    corner = data[-21:]
    rows, _ = np.triu_indices(6)
    corner[blocked[rows]] = 0.0
    data[model.diagonal[columns]] = 1.0
