"""Factorisations of a symmetric matrix that is given by its upper triangle."""

from unittest.mock import Mock

import numpy as np
import pytest
from scipy import sparse

from pneumorph.errors import ComputationError
from pneumorph.mechanics.assembly.linear import NO_MEMORY, Pardiso, SingularMatrix, SuperLU, build_factorisation

SIZE = 40


def symmetric(negative: int) -> sparse.csr_array:
    """A matrix with so many negative eigenvalues."""
    rng = np.random.default_rng(1)
    entries = np.where(rng.random((SIZE, SIZE)) < 0.1, rng.normal(size=(SIZE, SIZE)), 0.0)
    lower = sparse.csr_array(np.tril(entries, -1) + np.identity(SIZE))
    signs = np.where(np.arange(SIZE) < negative, -1.0, 1.0) * rng.uniform(1.0, 2.0, SIZE)
    return sparse.csr_array(lower @ sparse.diags(signs) @ lower.T)


@pytest.fixture(params=["fastest", "scipy"])
def build(request):
    return SuperLU if request.param == "scipy" else build_factorisation


@pytest.mark.parametrize("negative", [0, 3])
@pytest.mark.parametrize("columns", [(), (1,), (3,)])
def test_it_solves_and_counts_negative_pivots(build, negative, columns):
    matrix = symmetric(negative)
    upper = sparse.csr_array(sparse.triu(matrix))
    upper.sort_indices()
    factor = build(upper.indptr, upper.indices)
    rhs = np.random.default_rng(0).normal(size=(SIZE, *columns))
    for scale in (1.0, 2.0):
        factor.refactorise(scale * upper.data)
        assert factor.negative_pivots == negative
        x = factor.solve(rhs)
        assert x.shape == rhs.shape
        np.testing.assert_allclose(scale * (matrix @ x), rhs, atol=1e-9)


@pytest.mark.parametrize(("number", "error"), [(NO_MEMORY, ComputationError), (-4, SingularMatrix)])
def test_what_the_library_says_is_told(number, error, monkeypatch):
    pytest.importorskip("pypardiso", reason="pypardiso is not installed", exc_type=ImportError)
    factor = Pardiso(np.array([0, 1, 2]), np.array([0, 1]))
    failing = Mock(side_effect=factor._error(number))
    monkeypatch.setattr(factor._solver, "_call_pardiso", failing)
    with pytest.raises(error, match=r"mesh\.size" if number == NO_MEMORY else "-4"):
        factor.refactorise(np.ones(2))
    # It is called once more where the memory is freed.
    monkeypatch.undo()
