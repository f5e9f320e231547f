"""Thick tube and sphere against radial boundary-value problems solved to 1e-8, and elasticity's small-load limits."""

import numpy as np
import pytest

from pneumorph.mechanics import Tangent, build_loads, build_model, configure, neo_hookean_rubber, solve
from pneumorph.verify.solids import octant, tube, with_lids

RUBBER = neo_hookean_rubber(0.49, 4.80, 1.1e-9)


def inflate(mesh, supports, pressure, plate=False):
    built = build_model(mesh, RUBBER, plate=plate, supports=supports)
    found = solve(configure(built, mesh.points, build_loads(built, {"A": pressure})), Tangent(built))
    assert found.residual <= 1e-9
    assert found.stable
    return found


def radial(mesh, u, radius, axes):
    distance = np.linalg.norm(mesh.points[:, axes], axis=1)
    on = np.abs(distance - radius) < 1e-6
    return (np.sum(u[on][:, axes] * mesh.points[on][:, axes], axis=1) / radius).mean()


@pytest.mark.parametrize(("counts", "error"), [((2, 4, 4), 2e-3), ((4, 8, 8), 1e-4)])
def test_thick_sphere(counts, error):
    mesh = octant(10, 12, counts)
    u = inflate(mesh, np.abs(mesh.points) < 1e-9, 0.02).u
    axes = [0, 1, 2]
    assert radial(mesh, u, 10, axes) == pytest.approx(0.28719543, rel=error)
    assert radial(mesh, u, 12, axes) == pytest.approx(0.21189583, rel=error)


@pytest.mark.parametrize(("counts", "error"), [((2, 12, 1), 5e-3), ((4, 24, 1), 5e-4)])
def test_plane_strain_tube(counts, error):
    mesh, lids = with_lids(tube(4, 8, 2, counts), 2)
    # Plane strain: no motion along z anywhere; two points on axes stop the rigid motions of the section.
    supports = np.zeros((len(mesh.points), 3), bool)
    supports[:, 2] = True
    supports[lids] = True
    supports[np.abs(mesh.points[:, 1]) < 1e-9, 1] = True
    supports[np.abs(mesh.points[:, 0]) < 1e-9, 0] = True
    u = inflate(mesh, supports, 0.10).u
    assert radial(mesh, u, 4, [0, 1]) == pytest.approx(0.69981819, rel=error)
    assert radial(mesh, u, 8, [0, 1]) == pytest.approx(0.39689806, rel=error)


def test_a_bar_on_a_small_dead_force_stretches_as_young_says():
    mesh = tube(4, 8, 60, (1, 8, 12))
    built = build_model(mesh, RUBBER)
    force = 1e-4
    wrench = np.array([0, 0, force, 0, 0, 0])
    found = solve(configure(built, mesh.points, build_loads(built, {}, wrench=wrench)), Tangent(built))
    young = 9 * 4.80 * 0.49 / (3 * 4.80 + 0.49)
    expected = force * 60 / (young * np.pi * (8**2 - 4**2))
    # The clamped ends hinder the contraction, over about a diameter each.
    assert found.plate[2] == pytest.approx(expected, rel=0.05)


def test_a_slender_tube_under_a_small_moment_bends_and_twists_as_beams_do():
    mesh = tube(4, 5, 100, (1, 12, 20))
    built = build_model(mesh, RUBBER)
    moment = 1e-3
    young = 9 * 4.80 * 0.49 / (3 * 4.80 + 0.49)
    second = np.pi / 4 * (5**4 - 4**4)
    wrench = np.array([0, 0, 0, 0, moment, moment])
    found = solve(configure(built, mesh.points, build_loads(built, {}, wrench=wrench)), Tangent(built))
    assert found.plate[4] == pytest.approx(moment * 100 / (young * second), rel=0.03)
    assert found.plate[5] == pytest.approx(moment * 100 / (0.49 * 2 * second), rel=0.01)
