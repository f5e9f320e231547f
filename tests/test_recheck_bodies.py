"""The second measurement of limits of bodies from files: it agrees with the certificates, and notices wrong claims."""

import importlib.util
import sys
from pathlib import Path

import numpy as np
import pytest
from pydantic import TypeAdapter
from scipy.spatial import ConvexHull
from solids import box, problem, written

from pneumorph.geometry.starting import body_of, space_of
from pneumorph.limits.obstacles import region_of
from pneumorph.limits.of_shape import limits_of
from pneumorph.problem import loads
from pneumorph.problem.contact import ObstacleSpec

FOLDER = Path(__file__).parents[1] / "benchmarks"
LIMITS = """
[design]
spacing = "6 mm"
[limits]
wall = "1.85 mm"
fold = { distance = "1.45 mm", neighbourhood = "2 mm" }
envelope = { box = [["-7 mm", "-8 mm", "-1 mm"], ["7 mm", "8 mm", "31 mm"]] }
"""


@pytest.fixture(scope="module")
def recheck():
    sys.path.insert(0, str(FOLDER))
    try:
        spec = importlib.util.spec_from_file_location("recheck_bodies", FOLDER / "recheck_bodies.py")
        module = importlib.util.module_from_spec(spec)
        sys.modules[spec.name] = module
        spec.loader.exec_module(module)
    finally:
        sys.path.remove(str(FOLDER))
    return module


@pytest.fixture(scope="module")
def asked(tmp_path_factory):
    """A finger with one void and a slot of 1.6 mm, less than the neighbourhood of folds."""
    folder = tmp_path_factory.mktemp("recheck")
    solid = box((-6, -7, 0), (6, 7, 30)) - box((-4, -4, 3), (0, 4, 27)) - box((2, -8, 14), (7, 8, 15.6))
    written(solid, folder / "finger.step")
    return loads(problem("finger.step", "", "4 mm") + LIMITS, folder=folder)


def moved(asked, amount):
    """A body whose control points are moved at random by up to so many mm."""
    space = space_of(asked)
    return space.reference.with_control_points(
        space.control_points(space.start + np.random.default_rng(0).uniform(-amount, amount, space.n))
    )


def claims(asked, body):
    readings = limits_of(asked, body_of(asked)).certify(body).readings
    return {each.limit: each.value for each in readings}


NAMES = {
    "wall_mm": "wall",
    "fold_mm": "fold",
    "scaling_least": "least scaling",
    "scaling_largest": "largest scaling",
    "envelope_mm": "envelope",
}


@pytest.fixture(scope="module")
def both(asked, recheck):
    body = moved(asked, 0.3)
    found = claims(asked, body)
    return recheck.measured(body, asked.limits), {key: found[name] for key, name in NAMES.items()}


def test_it_agrees_with_the_certificates(both, recheck):
    """Folds, and values that are far from their limits, are certified to be no worse than so, without their values."""
    found, claimed = both
    assert list(recheck.worse(found, claimed)) == []
    assert found["wall_mm"] == pytest.approx(claimed["wall_mm"], rel=0.02)
    assert found["fold_mm"] == pytest.approx(1.6, abs=0.2)


@pytest.mark.parametrize("key", NAMES)
def test_a_claim_that_is_too_good_is_noticed(both, recheck, key):
    found, claimed = both
    spoiled = claimed | {key: found[key] + recheck.SIGN[key] * 0.03 * max(abs(found[key]), 1.0)}
    assert list(recheck.worse(found, spoiled)) == [key]


def test_places_and_gradients_are_those_of_the_lattice(asked, recheck):
    surface = moved(asked, 0.3).exterior
    samples = recheck.sampled(surface)
    some = np.random.default_rng(1).integers(len(samples.file), size=50)
    lattice = surface.lattice
    np.testing.assert_allclose(samples.now[some], lattice.weights(samples.file[some]) @ surface.net, atol=1e-12)
    for axis in range(3):
        order = tuple(np.eye(3, dtype=int)[axis])
        slopes = lattice.weights(samples.file[some], order) @ surface.net
        np.testing.assert_allclose(samples.gradients[some, :, axis], slopes, atol=1e-12)


def test_distances_of_triangles(recheck):
    """Against a fine grid on both, for random ones and for those with parallel edges."""
    rng = np.random.default_rng(3)
    grid = np.array([[1 - a - b, a, b] for a in np.linspace(0, 1, 21) for b in np.linspace(0, 1, 21) if a + b <= 1])
    for _ in range(10):
        one, other = rng.normal(size=(3, 3)), rng.normal(size=(3, 3)) + np.array([6.0, 0.0, 0.0])
        if rng.random() < 0.3:
            other = one + np.array([0.0, 0.5, 2.0])
        sampled = np.linalg.norm((grid @ one)[:, None] - (grid @ other)[None], axis=2).min()
        exact = recheck.apart(one[None], other[None])
        assert exact <= sampled + 1e-12
        assert exact == pytest.approx(sampled, abs=0.1)


OBSTACLES = {
    "plane": {"point": ["0 mm", "0 mm", "2 mm"], "normal": [0, 0.6, 0.8]},
    "sphere": {"radius": "3 mm", "center": ["1 mm", "0 mm", "-1 mm"]},
    "cylinder": {"radius": "2 mm", "length": "5 mm", "center": ["0 mm", "1 mm", "0 mm"], "axis": [0.6, 0, 0.8]},
    "box": {"size": ["3 mm", "4 mm", "5 mm"], "center": ["1 mm", "1 mm", "0 mm"]},
}


@pytest.mark.parametrize("kind", OBSTACLES)
def test_distances_from_obstacles_are_those_of_the_limit(recheck, kind):
    spec = TypeAdapter(ObstacleSpec).validate_python({"name": "it", "kind": kind} | OBSTACLES[kind])
    points = np.random.default_rng(0).uniform(-8.0, 8.0, (400, 3))
    found, known = recheck.beside(spec, points), region_of(spec).beyond(points)
    # Beside edges the limit may be too small a distance, never too large a one.
    assert np.all(known <= found + 1e-9)
    near = np.abs(known - found) < 1e-9
    assert near.all() if kind in ("plane", "sphere") else near.mean() > 0.1
    assert np.array_equal(found < 0.0, known < 0.0)


def test_distances_from_triangles_are_signed(recheck):
    """Of a cube in twelve triangles, as of the box that it is."""
    corners = np.array([[x, y, z] for x in (-2.0, 2.0) for y in (-2.0, 2.0) for z in (-2.0, 2.0)])
    triangles = ConvexHull(corners).simplices
    outwards = np.einsum("td,td->t", np.cross(*np.moveaxis(np.diff(corners[triangles], axis=1), 1, 0)),
                         corners[triangles].mean(axis=1)) > 0  # fmt: skip
    triangles[~outwards] = triangles[~outwards][:, ::-1]
    points = np.random.default_rng(1).uniform(-4.0, 4.0, (300, 3))
    beyond = np.abs(points) - 2.0
    exact = np.linalg.norm(np.maximum(beyond, 0.0), axis=1) + np.minimum(beyond.max(axis=1), 0.0)
    np.testing.assert_allclose(recheck._beside_triangles(corners[triangles], points), exact, atol=1e-9)


def test_reach_is_into_half_of_what_the_start_leaves(recheck):
    ball = TypeAdapter(ObstacleSpec).validate_python({"name": "it", "kind": "sphere"} | OBSTACLES["sphere"])
    start, now = np.array([[5.0, 0.0, -1.0], [9.0, 0.0, 0.0]]), np.array([[4.3, 0.0, -1.0]])
    assert recheck.reach(start, now, [ball], 0.4) == pytest.approx(0.2 - 0.3)
    assert recheck.reach(start, now, [ball], 3.0) == pytest.approx(0.5 - 0.3)
    assert recheck.reach(start, now, [], 0.4) is None
