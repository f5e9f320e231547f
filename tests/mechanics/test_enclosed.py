"""Chambers with a given volume or a sealed gas: spheres through their limit point, stability, gradients."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.optimize import root_scalar

from pneumorph.mechanics import (
    Equilibrium,
    Tangent,
    build_loads,
    build_model,
    configure,
    neo_hookean_rubber,
    rest,
    settled,
    solve,
)
from pneumorph.mechanics.assembly.enclosed import Enclosed
from pneumorph.mechanics.solve.border import negative_motions
from pneumorph.mechanics.solve.filled import Filled, fill
from pneumorph.objective import Objective
from pneumorph.sensitivity import gradient, taylor_test
from pneumorph.verify.incompressible import sphere_pressure
from pneumorph.verify.solids import octant, tube

SHEAR, INNER, OUTER = 0.49, 10.0, 12.0
LIMIT_STRETCH = 1.47016
ATMOSPHERE = 0.101325
FULL = 4 / 3 * np.pi * INNER**3


def liquid(added):
    return Enclosed(("A",), np.array([added]), np.array([False]), np.zeros(1), np.ones(1), np.full(1, ATMOSPHERE))


def gas(filling, exponent=1.0):
    law = np.array([filling]), np.array([exponent]), np.full(1, ATMOSPHERE)
    return Enclosed(("A",), np.zeros(1), np.array([True]), *law)


def closed_form(stretches):
    return SHEAR * sphere_pressure(INNER * np.asarray(stretches), INNER, OUTER)


@pytest.fixture(scope="module")
def sphere():
    """An eighth of a thin incompressible sphere, at rest; its volumes are those of the eighth."""
    mesh = octant(INNER, OUTER, (2, 4, 4))
    rubber = neo_hookean_rubber(SHEAR, 1e5 * SHEAR, 1.1e-9)
    model = build_model(mesh, rubber, plate=False, supports=np.abs(mesh.points) < 1e-9, mixed=True)
    return model, configure(model, mesh.points, build_loads(model, {"A": 0.0}))


def filled(sphere, given, begin=None):
    model, at = sphere
    start = (replace(at, enclosed=given.part(0.0)), rest(model)) if begin is None else (begin.at, begin.state)
    tangent = Tangent(model)
    found = fill(replace(at, enclosed=given), tangent, *start, 1e-8)
    assert isinstance(found, Filled), found
    return found, tangent


def test_the_curve_of_a_sphere_through_its_limit_point(sphere):
    last = None
    pressures, stretches = [], np.array([1.1, 1.3, LIMIT_STRETCH, 1.8, 2.3])
    for stretch in stretches:
        last, tangent = filled(sphere, liquid(FULL / 8 * (stretch**3 - 1.0)), last)
        pressures.append(float(last.at.loads.pressure[0]))
        # At a constant pressure it would balloon beyond the limit point; with a given volume it is stable.
        assert negative_motions(last.at, tangent, last.state) == 0
        if abs(stretch - LIMIT_STRETCH) > 0.1:
            assert negative_motions(replace(last.at, enclosed=None), tangent, last.state) == int(
                stretch > LIMIT_STRETCH
            )
    closed = closed_form(stretches)
    assert np.abs(np.array(pressures) - closed).max() < 5e-4 * closed.max()
    assert np.argmax(pressures) == 2


@pytest.mark.parametrize("exponent", [1.0, 1.4])
def test_gas_expands_a_sphere_as_the_closed_forms_say(sphere, exponent):
    """p(λ) of the shell meets that of the gas, (p₀ + a) λ^(−3γ) − a."""
    filling = 0.35
    found, tangent = filled(sphere, gas(filling, exponent))

    def excess(stretch):
        return (filling + ATMOSPHERE) * stretch ** (-3.0 * exponent) - ATMOSPHERE - closed_form([stretch])[0]

    stretch = root_scalar(excess, bracket=(1.0, 3.0)).root
    assert float(found.at.loads.pressure[0]) == pytest.approx(closed_form([stretch])[0], rel=1e-3)
    assert negative_motions(found.at, tangent, found.state) == 0


RUBBER = {"plain": neo_hookean_rubber(0.49, 4.80, 1.1e-9), "mixed": neo_hookean_rubber(0.49, 490.0, 1.1e-9)}
LAWS = {"liquid": liquid(450.0), "gas": gas(0.04, 1.4)}


def everything(f):
    """Motions of the plate and the volume."""
    return 0.1 * f.translation[2] + f.rotation[1] + 0.2 * f.translation[0] + 1e-3 * f.volume["A"]


@pytest.mark.parametrize("law", LAWS)
@pytest.mark.parametrize("element", RUBBER)
def test_gradients_by_nodes_where_the_pressure_follows(element, law):
    mesh = tube(4, 8, 24, (1, 8, 4))
    model = build_model(mesh, RUBBER[element], mixed=element == "mixed")
    loads = build_loads(model, {}, wrench=np.array([0.1, 0, 0, 0, 0, 1.0]), spring=np.array([0, 0, 0.5, 0, 20.0, 0]))
    x, y, z = mesh.points.T
    motion = np.column_stack([np.sin(z / 7) * x / 8, np.cos(z / 5) * y / 8, 0.3 * np.sin(x / 3 + 0.5) * np.sin(z / 7)])
    judge = Objective(everything)

    def solved(step, start=None):
        at = configure(model, mesh.points + step * motion, loads, enclosed=LAWS[law])
        tangent = Tangent(model)
        found = solve(at, tangent, start)
        assert isinstance(found, Equilibrium), found
        return settled(at, found), tangent, found

    at, tangent, found = solved(0.0)
    assert found.stable and abs(found.enclosed["A"]) > 1e-3
    slope = gradient(at, tangent, found, judge)

    def value(phi):
        there, _, near = solved(float(phi[0]), found.state)
        return judge.at(model, there.X, near.state)

    test = taylor_test(value, np.zeros(1), np.array([np.sum(slope.X * motion)]), np.ones(1), step=0.1, count=4)
    assert abs(test.rates[-1] - 2.0) < 0.02, test
