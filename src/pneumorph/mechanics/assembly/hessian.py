"""The tangent's values: solid elements, chambers and the plate, added up in the fixed pattern."""

from __future__ import annotations

import numpy as np

from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.element import TET_CORNER_N, TET_DN
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.potential import Loads, State
from pneumorph.mechanics.assembly.stiffness import coupling_blocks, element_blocks, gather, invariant_blocks, scatter
from pneumorph.mechanics.material.energies import OfInvariants


def tangent(model: Model, X, state: State, loads: Loads, held: np.ndarray) -> np.ndarray:
    """Values of the tangent ∂²Π in the pattern's order.

    Rows and columns of fixed and of `held` (6,) plate unknowns are the identity's.
    """
    sparsity = model.pattern
    blocks, inverse_jacobian = _solid_blocks(model, X, state)
    data = np.zeros(len(sparsity.indices))
    gather(blocks, sparsity.visits, sparsity.visit_start, sparsity.slot, sparsity.indptr, data)
    if model.mixed:
        slopes, compressions = kernels.couplings(*model.rubber_arguments, model.top, X, state)
        coupling = np.empty((model.elements, 10, 4, 3))
        coupling_blocks(np.asarray(slopes), inverse_jacobian, TET_DN, TET_CORNER_N, coupling)
        scatter(coupling.ravel(), sparsity.coupling_places, data)
        among = np.asarray(compressions)[:, : model.elements]
        compression = np.einsum("qe,qc,qd->ecd", among, TET_CORNER_N, TET_CORNER_N, optimize=True)
        scatter(compression.ravel(), sparsity.compression_places, data)
    if len(model.chamber_places):
        hessians = np.asarray(kernels.volume_hessians(model.top, X, state, loads.pressure))
        scatter(hessians.ravel(), model.chamber_places, data)
    if model.plate:
        columns = kernels.plate_columns(*model.rubber_arguments, model.near_tip, X, state, loads)
        number = sparsity.number[sparsity.beside_tip]
        row_ends = sparsity.indptr[(3 * number[:, None] + np.arange(3)) + 1]
        data[row_ends[:, :, None] + np.arange(-6, 0)] = np.asarray(columns.u)[sparsity.beside_tip]
        if model.mixed:
            beside = sparsity.corners_beside_tip
            row_ends = sparsity.indptr[3 * len(model.off_tip) + beside + 1]
            data[row_ends[:, None] + np.arange(-6, 0)] = np.asarray(columns.pressure)[sparsity.corners[beside]]
        data[-21:] = np.asarray(columns.plate)[np.triu_indices(6)]
    data[model.supported_values] = 0.0
    data[model.diagonal[model.fixed]] = 1.0
    if model.plate and held.any():
        _hold(model, data, held)
    return data


def _solid_blocks(model: Model, X, state: State) -> tuple[np.ndarray, np.ndarray]:
    """Stiffness blocks (M, 55, 9) of the elements, and ∂ξ/∂X (3, 3, 4, M) at their points."""
    arguments = (*model.rubber_arguments, model.top, X, state)
    blocks = np.empty((model.elements, 55, 9))
    if isinstance(arguments[0], OfInvariants):
        # Nine derivatives instead of eighty-one: half the time of the whole assembly.
        derivatives, F, inverse_jacobian = map(np.asarray, kernels.invariant_derivatives(*arguments))
        invariant_blocks(derivatives, F, inverse_jacobian, TET_DN, blocks)
    else:
        moduli, inverse_jacobian = map(np.asarray, kernels.moduli(*arguments))
        element_blocks(moduli, inverse_jacobian, TET_DN, blocks)
    return blocks, inverse_jacobian


def _hold(model: Model, data: np.ndarray, held: np.ndarray) -> None:
    sparsity = model.pattern
    columns = sparsity.size - 6 + np.flatnonzero(held)
    data[np.isin(sparsity.indices, columns)] = 0.0
    corner = data[-21:]
    rows, _ = np.triu_indices(6)
    corner[held[rows]] = 0.0
    data[model.diagonal[columns]] = 1.0
