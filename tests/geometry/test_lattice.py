"""Bodies from files in lattices: what moves, what stays, symmetry, and exact gradients."""

import numpy as np
import pytest
from solids import box, problem, written

from pneumorph.analysis import analyse, build_discretisation, design_gradient
from pneumorph.analysis.bodies import mesh_of
from pneumorph.errors import ProblemError
from pneumorph.geometry.lattice.variables import images_of
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.problem import loads
from pneumorph.sensitivity.taylor import taylor_test

DESIGN = '\n[design]\nspacing = "6 mm"\n'
MIRROR = 'symmetry = { mirror = ["xz"] }\n'


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A file with a finger of rectangular section with one void, symmetric about xz alone."""
    where = tmp_path_factory.mktemp("lattice")
    written(box((-6, -8, 0), (6, 8, 36)) - box((-3, -5, 3), (4, 5, 33)), where / "finger.step")
    return where


def made(folder, more=MIRROR, design=DESIGN):
    return loads(problem("finger.step", more, "4 mm") + design, folder=folder)


@pytest.fixture(scope="module")
def finger(folder):
    asked = made(folder)
    return asked, space_of(asked)


def test_the_start_is_the_file(finger):
    asked, space = finger
    body = body_of(asked)
    np.testing.assert_allclose(space.control_points(space.start), body.control_points(), atol=1e-12)
    for surface in body.surfaces:
        np.testing.assert_allclose(surface.shell()[0], surface.outline, atol=1e-12)
        assert np.ptp(np.diff(surface.lattice.bases[2].breaks)) == pytest.approx(0.0, abs=1e-12)
    assert space.n > 100


def moved(space, seed=0):
    return space.body(space.start + np.random.default_rng(seed).uniform(-0.5, 0.5, space.n))


def test_base_and_tip_stay_and_sides_move_smoothly(finger):
    _, space = finger
    exterior = moved(space).exterior
    away = np.linalg.norm(exterior.shell()[0] - exterior.outline, axis=1)
    z = exterior.outline[:, 2]
    assert away[(z < 1e-6) | (z > 36 - 1e-6)].max() < 1e-12
    assert away[(z > 12) & (z < 24)].max() > 0.05
    near = np.array([[6.0, 1.0, 1e-3]])
    displaced = exterior.lattice.weights(near) @ (exterior.net - exterior.lattice.points())
    assert np.abs(displaced).max() < 1e-6


def test_kept_faces_stay(folder):
    space = space_of(made(folder, design=DESIGN + 'keep = [{ faces = "x = -6 mm" }]\n'))
    exterior = moved(space).exterior
    away = np.linalg.norm(exterior.shell()[0] - exterior.outline, axis=1)
    assert away[exterior.outline[:, 0] < -6 + 1e-6].max() < 1e-12
    assert away[exterior.outline[:, 0] > 6 - 1e-6].max() > 0.05


def test_faces_stay_plane_and_move(folder):
    """One that touches base and tip moves within its plane; one apart from both along its normal too."""
    written(
        box((-6, -8, 0), (6, 8, 48)) + box((5, -8, 18), (9, 8, 30)) - box((-3, -5, 3), (4, 5, 45)), folder / "pad.step"
    )
    plane = '[design]\nspacing = "4 mm"\nplane = [{ faces = "x = 9 mm" }, { faces = "x = -6 mm" }]\n'
    asked = loads(problem("pad.step", MIRROR, "4 mm") + plane, folder=folder)
    space = space_of(asked)
    np.testing.assert_allclose(space.control_points(space.start), body_of(asked).control_points(), atol=1e-12)
    body = moved(space)
    exterior = body.exterior
    away = exterior.shell()[0] - exterior.outline
    pad, side = (np.abs(exterior.outline[:, 0] - at) < 1e-6 for at in (9.0, -6.0))
    assert np.ptp(away[pad, 0]) < 1e-12 < 1e-2 < np.abs(away[pad, 0]).max()
    assert np.abs(away[side, 0]).max() < 1e-12
    assert min(np.ptp(away[those, 2]) for those in (pad, side)) > 1e-2
    mirrored = images_of(body, np.diag([1.0, -1.0, 1.0]))
    points = body.control_points()
    np.testing.assert_allclose(points[mirrored], points * [1, -1, 1], atol=1e-12)
    for wrong, said in (('{ faces = "y = 8 mm" }', "symmetry"), ('{ faces = "x = 7 mm" }', "no face")):
        with pytest.raises(ProblemError, match=rf"design\.plane\[0\].*{said}"):
            space_of(loads(problem("pad.step", MIRROR, "4 mm") + DESIGN + f"plane = [{wrong}]\n", folder=folder))


def test_symmetric_bodies_stay_symmetric(finger):
    _, space = finger
    for surface in moved(space).surfaces:
        places = np.random.default_rng(2).uniform(surface.lattice.lower, surface.lattice.upper, (50, 3))
        mirrored = [surface.lattice.weights(each) @ surface.net for each in (places, places * [1, -1, 1])]
        np.testing.assert_allclose(mirrored[0], mirrored[1] * [1, -1, 1], atol=1e-12)


def test_weights_have_exact_derivatives(finger):
    lattice = finger[1].reference.exterior.lattice
    places = np.random.default_rng(3).uniform(lattice.lower + 1, lattice.upper - 1, (20, 3))
    net = np.random.default_rng(4).normal(size=lattice.count)
    for axis in range(3):
        h, order = 1e-5 * np.eye(3)[axis], tuple(np.eye(3, dtype=int)[axis])
        slope = (lattice.weights(places + h) - lattice.weights(places - h)) @ net / 2e-5
        np.testing.assert_allclose(lattice.weights(places, order) @ net, slope, atol=1e-8)


@pytest.mark.parametrize(
    ("more", "design", "key"),
    [
        ('symmetry = { mirror = ["yz"] }', "", "body.symmetry: is not that of the body"),
        ("symmetry = { rotation = 3 }", "", "body.symmetry.rotation"),
        ("", '\n[design]\nspacings = { B = "3 mm" }', "design.spacings.B"),
        ("", '\n[design]\nkeep = [{ name = "screw" }]', "design.keep[0]"),
        ("", '\n[limits]\ncurvature = "1 /mm^2"', "limits.curvature"),
    ],
)
def test_what_cannot_be_designed_is_refused(folder, more, design, key):
    with pytest.raises(ProblemError) as refused:
        made(folder, more, design)
    assert key in str(refused.value)


def test_the_gradient_is_exact(finger):
    asked, space = finger
    disc = build_discretisation(asked, mesh_of(asked, space.reference, ()), space.reference.control_points())
    found = analyse(asked, space, disc, space.start, tolerance=1e-11)
    slope = design_gradient(asked, space, disc, found)
    states = {name: each.state for name, each in found.equilibria.items()}

    def value(phi):
        return analyse(asked, space, disc, phi, states, tolerance=1e-11).value

    direction = np.random.default_rng(1).uniform(-1, 1, space.n)
    test = taylor_test(value, space.start, slope, direction, 0.1, start=found.value)
    assert test.rate == pytest.approx(2.0, abs=0.02)
