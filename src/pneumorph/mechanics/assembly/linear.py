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

SYMMETRIC_INDEFINITE = -2
"""PARDISO's number of this type of matrix, real."""

NO_MEMORY = -2
"""Its error where there is not enough memory."""

IPARM = {1: 1, 2: 2, 8: 0, 10: 8, 21: 1}
"""PARDISO's parameters: its defaults (nested dissection, Bunch–Kaufman pivots, perturbed below 1e-8), but iterative
refinement only where pivots were perturbed, which makes a back-solve 2.6 times as fast."""


class Factorisation(Protocol):
    """A factorised symmetric matrix."""

    negative_pivots: int

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
    """LDLᵀ by MKL PARDISO; the symbolic analysis is done once per pattern."""

    def __init__(self, indptr: np.ndarray, indices: np.ndarray):
        _find_mkl()
        # Imported here because machines without MKL raise ImportError, some of them only when the solver is made.
        import pypardiso

        self._solver = pypardiso.PyPardisoSolver(mtype=SYMMETRIC_INDEFINITE)
        # Without this variable it searches the whole environment for MKL each time, which takes a quarter of a second.
        if self._solver.libmkl is not None:
            os.environ.setdefault("PYPARDISO_MKL_RT", self._solver.libmkl._name)
        for number, value in IPARM.items():
            self._solver.set_iparm(number, value)
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
    """LU by SciPy's SuperLU, for machines without MKL."""

    def __init__(self, indptr: np.ndarray, indices: np.ndarray):
        self.negative_pivots = 0
        size = len(indptr) - 1
        self._upper = sparse.csr_matrix((np.zeros(len(indices)), indices, indptr), shape=(size, size))
        self._factor = None

    def refactorise(self, data: np.ndarray) -> None:
        self._upper.data[:] = data
        full = (self._upper + sparse.triu(self._upper, 1).T).tocsc()
        try:
            # Diagonal pivots keep the symmetric order, so the signs of U's diagonal are those of the pivots.
            self._factor = splu(
                full, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options={"SymmetricMode": True}
            )
        except RuntimeError as error:
            raise SingularMatrix(str(error)) from error
        self.negative_pivots = int(np.count_nonzero(self._factor.U.diagonal() < 0))

    def solve(self, rhs: np.ndarray) -> np.ndarray:
        if self._factor is None:
            raise SingularMatrix("nothing is factorised yet")
        return self._factor.solve(rhs)


def build_factorisation(indptr: np.ndarray, indices: np.ndarray) -> Factorisation:
    """The fastest solver on this machine, for an upper triangle in CSR form."""
    try:
        return Pardiso(indptr, indices)
    except ImportError:
        return SuperLU(indptr, indices)
