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

    _, block = connected_components(projector, directed=False)
    order = np.argsort(block, kind="stable")
    starts = np.flatnonzero(np.diff(block[order], prepend=-1))
    # A variable belongs to the first control point that it moves; this gives the variables of an orbit's first point.
    point = np.full(count, -1)
    rows, columns = L.nonzero()
    point[columns[::-1]] = rows[::-1] // 3
    places, values = [], []
    count_so_far = 0
    for members in np.split(order, starts[1:]):
        dense = projector[members][:, members].toarray()
        rank = round(float(np.trace(dense)))
        if rank == 0:
            continue
        basis = _of_first_point(dense, point[members] == point[members].min(), rank)
        local, column = np.nonzero(np.abs(basis) > 1e-13)
        places.append((members[local], count_so_far + column))
        values.append(basis[local, column])
        count_so_far += rank
    where = tuple(np.concatenate(part) for part in zip(*places, strict=True))
    return (
        sparse.csr_matrix((np.concatenate(values), where), shape=(count, count_so_far)),
        sparse.csr_matrix(projector),
    )


def _of_first_point(projector: Array, first: NDArray[np.bool_], rank: int) -> Array:
    """Basis (m, rank) of a projector's range that is orthonormal on the first point's entries."""
    vectors = np.linalg.eigh((projector + projector.T) / 2.0)[1][:, -rank:]
    own = vectors[first]
    inverse = np.linalg.pinv(own)
    if rank == np.count_nonzero(first):
        return vectors @ inverse
    free = np.linalg.eigh(own @ inverse)[1][:, -rank:]
    # Eigenvectors are defined up to a sign: make the largest entry positive.
    return vectors @ inverse @ (free * np.sign(free[np.abs(free).argmax(axis=0), np.arange(rank)]))
