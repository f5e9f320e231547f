"""Factorisations of a symmetric matrix that is given by its upper triangle."""

import sys
from unittest.mock import Mock

import numpy as np
import pytest
from scipy import sparse

from pneumorph.errors import ComputationError
from pneumorph.mechanics.assembly import linear
from pneumorph.mechanics.assembly.linear import NO_MEMORY, Pardiso, SingularMatrix, SuperLU, build_factorisation
from pneumorph.mechanics.assembly.ordering import dissected
from pneumorph.mechanics.assembly.pattern import Pattern

SIZE = 40


def symmetric(negative: int) -> sparse.csr_array:
    """A matrix with so many negative eigenvalues."""
    rng = np.random.default_rng(1)
    entries = np.where(rng.random((SIZE, SIZE)) < 0.1, rng.normal(size=(SIZE, SIZE)), 0.0)
    lower = sparse.csr_array(np.tril(entries, -1) + np.identity(SIZE))
    signs = np.where(np.arange(SIZE) < negative, -1.0, 1.0) * rng.uniform(1.0, 2.0, SIZE)
    return sparse.csr_array(lower @ sparse.diags(signs) @ lower.T)


@pytest.fixture(params=["fastest", "scipy", "scipy in a better order", "in the solver's own order"])
def build(request, monkeypatch):
    if request.param == "scipy in a better order":
        monkeypatch.setattr(linear, "Pardiso", SuperLU)
    if request.param == "in the solver's own order":
        # As where there is no METIS.
        monkeypatch.setitem(sys.modules, "pymetis", None)
    if request.param == "scipy":
        return SuperLU
    return lambda indptr, indices: build_factorisation(Pattern(indptr, indices))


def upper_of(matrix):
    upper = sparse.csr_array(sparse.triu(matrix))
    upper.sort_indices()
    return upper


@pytest.mark.parametrize("negative", [0, 3])
@pytest.mark.parametrize("columns", [(), (1,), (3,)])
def test_it_solves_and_counts_negative_pivots(build, negative, columns):
    matrix = symmetric(negative)
    upper = upper_of(matrix)
    factor = build(upper.indptr, upper.indices)
    rhs = np.random.default_rng(0).normal(size=(SIZE, *columns))
    for scale in (1.0, 2.0):
        factor.refactorise(scale * upper.data)
        assert factor.negative_pivots == negative
        x = factor.solve(rhs)
        assert x.shape == rhs.shape
        np.testing.assert_allclose(scale * (matrix @ x), rhs, atol=1e-9)


def test_pressures_without_a_diagonal_are_solved(build):
    # Stokes' matrix: as many negative pivots as there are pressures.
    rng, count = np.random.default_rng(2), 12
    stiffness, volumes = symmetric(0), sparse.csr_array(rng.normal(size=(count, SIZE)))
    zero = sparse.csr_array((count, count))
    matrix = sparse.csr_array(sparse.block_array([[stiffness, volumes.T], [volumes, zero]]))
    upper = upper_of(matrix + sparse.diags_array(np.ones(SIZE + count)))
    upper.setdiag(matrix.diagonal())
    factor = build(upper.indptr, upper.indices)
    factor.refactorise(upper.data)
    rhs = rng.normal(size=SIZE + count)
    np.testing.assert_allclose(matrix @ factor.solve(rhs), rhs, atol=1e-9)
    assert factor.negative_pivots == count


def grid(side, unknowns=3):
    """The upper triangle of a matrix of a square grid of nodes with some unknowns each, in random order."""
    path = sparse.csr_array(sum(np.eye(side, k=k) for k in (-1, 0, 1)))
    size = side**2 * unknowns
    linked = sparse.kron(sparse.kron(path, path), np.ones((unknowns, unknowns))) + 30.0 * sparse.eye_array(size)
    mixed = np.random.default_rng(0).permutation(size)
    moved = sparse.csr_array((np.ones(size), mixed, np.arange(size + 1)))
    matrix = moved @ linked @ moved.T
    return upper_of(matrix), mixed // unknowns


def order_of(upper):
    pytest.importorskip("pymetis", reason="pymetis is not installed")
    found = dissected(upper.indptr, upper.indices)
    assert found is not None
    return found


def test_the_order_has_the_same_matrix_and_keeps_the_unknowns_of_a_node_together():
    upper, node = grid(9)
    found = order_of(upper)
    there = sparse.csr_array((upper.data[found.entries], found.indices, found.indptr), shape=upper.shape)
    whole, moved = (each + sparse.triu(each, 1).T for each in (upper, there))
    np.testing.assert_array_equal(moved.toarray(), whole.toarray()[found.order][:, found.order])
    assert np.count_nonzero(np.diff(node[found.order])) == len(np.unique(node)) - 1


def test_factors_grow_as_nested_dissection_says():
    # George (1973): n² log n entries for a grid of n × n nodes, where a band has n³.
    entries = []
    for side in (16, 32, 64):
        upper, _ = grid(side, unknowns=1)
        found = order_of(upper)
        factor = SuperLU(found.indptr, found.indices, ordered=True)
        factor.refactorise(upper.data[found.entries])
        assert factor._factor is not None
        entries.append(factor._factor.L.nnz / (side**2 * np.log2(side)))
    assert max(entries) < 1.5 * min(entries)


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
