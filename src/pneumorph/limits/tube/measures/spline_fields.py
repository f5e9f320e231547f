"""Tensor-product B-splines on a grid of samples, each of which depends on four rows and four columns of the net."""

from __future__ import annotations

import numba
import numpy as np


@numba.njit(cache=True, nogil=True, fastmath={"contract", "reassoc"})
def combined(net, support_r, functions_r, support_q, functions_q, orders):
    """Fields (m, d, rows, columns) of a control net (d, n_r, n_q), d coordinates of each control point.

    Parameters
    ----------
    support_r, support_q : (rows, 4) and (columns, 4) int arrays
        Indices of the rows and columns of the net on which each sample depends.
    functions_r : (k, d, rows, 4) array
    functions_q : (l, columns, 4) array
    orders : (m, 2) int array
        Indices of the functions of r and of q whose product gives each field.
    """
    rows, columns = len(support_r), len(support_q)
    fields = np.empty((len(orders), len(net), rows, columns))
    for m in range(len(orders)):
        by_r, by_q = functions_r[orders[m, 0]], functions_q[orders[m, 1]]
        for c in range(len(net)):
            for row in range(rows):
                line = np.zeros(net.shape[2])
                for i in range(4):
                    weight, at = by_r[c, row, i], net[c, support_r[row, i]]
                    for k in range(len(line)):
                        line[k] += weight * at[k]
                for column in range(columns):
                    value = 0.0
                    for j in range(4):
                        value += by_q[column, j] * line[support_q[column, j]]
                    fields[m, c, row, column] = value
    return fields
