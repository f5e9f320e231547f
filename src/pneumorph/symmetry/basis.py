"""Symmetric shapes: the independent coordinates of a body's control points under a symmetry group.

A symmetric body is a fixed point of P → ρ(g) P for every operation g, which maps the control points of each surface to
those of its image. The mean of ρ(g) over the group is the projector onto the symmetric shapes. It is block diagonal
with one small block for each orbit of control points, and the basis of each block consists of unit motions of the
orbit's first point.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.sparse.csgraph import connected_components

Array = NDArray[np.float64]


def column_squares(matrix: sparse.csr_matrix) -> Array:
    """Sums (n,) of the squares of a sparse matrix's columns."""
    return np.asarray(matrix.power(2).sum(axis=0)).ravel()


def symmetric_basis(
    L: sparse.csr_matrix, group: Sequence[Array], images: Sequence[NDArray[np.int64]]
) -> tuple[sparse.csr_matrix, sparse.csr_matrix]:
    """Basis of the symmetric shapes among all shapes L v.

    Parameters
    ----------
    L : csr (3·n_points, n)
        Map from variables v to coordinates of control points; its columns are orthogonal.
    group : sequence of (3, 3) arrays, see `operations`.
    images : sequence of (n_points,) int arrays
        By operation, the control point to which it maps each.

    Returns
    -------
    basis : csr (n, n_independent)
        Symmetric changes of v are basis·φ; each entry of φ moves one control point and its images by that many mm.
    projector : csr (n, n)
        The mean over the group of its action on changes of v.
    """
    entries = column_squares(L)
    count = len(entries)
    back = sparse.diags_array(1.0 / entries) @ L.T
    projector = sparse.csr_array((count, count))
    for operation, to in zip(group, images, strict=True):
        permutation = sparse.csr_array((np.ones(len(to)), (to, np.arange(len(to)))), shape=(len(to),) * 2)
        projector = projector + sparse.csr_array(back @ sparse.kron(permutation, operation) @ L)
    projector = sparse.csr_array(projector / len(group))
    projector.data[np.abs(projector.data) < 1e-13] = 0.0
    projector.eliminate_zeros()

    blocks, block = connected_components(projector, directed=False)
    order = np.argsort(block, kind="stable")
    size = np.bincount(block)
    # Where a variable is in its block.
    local = np.empty(count, int)
    local[order] = np.arange(count) - np.repeat(np.cumsum(size) - size, size)
    # A variable belongs to the first control point that it moves; this gives the variables of an orbit's first point.
    point = np.full(count, -1)
    rows, columns = L.nonzero()
    point[columns[::-1]] = rows[::-1] // 3
    first_point = np.full(blocks, len(images[0]))
    np.minimum.at(first_point, block, point)
    first = point == first_point[block]
    rank = np.rint(np.bincount(block, projector.diagonal(), blocks)).astype(int)
    column = np.cumsum(rank) - rank
    entry = sparse.coo_array(projector)
    row, across = entry.coords

    places, values = [np.empty((2, 0), int)], [np.empty(0)]
    # Blocks of one kind at a time: there are thousands of blocks, of a few kinds.
    kinds = np.stack([size, rank, np.bincount(block, first, blocks).astype(int)])
    for kind in np.unique(kinds[:, rank > 0], axis=1).T:
        alike = np.flatnonzero((kinds == kind[:, None]).all(axis=0))
        number = np.full(blocks, -1)
        number[alike] = np.arange(len(alike))
        members = order[number[block[order]] >= 0].reshape(len(alike), -1)
        own = number[block[row]] >= 0
        dense = np.zeros((len(alike), kind[0], kind[0]))
        dense[number[block[row[own]]], local[row[own]], local[across[own]]] = entry.data[own]
        basis = _of_first_point(dense, first[members], int(kind[1]))
        which, at, independent = np.nonzero(np.abs(basis) > 1e-13)
        places.append(np.stack([members[which, at], column[alike[which]] + independent]))
        values.append(basis[which, at, independent])
    return (
        sparse.csr_matrix((np.concatenate(values), tuple(np.hstack(places))), shape=(count, int(rank.sum()))),
        sparse.csr_matrix(projector),
    )


def _of_first_point(projector: Array, first: NDArray[np.bool_], rank: int) -> Array:
    """Bases (k, m, rank) of the ranges of projectors (k, m, m), orthonormal on their first points' entries (k, m)."""
    vectors = np.linalg.eigh((projector + projector.mT) / 2.0)[1][..., -rank:]
    own = vectors[first].reshape(len(vectors), -1, rank)
    inverse = np.linalg.pinv(own)
    if rank == own.shape[1]:
        return vectors @ inverse
    free = np.linalg.eigh(own @ inverse)[1][..., -rank:]
    # Eigenvectors are defined up to a sign: make the largest entry positive.
    largest = np.abs(free).argmax(axis=1)[:, None]
    return vectors @ inverse @ (free * np.sign(np.take_along_axis(free, largest, axis=1)))
