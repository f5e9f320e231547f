"""Solutions by the factorisation of a matrix nearby, definite or not, and how far that is told to be."""

import numpy as np
import pytest

from pneumorph.mechanics.assembly.krylov import conjugate_gradients, minimal_residuals

SIZE = 40


def system(negative, far):
    """A matrix with so many negative eigenvalues, one near it of which K = M (1 ± far), and a right-hand side."""
    random = np.random.default_rng(0)
    turn = np.linalg.qr(random.standard_normal((SIZE, SIZE)))[0]
    values = np.geomspace(1.0, 100.0, SIZE) * np.where(np.arange(SIZE) < negative, -1.0, 1.0)
    near = (turn * values) @ turn.T
    apart = (turn * (values * (1.0 + far * np.linspace(-1.0, 1.0, SIZE)))) @ turn.T
    return apart, near, random.standard_normal(SIZE)


METHODS = [(conjugate_gradients, 0), (minimal_residuals, 0), (minimal_residuals, 7)]


@pytest.mark.parametrize(("method", "negative"), METHODS)
def test_a_few_products_make_up_for_the_difference(method, negative):
    K, M, b = system(negative, 0.1)
    found = method(lambda x: K @ x, lambda r: np.linalg.solve(M, r), b, 1e-6, 8)
    exact = np.linalg.solve(K, b)
    assert found.converged
    assert np.linalg.norm(found.x - exact) < 1e-5 * np.linalg.norm(exact)
    assert 0.05 < found.spread <= 0.1 + 1e-9


@pytest.mark.parametrize("method", [conjugate_gradients, minimal_residuals])
def test_what_is_too_far_does_not_converge(method):
    K, M, b = system(0, 0.9)
    found = method(lambda x: K @ x, lambda r: np.linalg.solve(M, r), b, 1e-6, 4)
    assert not found.converged and found.spread > 0.5


def test_the_matrix_itself_takes_one_product():
    K, _, b = system(7, 0.0)
    found = minimal_residuals(lambda x: K @ x, lambda r: np.linalg.solve(K, r), b, 1e-9, 1)
    assert found.converged and found.spread < 1e-9
    np.testing.assert_allclose(K @ found.x, b, atol=1e-9)
    nothing = minimal_residuals(lambda x: K @ x, lambda r: np.linalg.solve(K, r), 0.0 * b, 1e-9, 1)
    assert nothing.converged and not nothing.x.any()
