"""Factorisation of the symmetric tangent: MKL PARDISO where there is one, SuperLU of SciPy elsewhere."""

from __future__ import annotations

import os
import sys
import weakref
from pathlib import Path
from typing import Protocol

import numpy as np
from scipy import sparse
from scipy.sparse.linalg import splu

from pneumorph.errors import ComputationError
from pneumorph.mechanics.assembly.ordering import Reordered
from pneumorph.mechanics.assembly.pattern import Pattern

SYMMETRIC_INDEFINITE = -2
"""PARDISO's number of this type of matrix, real."""

NO_MEMORY = -2
"""Its error where there is not enough memory."""

IPARM = {1: 1, 2: 2, 8: 0, 10: 8}
"""PARDISO's parameters: its defaults (nested dissection, pivots perturbed below 1e-8), but iterative refinement only
where pivots were perturbed, which makes a back-solve 2.6 times as fast."""

ORDER, PIVOTS = 5, 21
"""Numbers of its parameters for an order that is given, and for pivots of two unknowns (Bunch & Kaufman 1977)."""


class Factorisation(Protocol):
    """A factorised symmetric matrix."""

    @property
    def negative_pivots(self) -> int: ...

    def refactorise(self, data: np.ndarray) -> None:
        """Factorise other values in the same pattern."""
        ...

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        """Solve for a right-hand side (n,), or for several (n, k)."""
        ...


class SingularMatrix(ArithmeticError):
    """The matrix could not be factorised."""


class TooCostly(ArithmeticError):
    """No more factorisations are allowed."""


class Pardiso:
    """LDLᵀ by MKL PARDISO; the symbolic analysis is done once per pattern.

    Parameters
    ----------
    indptr, indices : CSR arrays of the upper triangle.
    ordered : bool
        Whether the unknowns are to be eliminated in the order that they have.
    """

    def __init__(self, indptr: np.ndarray, indices: np.ndarray, ordered: bool = False):
        _find_mkl()
        # Imported here because machines without MKL raise ImportError, some of them only when the solver is made.
        import pypardiso

        self._solver = pypardiso.PyPardisoSolver(mtype=SYMMETRIC_INDEFINITE)
        # Without this variable it searches the whole environment for MKL each time, which takes a quarter of a second.
        if self._solver.libmkl is not None:
            os.environ.setdefault("PYPARDISO_MKL_RT", self._solver.libmkl._name)
        for number, value in IPARM.items():
            self._solver.set_iparm(number, value)
        if ordered:
            self._solver.set_iparm(ORDER, 1)
            self._solver.perm = np.arange(1, len(indptr), dtype=np.int32)
        self._error = pypardiso.pardiso_wrapper.PyPardisoError
        self.negative_pivots = 0
        size = len(indptr) - 1
        self._matrix = sparse.csr_matrix((np.zeros(len(indices)), indices, indptr), shape=(size, size))
        self._zero = np.zeros((size, 1))
        # The symbolic analysis needs the pattern alone.
        self._call(11, self._zero)
        weakref.finalize(self, self._solver.free_memory, everything=True).atexit = False

    def _call(self, phase: int, rhs: np.ndarray) -> np.ndarray:
        self._solver.set_phase(phase)
        try:
            return self._solver._call_pardiso(self._matrix, rhs)
        except self._error as error:
            if error.value == NO_MEMORY:
                why = "the mesh has too many elements for the memory that there is; make mesh.size larger"
                raise ComputationError(why) from error
            raise SingularMatrix(str(error)) from error

    def refactorise(self, data: np.ndarray) -> None:
        self._matrix.data[:] = data
        # Pivots of one unknown are 3 to 10 % faster. They do not serve where a pressure has no diagonal entry.
        self._solver.set_iparm(PIVOTS, int((data[self._matrix.indptr[:-1]] <= 0.0).any()))
        self._call(22, self._zero)
        self.negative_pivots = int(self._solver.get_iparm(23))

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        return self._call(33, np.asfortranarray(rhs.reshape(len(rhs), -1), dtype=float)).reshape(rhs.shape)


def _find_mkl() -> None:
    """Tell pypardiso where packages put MKL: else it searches the whole environment, which takes seconds."""
    places = [*Path(sys.prefix, "lib").glob("libmkl_rt.so*"), *Path(sys.prefix, "Library", "bin").glob("mkl_rt*.dll")]
    if places:
        os.environ.setdefault("PYPARDISO_MKL_RT", str(min(places)))


class SuperLU:
    """LU by SciPy's SuperLU, for machines without MKL.

    Parameters
    ----------
    indptr, indices, ordered
        As `Pardiso` has them.
    """

    def __init__(self, indptr: np.ndarray, indices: np.ndarray, ordered: bool = False):
        self.negative_pivots = 0
        self._order = "NATURAL" if ordered else "MMD_AT_PLUS_A"
        size = len(indptr) - 1
        self._upper = sparse.csr_matrix((np.zeros(len(indices)), indices, indptr), shape=(size, size))
        self._factor = None

    def refactorise(self, data: np.ndarray) -> None:
        self._upper.data[:] = data
        full = (self._upper + sparse.triu(self._upper, 1).T).tocsc()
        try:
            # Diagonal pivots keep the symmetric order, so the signs of U's diagonal are those of the pivots.
            self._factor = splu(full, permc_spec=self._order, diag_pivot_thresh=0.0, options={"SymmetricMode": True})
        except RuntimeError as error:
            raise SingularMatrix(str(error)) from error
        self.negative_pivots = int(np.count_nonzero(self._factor.U.diagonal() < 0))

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        if self._factor is None:
            raise SingularMatrix("nothing is factorised yet")
        return self._factor.solve(rhs)


class Dissected:
    """A factorisation in the order by nested dissection, of a matrix in any other."""

    def __init__(self, factor: Factorisation, reordered: Reordered):
        self._factor, self._order, self._entries = factor, reordered.order, reordered.entries

    @property
    def negative_pivots(self) -> int:
        return self._factor.negative_pivots

    def refactorise(self, data: np.ndarray) -> None:
        self._factor.refactorise(data[self._entries])

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        solution = np.empty(rhs.shape)
        solution[self._order] = self._factor.solve(rhs[self._order])
        return solution


def build_factorisation(pattern: Pattern) -> Factorisation:
    """The fastest solver on this machine, for an upper triangle with this pattern."""
    reordered = pattern.reordered
    if reordered is None:
        return _solver(pattern.indptr, pattern.indices, ordered=False)
    return Dissected(_solver(reordered.indptr, reordered.indices, ordered=True), reordered)


def _solver(indptr: np.ndarray, indices: np.ndarray, ordered: bool) -> Factorisation:
    try:
        return Pardiso(indptr, indices, ordered)
    except ImportError:
        return SuperLU(indptr, indices, ordered)
