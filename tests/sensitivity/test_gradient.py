"""The adjoint gradient by Taylor tests, and the paper's boundary formula against it."""

import jax.numpy as jnp
import numpy as np
import pytest

from pneumorph.mechanics import Tangent, build_loads, build_model, configure, neo_hookean_rubber, solve
from pneumorph.objective import Objective, equidistant, match
from pneumorph.sensitivity import boundary_gradient, gradient, residual_jacobian, taylor_test
from pneumorph.verify.solids import tube

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)
SILICONE = neo_hookean_rubber(0.49, 4.9e3, 1.1e-9)


def everything(f):
    """A function of every feature there is."""
    sections = jnp.sum(f.section_rotation[:, 0, 2]) + 0.1 * f.section_rotation[1, 0, 1] + f.section_position[2, 0]
    return (
        0.1 * f.translation[2] + f.rotation[1] ** 2 + f.translation[0] + f.rotation[2] + sections + 1e-4 * f.volume["A"]
    )


def motion(f):
    """A function of the plate's motion alone, as the paper's formula has it."""
    return 0.01 * f.translation[2] + f.rotation[1] ** 2 + f.translation[0] + f.rotation[2]


JUDGE, JUDGE_MOTION = Objective(everything, equidistant(3, 30.0)), Objective(motion)


class Case:
    """A tube under pressure, weight, springs, force and moment; its nodes move along a smooth direction."""

    def __init__(self, counts, plate=True, mixed=False):
        self.mesh = tube(4, 8, 30, counts)
        self.model = build_model(self.mesh, SILICONE if mixed else RUBBER, plate=plate, mixed=mixed)
        x, y, z = self.mesh.points.T
        self.motion = np.column_stack(
            [
                np.sin(z / 7) * x / 8,
                np.cos(z / 5) * y / 8 + 0.05 * np.sin(z / 9),
                0.3 * np.sin(x / 3 + 0.5) * np.sin(np.pi * z / 30),
            ]
        )
        self.plate = plate

    def solve(self, step=0.0, pressure=0.05, start=None):
        points = self.mesh.points + step * self.motion
        carried = {"spring": np.array([0, 0, 0.5, 0, 20, 0]), "wrench": np.array([0.05, 0, 0, 0, 0, 3.0])}
        acting = build_loads(self.model, {"A": pressure}, np.array([9810.0, 0, 0]), **(carried if self.plate else {}))
        at, solver = configure(self.model, points, acting), Tangent(self.model)
        return at, solver, solve(at, solver, start)

    def value(self, step, pressure, start):
        at, _, found = self.solve(step, pressure, start)
        return float(JUDGE.at(self.model, at.X, found.state))


@pytest.mark.parametrize(("plate", "mixed"), [(True, False), (False, False), (True, True)])
def test_gradient_by_nodes_and_pressure(plate, mixed):
    case = Case((1, 8, 6), plate, mixed)
    at, solver, found = case.solve()
    slope = gradient(at, solver, found, JUDGE)
    along = np.array([np.sum(slope.X * case.motion), slope.pressure["A"]])

    def near(s):
        return case.value(s[0], 0.05 + s[1], found.state)

    for direction in (np.array([1.0, 0.0]), np.array([0.0, 0.01]), np.array([1.0, 0.01])):
        test = taylor_test(near, np.zeros(2), along, direction, step=0.1, count=4)
        assert test.passed, test


@pytest.mark.parametrize(("plate", "mixed"), [(True, False), (False, True)])
def test_the_jacobian_of_residuals(plate, mixed):
    case = Case((1, 8, 6), plate, mixed)
    at, solver, found = case.solve()
    turned = np.broadcast_to(np.eye(3), (3, 3, 3))
    asked = match(equidistant(3, 30.0), np.outer([6.0, 17.0, 29.0], [0, 0, 1.0]), turned, 2.0, 0.03)
    slope, jacobian = gradient(at, solver, found, asked), residual_jacobian(at, solver, found, asked)
    assert slope.value == pytest.approx(float(np.sum(jacobian.residuals**2)))
    assert jacobian.X.shape == (18, len(case.mesh.points), 3)
    np.testing.assert_allclose(
        2 * np.tensordot(jacobian.residuals, jacobian.X, axes=1), slope.X, atol=1e-9 * np.abs(slope.X).max()
    )
    assert 2 * float(jacobian.residuals @ jacobian.pressure[:, 0]) == pytest.approx(slope.pressure["A"], rel=1e-8)


def test_residuals_that_nothing_moves_cost_no_solution():
    case = Case((1, 8, 6))
    at, solver, found = case.solve()
    still = Objective(lambda f: 0.0, residuals=lambda f: jnp.stack([f.translation[2], 3.0 + 0.0 * f.rotation[0]]))
    alone = Objective(lambda f: 0.0, residuals=lambda f: f.translation[2:])
    expected, before = residual_jacobian(at, solver, found, alone), solver.solves
    both = residual_jacobian(at, solver, found, still)
    assert solver.solves == before + 1
    assert both.residuals[1] == 3.0 and not both.X[1].any() and not both.pressure[1].any()
    assert np.array_equal(both.X[0], expected.X[0]) and np.array_equal(both.pressure[0], expected.pressure[0])
    nothing = Objective(lambda f: 0.0, residuals=lambda f: 0.0 * f.rotation)
    assert residual_jacobian(at, solver, found, nothing).X.shape == (3, *at.X.shape)
    assert solver.solves == before + 1


def test_a_wrong_gradient_fails_the_taylor_test():
    test = taylor_test(lambda x: float(np.sum(x**3)), np.ones(2), np.array([3.0, 3.3]), np.array([1.0, 2.0]), 0.1)
    assert not test.passed


@pytest.mark.slow
def test_boundary_formula_tends_to_the_exact_gradient():
    errors = []
    for counts in ((1, 8, 8), (1, 12, 12), (2, 16, 22)):
        case = Case(counts)
        at, solver, found = case.solve()
        exact = gradient(at, solver, found, JUDGE_MOTION)
        boundary = boundary_gradient(at, case.mesh, found, exact.adjoint)
        errors.append(abs(np.sum(boundary * case.motion) / np.sum(exact.X * case.motion) - 1))
    assert errors[2] < errors[1] < errors[0]
    assert errors[2] < 0.5 * errors[0]
