"""Quadratic programs of smooth steps: analytic solutions, the conditions of Karush, Kuhn and Tucker, rows' units."""

from dataclasses import dataclass, replace
from typing import Any, cast

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import sparse

from pneumorph.optimize.primal_dual import Ending, Pair, Program, improved
from pneumorph.optimize.smoothing import Smoothing

BALANCE = 3.0


@dataclass(frozen=True, eq=False)
class Matrix:
    """A smoothing by any matrix (n, n)."""

    of: np.ndarray

    def apply(self, z: np.ndarray) -> np.ndarray:
        return self.of @ z

    def transpose(self, g: np.ndarray) -> np.ndarray:
        return self.of.T @ g

    @property
    def moduli(self) -> "Matrix":
        return Matrix(np.abs(self.of))


@dataclass(frozen=True, eq=False)
class Counting(Matrix):
    """One that counts how often it is applied, once in each iteration."""

    applied: list[np.ndarray]

    def apply(self, z: np.ndarray) -> np.ndarray:
        self.applied.append(z)
        return super().apply(z)


def program(slope: Any, rows: Any, known: Any, pull: float = 0.0, factors: Any = None, smooth: Any = None) -> Program:
    """A program in the box |z| ≤ 1."""
    n = len(slope)
    smoothing = cast(Smoothing, Matrix(np.eye(n) if smooth is None else smooth))
    bent = np.zeros((0, n)) if factors is None else np.asarray(factors, float)
    jacobian, ones = sparse.csr_array(np.asarray(rows, float).reshape(-1, n)), np.ones(n)
    return Program(smoothing, np.asarray(slope, float), bent, pull, jacobian, np.asarray(known, float), -ones, ones)


def at_rest(of: Program) -> Pair:
    return Pair(np.zeros(len(of.slope)), np.zeros(len(of.known)), np.zeros(len(of.factors)))


def solved(of: Program, begin: Pair | None = None, iterations: int = 20_000) -> Pair:
    return improved(of, at_rest(of) if begin is None else begin, BALANCE, Ending(iterations, 1e-10))


def drawn(seed: int) -> Program:
    """A random program that z = 0 satisfies, whose rows have lengths between 0.03 and 30."""
    rng = np.random.default_rng(seed)
    n, m = 30, 20
    jacobian = sparse.random_array((m, n), density=0.2, rng=rng).toarray() * 10.0 ** rng.uniform(-1.5, 1.5, (m, 1))
    root = rng.standard_normal((n, n)) / n
    smooth = np.linalg.inv(np.eye(n) + root @ root.T)
    known = -rng.uniform(0.0, 0.5, m) * np.abs(jacobian).sum(axis=1)
    return program(rng.standard_normal(n), jacobian, known, 0.25, rng.standard_normal((2, n)) / n, smooth)


def test_a_row_shares_a_step_as_its_derivatives_ask():
    """min −2 z₀ − z₁ under z₀ + z₁ ≤ 1: z₀ fills the box, z₁ stays, and the row's multiplier is the slope of z₁."""
    found = solved(program([-2.0, -1.0], [[1.0, 1.0]], [-1.0]))
    assert found.z == pytest.approx([1.0, 0.0], abs=1e-6)
    assert found.multiplier == pytest.approx([1.0], abs=1e-6)


def test_known_curvature_stops_a_step():
    """−z + ½ (2 z)² is least at a quarter; with a pull of 4 at an eighth."""
    assert solved(program([-1.0], [], [], 0.0, [[2.0]])).z == pytest.approx([0.25], abs=1e-6)
    assert solved(program([-1.0], [], [], 4.0, [[2.0]])).z == pytest.approx([0.125], abs=1e-6)


def test_without_rows_steps_fill_the_box():
    found = solved(program([-1.0, 2.0, -0.5], [], []))
    assert found.z == pytest.approx([1.0, -1.0, 1.0])


@settings(max_examples=20, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_solutions_meet_the_conditions_of_optimality(seed):
    of = drawn(seed)
    found = solved(of)
    smooth, jacobian = of.smooth, of.jacobian
    step = smooth.apply(found.z)
    slope = of.slope + of.factors.T @ (of.factors @ step) + jacobian.T @ found.multiplier
    downhill = found.z - (smooth.transpose(slope) + of.pull * found.z)
    assert np.abs(np.clip(downhill, of.lower, of.upper) - found.z).max() < 1e-5
    left = (of.known + jacobian @ step) / np.linalg.norm(jacobian.toarray(), axis=1).clip(1e-9)
    assert left.max() < 1e-5
    assert found.multiplier.min() >= 0.0
    assert np.abs(found.multiplier * (of.known + jacobian @ step)).max() < 1e-4
    assert found.bent == pytest.approx(of.factors @ step, abs=1e-5)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_the_answer_does_not_depend_on_where_it_begins(seed):
    of, rng = drawn(seed), np.random.default_rng(seed + 1)
    cold = solved(of)
    warm = solved(of, Pair(rng.uniform(-1, 1, len(of.slope)), rng.uniform(0, 3, len(of.known)), np.ones(2)))
    assert warm.z == pytest.approx(cold.z, abs=1e-4)
    # From the solution nothing moves.
    assert solved(of, cold, 1).z == pytest.approx(cold.z, abs=1e-6)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_units_of_rows_do_not_matter(seed):
    """The same iterates, not only the same solution, with multipliers in the units of the rows."""
    of = drawn(seed)
    units = 10.0 ** np.random.default_rng(seed).uniform(-3, 3, len(of.known))
    other = replace(of, jacobian=sparse.csr_array(sparse.diags_array(units) @ of.jacobian), known=units * of.known)
    some, same = improved(of, at_rest(of), BALANCE, Ending(30)), improved(other, at_rest(other), BALANCE, Ending(30))
    assert same.z == pytest.approx(some.z, abs=1e-8)
    assert same.multiplier * units == pytest.approx(some.multiplier, abs=1e-8)


def test_rows_that_exclude_each_other_are_missed_by_as_much():
    """z₀ ≥ 0.6 and z₀ ≤ 0.2 at once: z₀ comes to rest between them, and what they do not touch is solved."""
    found = solved(program([0.0, -1.0], [[-1.0, 0.0], [1.0, 0.0]], [0.6, -0.2]), iterations=300)
    assert np.isfinite(found.z).all() and np.isfinite(found.multiplier).all()
    assert 0.15 < found.z[0] < 0.65
    assert found.z[1] == pytest.approx(1.0)


def test_an_empty_row_changes_nothing():
    """Such as one of a limit that no variable moves."""
    of = drawn(3)
    more = replace(
        of,
        jacobian=sparse.csr_array(sparse.vstack([of.jacobian, sparse.csr_array((1, len(of.slope)))])),
        known=np.append(of.known, -1.0),
    )
    assert solved(more).z == pytest.approx(solved(of).z, abs=1e-6)


@settings(max_examples=10, deadline=None)
@given(seed=st.integers(0, 10_000))
def test_iterations_end_once_rows_are_met_as_asked(seed):
    """The finer the later: to a tenth of their lengths, or to a hundredth; what is asked is met nearly."""
    of, needed = drawn(seed), []
    length = np.linalg.norm(of.jacobian.toarray(), axis=1)
    for share in (0.1, 0.01):
        met, counted = share * length, replace(of, smooth=cast(Smoothing, Counting(cast(Matrix, of.smooth).of, [])))
        ended = improved(counted, at_rest(of), BALANCE, Ending(20_000, steady=np.inf, met=met))
        assert (of.known + of.jacobian @ of.smooth.apply(ended.z) <= 10 * met + 1e-12).all()
        needed.append(len(cast(Counting, counted.smooth).applied))
    assert needed[0] <= needed[1] < 20_000
