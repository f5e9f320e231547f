import numpy as np
import pytest
from scipy.spatial import KDTree

from pneumorph.constraint import limits_of, report


def fine_points(surface, per_span=20):
    q = np.arange(per_span * surface.net.shape[1]) / (per_span * surface.net.shape[1])
    r = np.linspace(0, 1, per_span * surface.basis_r.spans + 1)
    return q, r, surface.sample(q, r)


def test_plain_tube(make_body, table):
    found = report(make_body(), table())
    assert found["wall"].value == pytest.approx(3.0)
    assert found["envelope"].value == pytest.approx(8.0, rel=1e-4)
    assert found["curvature"].value == pytest.approx(0.5 / 16.0, rel=0.04)
    assert found["ends"].value == pytest.approx(0.0, abs=1e-12)
    assert found.held()
    assert set(found.values()) == {"wall_mm", "fold_mm", "curvature", "skew", "stretch", "envelope_mm"}
    assert report(make_body(), table(envelope=None)).values()["envelope_mm"] is None


@pytest.mark.parametrize("seed", range(3))
def test_wall_and_fold_agree_with_brute_force(make_body, table, waved, seed):
    body = make_body(chambers=((4.0, (1.5, 0.0), (4.0, 20.0), "flat"),))
    body = body.with_control_points(waved(body, seed, wave=1.2))
    found = report(body, table())
    (_, _, outer), (_, _, inner) = (fine_points(surface) for surface in body.surfaces)
    distance, _ = KDTree(inner.reshape(-1, 3)).query(outer.reshape(-1, 3))
    ends = min(inner[..., 2].min(), 24.0 - inner[..., 2].max())
    assert found["wall"].value == pytest.approx(min(distance.min(), ends), abs=2e-3)

    fold = np.inf
    for surface in body.surfaces:
        q, r, points = fine_points(surface, 4)
        grid_q, grid_r = np.meshgrid(q, r)
        flat, around, along = points.reshape(-1, 3), grid_q.ravel() * surface.size[0], grid_r.ravel() * surface.size[1]
        for i in range(0, len(flat), 7):
            aside = np.abs(around - around[i])
            apart = np.hypot(np.minimum(aside, surface.size[0] - aside), along - along[i])
            fold = min(fold, np.linalg.norm(flat[apart >= 2.0] - flat[i], axis=1).min())
    assert found["fold"].value == pytest.approx(fold, abs=0.1)
    assert found["fold"].value <= fold + 1e-6


def test_worst_place_is_where_it_says(make_body, table, waved):
    body = make_body()
    body = body.with_control_points(waved(body, 4))
    found = report(body, table())
    wall = found["wall"]
    surface = next(surface for surface in body.surfaces if surface.name == wall.surface)
    point = surface.points([wall.q], [wall.r])[0]
    others = [fine_points(other)[2].reshape(-1, 3) for other in body.surfaces if other is not surface]
    nearest = min(np.linalg.norm(other - point, axis=1).min() for other in others)
    plane = min(point[2], 24.0 - point[2]) if surface.cavity else np.inf
    assert min(nearest, plane) == pytest.approx(wall.value, abs=5e-3)
    widest = found["envelope"]
    assert np.hypot(*body.exterior.points([widest.q], [widest.r])[0, :2]) == pytest.approx(widest.value)


def test_what_is_violated_is_said_in_a_sentence(make_body, table):
    found = report(make_body(), table(wall=3.5, envelope=7.0))
    assert not found.held()
    wall, envelope = found.violated()
    assert str(wall).startswith("wall is 3 mm, at least 3.5 mm is asked (on A, q = ")
    assert str(envelope).startswith("envelope is 8 mm, at most 7 mm is asked (on exterior, q = ")
    assert found.held(distance_tolerance=0.2)
    assert wall.excess() == pytest.approx(1 / 7, rel=1e-6)


def test_exterior_beyond_its_ends_is_reported(make_body, table):
    body = make_body()
    points = body.control_points()
    points[body.slices[0]][body.exterior.net.shape[1] : 2 * body.exterior.net.shape[1], 2] -= 5.0
    found = report(body.with_control_points(points), table())
    assert found["ends"].value > 0.3
    assert "ends" in {reading.limit for reading in found.violated()}


def test_a_folded_net_is_never_held(make_body, table):
    body = make_body()
    found = report(body.with_control_points(0.05 * body.control_points()), table())
    assert {"wall", "area"} <= {reading.limit for reading in found.violated()}


@pytest.mark.parametrize("wave", [1.0, 1.8])
def test_finer_report_agrees_with_what_the_optimiser_holds(make_body, table, waved, wave):
    body = make_body(length=30.0, chambers=((5.5, (0.0, 0.0), (3.0, 27.0), "flat"),))
    points = waved(body, 1, wave=wave, noise=0.1)
    limits = limits_of(body, table())
    coarse = limits.values(points, limits.pairs(points))
    fine = report(body.with_control_points(points), table())
    assert 2.0 * (1.0 - float(coarse["wall"].max())) - fine["wall"].value < 0.02
    for name, bound in (("curvature", 0.3), ("stretch", 0.1)):
        assert fine[name].value <= 1.02 * bound * (1.0 + float(coarse[name].max()))


def test_linear_example_is_within_its_limits_at_the_start(make_body, table):
    body = make_body(length=80.0, chambers=((4.0, (0.0, 0.0), (3.0, 77.0), "flat"),), ripple=(0.2, 10.0))
    found = report(body, table())
    assert found["wall"].value == pytest.approx(3.0)
    assert found.held()
