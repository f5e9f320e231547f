"""Tetrahedra and triangles divided at the middle of edges, the longest of each first.

An element whose longest edge is whole is divided there before any other of its edges is (Rivara 1984, International
Journal for Numerical Methods in Engineering 20, 745–756), so that shapes stay about as they were.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy import sparse

from pneumorph.mesh.refine import Parts


@dataclass(frozen=True, eq=False)
class Edges:
    """The edges of a mesh by the keys of their ends, sorted; their middle nodes; which are divided, in which order.

    The `rank` of those that stay whole is −1.
    """

    keys: np.ndarray
    middle: np.ndarray
    rank: np.ndarray
    count: int

    def key(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """The keys of edges by their ends."""
        return np.minimum(one, other) * self.count + np.maximum(one, other)

    def place(self, keys: np.ndarray) -> np.ndarray:
        """Where edges are among these; −1 of others."""
        at = np.minimum(np.searchsorted(self.keys, keys), len(self.keys) - 1)
        return np.where(self.keys[at] == keys, at, -1)

    def ends(self, at: np.ndarray) -> np.ndarray:
        """Both ends (n, 2) of edges."""
        return np.column_stack(np.divmod(self.keys[at], self.count))

    def halved(self) -> np.ndarray:
        """The numbers of those that are divided."""
        return np.flatnonzero(self.rank >= 0)


@dataclass(frozen=True, eq=False)
class Middles:
    """The nodes in the middle of the edges of parts: of whole edges those there were, and new ones after all others.

    Attributes
    ----------
    edges : Edges
        Of the mesh before.
    keys : (n,) int
        Of the edges with new nodes, sorted.
    rows : (n, N) sparse
        From values at the nodes before to those at the new ones, of fields that are quadratic in cells.
    """

    edges: Edges
    keys: np.ndarray
    rows: sparse.csr_array

    def between(self, one: np.ndarray, other: np.ndarray) -> np.ndarray:
        """The nodes in the middle of edges of parts by their ends."""
        keys = self.edges.key(one, other)
        at = self.edges.place(keys)
        return np.where(at >= 0, self.edges.middle[at], self.edges.count + np.searchsorted(self.keys, keys))

    def of(self, corners: np.ndarray, pairs: np.ndarray) -> np.ndarray:
        """The nodes (m, k) in the middle of the edges `pairs` (k, 2) of parts with these corners (m, n)."""
        ends = corners[:, pairs]
        return self.between(ends[..., 0], ends[..., 1])


def middles_of(
    parts: Parts, cells: np.ndarray, pairs: np.ndarray, edges: Edges, shape: Callable[[np.ndarray], np.ndarray]
) -> Middles:
    """The nodes in the middle of the edges of all parts of a mesh.

    Parameters
    ----------
    parts, cells, pairs, edges : see `divided` and `edges_of`.
    shape : of local coordinates (..., d)
        The quadratic shape functions of a cell.
    """
    ends = parts.corners[:, pairs]
    keys = edges.key(ends[..., 0], ends[..., 1])
    part, edge = np.nonzero(edges.place(keys) < 0)
    fresh, first = np.unique(keys[part, edge], return_index=True)
    part, edge = part[first], edge[first]
    weights = shape(parts.local[part[:, None], pairs[edge]].mean(axis=1))
    rows = np.repeat(np.arange(len(fresh)), cells.shape[1])
    new = sparse.csr_array((weights.ravel(), (rows, cells[parts.owner[part]].ravel())), (len(fresh), edges.count))
    new.eliminate_zeros()
    return Middles(edges, fresh, new)


def edges_of(
    cells: np.ndarray, pairs: np.ndarray, points: np.ndarray, tied: tuple[np.ndarray, np.ndarray], middles: np.ndarray
) -> Edges:
    """The edges of a mesh, and which are divided so that parts fit together.

    Parameters
    ----------
    cells : (m, n) int
        Corners, then nodes in the middle of edges.
    pairs : (k, 2) int
        The corners of each edge of a cell.
    points : (N, 3) float
        mm.
    tied : two (n,) int
        Nodes that are images of others, and these: their edges are divided alike.
    middles : (j,) int
        Nodes in the middle of the edges that are to be divided.
    """
    count, corners = len(points), int(pairs.max()) + 1
    ends = np.sort(cells[:, :corners][:, pairs], axis=-1)
    keys, first, of = np.unique((ends[..., 0] * count + ends[..., 1]).ravel(), True, True)
    of, middle = of.reshape(-1, len(pairs)), cells[:, corners:].ravel()[first]
    one, other = np.divmod(keys, count)
    edges = Edges(keys, middle, np.full(len(keys), -1), count)
    nodes, sources = tied
    origin = np.arange(count)
    origin[nodes] = sources
    twin = edges.place(edges.key(origin[one], origin[other]))
    own = np.arange(len(keys))
    twin = np.where(twin >= 0, twin, own)
    length = np.linalg.norm(points[one] - points[other], axis=1)
    order = np.argsort(np.argsort(length, kind="stable"))
    rank = np.argsort(np.lexsort((twin != own, order[twin])))
    longest = of[np.arange(len(of)), rank[of].argmax(axis=1)]
    split = np.isin(middle, middles)
    while True:
        split[longest[split[of].any(axis=1)]] = True
        before = split.sum()
        np.logical_or.at(split, twin, split.copy())
        split |= split[twin]
        if split.sum() == before and split[longest[split[of].any(axis=1)]].all():
            break
    return replace(edges, rank=np.where(split, rank, -1))


def divided(corners: np.ndarray, local: np.ndarray, pairs: np.ndarray, edges: Edges) -> Parts:
    """The parts of simplices, in their order.

    Parameters
    ----------
    corners : (m, k) int
    local : (k, k − 1) float
        Local coordinates of the corners.
    pairs : (n, 2) int
        The corners of each edge of a simplex.
    edges : Edges
    """
    owner, places = np.arange(len(corners)), np.repeat(local[None], len(corners), axis=0)
    while True:
        ends = corners[:, pairs]
        at = edges.place(edges.key(ends[..., 0], ends[..., 1]))
        rank = np.where(at >= 0, edges.rank[at], -1)
        which = rank.argmax(axis=1)
        todo = np.flatnonzero(rank[np.arange(len(rank)), which] >= 0)
        if not len(todo):
            order = np.argsort(owner, kind="stable")
            return Parts(owner[order], corners[order], places[order])
        (i, j), row = pairs[which[todo]].T, np.arange(len(todo))
        halves = []
        for end in (i, j):
            half, at_half = corners[todo], places[todo]
            half[row, end] = edges.middle[at[todo, which[todo]]]
            at_half[row, end] = 0.5 * (places[todo, i] + places[todo, j])
            halves.append((owner[todo], half, at_half))
        rest = np.ones(len(owner), bool)
        rest[todo] = False
        kept = (owner[rest], corners[rest], places[rest])
        owner, corners, places = (np.concatenate(each) for each in zip(kept, *halves, strict=True))
