"""The sparsity of a factorised tangent, to which contact adds entries and from which it takes some again."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from types import EllipsisType

import numpy as np

from pneumorph.mechanics.assembly.ordering import Reordered, dissected


@dataclass(frozen=True, eq=False)
class Pattern:
    """A sparsity of the tangent that has all entries of its terms, and may have more.

    Attributes
    ----------
    indptr, indices : CSR arrays of the upper triangle.
    base : (nnz of the terms,) int, or ...
        Which entries are those of the terms.
    """

    indptr: np.ndarray
    indices: np.ndarray
    base: np.ndarray | EllipsisType = ...

    @cached_property
    def keys(self) -> np.ndarray:
        """row·n + column of every entry, ascending."""
        size = len(self.indptr) - 1
        return np.repeat(size * np.arange(size, dtype=np.int64), np.diff(self.indptr)) + self.indices

    @cached_property
    def reordered(self) -> Reordered | None:
        """The same in the order by nested dissection; None without METIS."""
        return dissected(self.indptr, self.indices)

    def has(self, keys: np.ndarray) -> bool:
        """Whether it has all these entries."""
        places = np.searchsorted(self.keys, keys).clip(max=len(self.keys) - 1)
        return bool(np.array_equal(self.keys[places], keys))

    def joined(self, more: np.ndarray) -> Pattern:
        """The pattern with more entries, by their keys."""
        new, size = np.sort(more[~np.isin(more, self.keys, assume_unique=True, kind="sort")]), len(self.indptr) - 1
        keys = np.insert(self.keys, np.searchsorted(self.keys, new), new)
        indptr = np.searchsorted(keys, size * np.arange(size + 1, dtype=np.int64)).astype(np.int32)
        return Pattern(indptr, (keys % size).astype(np.int32), np.searchsorted(keys, self.keys)[self.base])
