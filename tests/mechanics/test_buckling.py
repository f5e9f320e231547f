"""Through losses of stability: rings under external pressure against the elastica, and what comes after a limit point.

A ring of bending stiffness E'I per length and radius R buckles at p R³ = 3 E'I (Lévy 1884); beyond it its shape is that
of the elastica, whose opposite sides touch at p R³ = 5.247 E'I (Tadjbakhsh and Odeh 1967).
"""

import numpy as np
import pytest
from scipy.integrate import solve_bvp

from pneumorph.mechanics import Equilibrium, Tangent, build_loads, build_model, configure, neo_hookean_rubber, sweep
from pneumorph.verify.solids import tube, with_lids

RADIUS, THICKNESS, LENGTH = 10.0, 1.0, 2.0
SHEAR, BULK = 0.3, 3.0


def elastica(narrow: float) -> tuple[float, float]:
    """The load p R³/E'I at which the shorter semi-axis of a ring is that, and the longer one, in multiples of R."""

    def along(s, y, load):
        _, _, angle, moment, tension, shear = y
        bend = 1.0 + moment
        return np.array([np.cos(angle), np.sin(angle), bend, -shear, shear * bend, -tension * bend - load[0]])

    def ends(a, b, load):
        return np.array([a[1], a[2] - np.pi / 2, a[5], b[0], b[1] - narrow, b[2] - np.pi, b[5]])

    s, size = np.linspace(0.0, np.pi / 2, 61), 1.0 - narrow
    bend = 3 * size * np.cos(2 * s)
    guess = [(1 + size / 2) * np.cos(s), narrow * np.sin(s), np.pi / 2 + s, bend, -3.0 + 0 * s, 0 * s]
    found = solve_bvp(along, ends, s, np.array(guess), p=[3.0 + 2 * size], tol=1e-8, max_nodes=20000)
    assert found.success
    return float(found.p[0]), float(found.y[0, 0])


def test_the_elastica_touches_at_the_known_pressure():
    assert elastica(0.0)[0] == pytest.approx(5.247, abs=1e-3)
    assert elastica(0.99)[0] == pytest.approx(3.0, abs=1e-3)


def ring(mixed, cells=32):
    """A ring in plane strain, symmetric about the planes xz and yz."""
    mesh, lid = with_lids(tube(RADIUS - THICKNESS / 2, RADIUS + THICKNESS / 2, LENGTH, (1, cells, 1)), LENGTH)
    held = (np.abs(mesh.points) < 1e-6) | lid[:, None]
    held[:, 2] = True
    return mesh, build_model(mesh, neo_hookean_rubber(SHEAR, BULK, 1.1e-9), plate=False, supports=held, mixed=mixed)


def critical() -> float:
    """The pressure in MPa. That it acts on the inner surface adds a constant tension to the ring, without effect."""
    young = 9 * BULK * SHEAR / (3 * BULK + SHEAR)
    poisson = (3 * BULK - 2 * SHEAR) / (2 * (3 * BULK + SHEAR))
    stiffness = young / (1 - poisson**2) * THICKNESS**3 / 12
    return 3 * stiffness / RADIUS**3


# Plain elements are stiffer in bending, here by 4 %.
@pytest.mark.parametrize(("mixed", "error"), [(False, 0.05), (True, 0.015)])
def test_a_ring_under_vacuum_buckles_and_follows_the_elastica(mixed, error):
    mesh, model = ring(mixed)
    loads = (0.6, 1.1, 1.15)
    path = [configure(model, mesh.points, build_loads(model, {"A": -each * critical()})) for each in loads]
    found = list(sweep(path, Tangent(model)))
    assert all(isinstance(each, Equilibrium) and each.stable for each in found)
    assert [bool(each.buckled) for each in found] == [False, True, False]
    assert found[1].buckled["A"] == pytest.approx(-critical(), rel=error)
    middle = np.abs(np.linalg.norm(mesh.points[:, :2], axis=1) - RADIUS) < 1e-6
    for load, each in zip(loads[1:], found[1:], strict=True):
        narrow, wide = sorted(np.abs(mesh.points + each.u)[middle, :2].max(axis=0) / RADIUS)
        known, longer = elastica(narrow)
        assert 3 * load == pytest.approx(known, rel=error)
        assert wide == pytest.approx(longer, abs=0.01)
        assert narrow < 0.75


def test_the_states_beyond_do_not_depend_on_the_steps_of_the_sweep():
    mesh, model = ring(True, 24)

    def states(*loads):
        path = [configure(model, mesh.points, build_loads(model, {"A": -each * critical()})) for each in loads]
        return list(sweep(path, Tangent(model)))

    # The body relaxes beyond 1.01: the way to that load goes back. In one step from rest it is passed.
    fine, coarse = states(0.9, 1.01, 1.1), states(1.1)
    assert all(isinstance(each, Equilibrium) and each.stable for each in fine + coarse)
    assert [bool(each.buckled) for each in fine + coarse] == [False, True, False, True]
    assert fine[-1].volumes["A"] == pytest.approx(coarse[-1].volumes["A"], rel=1e-6)
    assert fine[1].buckled["A"] == pytest.approx(coarse[0].buckled["A"], rel=0.01)
    assert fine[0].volumes["A"] > 1.005 * fine[1].volumes["A"] > 1.05 * fine[2].volumes["A"]
