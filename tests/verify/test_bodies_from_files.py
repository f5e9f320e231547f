"""Bodies from CAD files against a membrane's differential equations, a closed form, and other solvers."""

import numpy as np
import pytest
from disc import centre_height
from installed import needs
from scipy.optimize import root_scalar
from solids import cylinder, occ, problem, written

import pneumorph as pm
from pneumorph.analysis.bodies import mesh_of
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import Equilibrium, Tangent, configure, loads_of, model_of, neo_hookean_rubber, solve
from pneumorph.mesh.tets import area_and_volume
from pneumorph.problem import load, loads
from pneumorph.verify import calculix, symbolic
from pneumorph.verify.incompressible import radius_at, sphere_pressure
from pneumorph.verify.inflation import inflate
from pneumorph.verify.solids import DENSITY, SHEAR

BULK = 20.0 * SHEAR


def meshed(shape, folder, size, more=""):
    """The mesh of a shape in a STEP file; `more` are lines of its table."""
    written(shape, folder / "body.step")
    asked = loads(problem("body.step", more, size=f"{size} mm"), folder=folder)
    return mesh_of(asked, body_of(asked), ()).mesh


RADIUS = 10.0


def inflated_disc(folder, thickness, size, pressure):
    """The height to which the centre of a disc rises; a quarter of it, clamped around in a can that does not deform."""
    can = cylinder(RADIUS + 1, -2, thickness + 1) - cylinder(RADIUS, -1, thickness + 2)
    whole = occ().Compound([can, cylinder(RADIUS, 0, thickness)])
    mesh = meshed(whole, folder, size, 'symmetry = { mirror = ["xz", "yz"] }')
    x, y, z = mesh.points.T
    away = np.hypot(x, y)
    clamped = (away > RADIUS - 1e-4) | (z < -1e-4)
    fixed = np.column_stack([clamped | (abs(x) < 1e-6), clamped | (abs(y) < 1e-6), clamped])
    u = inflate(mesh, fixed, neo_hookean_rubber(SHEAR, BULK, DENSITY), pressure)
    heights = []
    for level in (0.0, thickness):
        near = (np.abs(z - level) < 1e-6) & (away < 0.35 * RADIUS)
        quadratic = np.column_stack([np.ones(near.sum()), away[near] ** 2, away[near] ** 4])
        heights.append(np.linalg.lstsq(quadratic, u[near, 2])[0][0])
    return float(np.mean(heights))


def test_the_membrane_is_hencky_s_for_small_loads():
    """The membrane of Hencky (1915), as a power series of the radius: w = R (p R/(E h))^(1/3) times a constant of ν."""
    young = 9 * BULK * SHEAR / (3 * BULK + SHEAR)
    poisson = (3 * BULK - 2 * SHEAR) / (2 * (3 * BULK + SHEAR))
    forces, places = (1, -1, -2 / 3, -13 / 18, -17 / 18, -37 / 27), (1, 1 / 2, 5 / 9, 55 / 72, 7 / 6, 205 / 108)

    def at_the_rim(b):
        return sum((2 * n + 1 - poisson) * force * b ** (1 - 3 * n) for n, force in enumerate(forces))

    b = root_scalar(at_the_rim, bracket=(1.5, 3.0)).root
    constant = sum(place * b ** (-1 - 3 * n) for n, place in enumerate(places))
    heights = [
        centre_height(RADIUS, 0.1, pressure, SHEAR, BULK) / RADIUS / np.cbrt(pressure * RADIUS / (young * 0.1))
        for pressure in (1e-5, 1e-4)
    ]
    # The rest falls with the square of the slope.
    assert heights[0] == pytest.approx(constant, rel=0.01)
    assert abs(heights[0] - constant) < abs(heights[1] - constant)


@pytest.mark.slow
def test_a_clamped_disc_rises_like_a_membrane(tmp_path):
    """The difference falls with the thickness: that of the membrane's theory is of its order."""
    expected = centre_height(RADIUS, 0.5, 0.02, SHEAR, BULK)
    assert expected > 0.4 * RADIUS
    errors = [
        inflated_disc(tmp_path, thickness, size, 0.04 * thickness) / expected - 1
        for thickness, size in ((1.0, 2.2), (0.5, 1.8))
    ]
    assert abs(errors[1]) < 0.6 * abs(errors[0])
    assert abs(errors[1]) < 0.03


def test_a_sphere_that_is_held_at_one_pole(tmp_path):
    """Far from the pole its stretches are those of a free sphere, of incompressible rubber."""
    inner, outer, pressure = 6.0, 10.0, 0.45 * SHEAR
    ball, void = (occ().Sphere(occ().Pnt(0, 0, 0), radius) for radius in (outer, inner))
    flat = occ().Box(occ().Pnt(-20, -20, -20), occ().Pnt(20, 20, -9.9))
    top = occ().Box(occ().Pnt(-20, -20, 9.9), occ().Pnt(20, 20, 20))
    mesh = meshed(ball - void - flat - top, tmp_path, 3.0)
    supports = np.zeros((len(mesh.points), 3), bool)
    supports[np.unique(mesh.faces["base"])] = True
    u = inflate(mesh, supports, neo_hookean_rubber(SHEAR, 1e4 * SHEAR, DENSITY), pressure, mixed=True)
    grown = radius_at(pressure / SHEAR, sphere_pressure, inner, outer)
    assert grown > 1.15 * inner
    _, before = area_and_volume(mesh.points, mesh.faces["chamber A"])
    _, after = area_and_volume(mesh.points + u, mesh.faces["chamber A"])
    assert abs(before) == pytest.approx(4 / 3 * np.pi * inner**3, rel=2e-3)
    assert after / before == pytest.approx((grown / inner) ** 3, rel=1e-2)
    # The equator of the outside, which moves up as a whole.
    x, y, z = mesh.points.T
    around = (np.abs(np.linalg.norm(mesh.points, axis=1) - outer) < 1e-4) & (np.abs(z) < 2.0)
    widened = np.hypot(x + u[:, 0], y + u[:, 1])[around] / np.hypot(x, y)[around]
    assert widened.mean() == pytest.approx(np.cbrt(outer**3 + grown**3 - inner**3) / outer, rel=2e-3)


PRESSURE = 0.05


@pytest.fixture(scope="module")
def pneunet(tmp_path_factory):
    """Mesh, configuration and equilibrium of a short PneuNet with a plate on its tip."""
    folder = tmp_path_factory.mktemp("pneunet")
    path = pm.bodies.pneunet("30 mm", "14 mm", "12 mm", 2, wall="1.2 mm", floor="2 mm").write(folder / "finger")
    changes = {"mesh.size": "4.5 mm", "mesh.element": "quadratic", "end_effector.kind": "plate"}
    asked = load(path).with_changes(changes)
    mesh = mesh_of(asked, body_of(asked), ()).mesh
    model = model_of(asked, mesh)
    at = configure(model, mesh.points, loads_of(asked, model, {"A": PRESSURE}))
    found = solve(at, Tangent(model), tolerance=1e-11)
    assert isinstance(found, Equilibrium)
    # It bends by degrees.
    assert abs(found.plate[4]) > 0.02
    return mesh, at, found


def difference(found, u):
    """Of two fields of displacements, relative to the largest one."""
    return np.abs(found.u - u).max() / np.abs(found.u).max()


def test_calculix_bends_a_pneunet_as_far(pneunet):
    needs(calculix.program)
    mesh, at, found = pneunet
    u, plate = calculix.equilibrium(mesh, at, tolerance=1e-4)
    assert difference(found, u) < 1e-3
    # Its quadrature is another one.
    assert plate[4] == pytest.approx(found.plate[4], rel=2e-3)


def test_ngsolve_bends_a_pneunet_as_far(pneunet):
    needs(symbolic.ngsolve)
    mesh, at, found = pneunet
    [rubber] = at.model.rubbers.values()

    def energy(F):
        return symbolic.neo_hookean(F, rubber.parameters[0], rubber.bulk_modulus)

    # Newton's method starts 1 % away from our solution, so that it has to find its own.
    u, plate = symbolic.equilibrium(mesh, [energy], {"A": PRESSURE}, 0.99 * found.u, 0.99 * found.plate)
    assert difference(found, u) < 1e-8
    np.testing.assert_allclose(plate, found.plate, atol=1e-8 * np.abs(found.u).max())
