import numpy as np
import pytest
from certifying import certified
from scipy.spatial import KDTree

from pneumorph.geometry.tube.surface import cap_points
from pneumorph.limits.certify.places import Points
from pneumorph.limits.of_shape import build_limit_functions, tube_limits
from pneumorph.limits.table import BY_NAME


def count(places):
    return sum(len(found.attained) for found in places.values())


def fine_points(surface, per_span=20):
    q = np.arange(per_span * surface.net.shape[1]) / (per_span * surface.net.shape[1])
    r = np.linspace(0, 1, per_span * surface.basis_r.spans + 1)
    return q, r, surface.sample(q, r)


def test_plain_tube(make_body, table):
    found = certified(make_body(), table())
    assert found["wall"].value == pytest.approx(3.0)
    assert 8.0 - 1e-3 <= found["envelope"].attained <= found["envelope"].value <= 8.05
    assert found["curvature"].attained == pytest.approx(0.5 / 16.0, rel=0.06)
    assert found["curvature"].attained <= found["curvature"].value <= 0.5 / 16.0 + 0.01 * 0.3
    assert found["ends"].value == pytest.approx(0.0, abs=1e-12)
    assert found.satisfied()
    assert set(found.values()) == {"wall_mm", "fold_mm", "curvature", "skew", "stretch", "envelope_mm"}
    assert certified(make_body(), table(envelope=None)).values()["envelope_mm"] is None


@pytest.mark.parametrize("seed", range(3))
def test_wall_and_fold_agree_with_brute_force(make_body, table, waved, seed):
    body = make_body(chambers=((4.0, (1.5, 0.0), (4.0, 20.0), "flat"),))
    body = body.with_control_points(waved(body, seed, wave=1.2))
    found = certified(body, table())
    (_, _, outer), (_, _, inner) = (fine_points(surface) for surface in body.surfaces)
    distance, _ = KDTree(inner.reshape(-1, 3)).query(outer.reshape(-1, 3))
    ends = min(inner[..., 2].min(), 24.0 - inner[..., 2].max())
    least = min(distance.min(), ends)
    assert found["wall"].value <= least <= found["wall"].value + 0.02
    assert found["wall"].attained == pytest.approx(least, abs=0.02)

    fold = np.inf
    for surface in body.surfaces:
        q, r, points = fine_points(surface, 4)
        grid_q, grid_r = np.meshgrid(q, r)
        flat, around, along = points.reshape(-1, 3), grid_q.ravel() * surface.size[0], grid_r.ravel() * surface.size[1]
        for i in range(0, len(flat), 7):
            turn = (around - around[i]) / surface.size[0]
            apart = np.hypot(np.sin(np.pi * turn) / np.pi * surface.size[0], along - along[i])
            fold = min(fold, np.linalg.norm(flat[apart >= 2.0] - flat[i], axis=1).min())
    assert found["fold"].value <= fold
    assert found["fold"].value >= fold - 0.85 * abs(fold - 1.0) - 0.1


def test_worst_place_is_where_it_says(make_body, table, waved):
    body = make_body()
    body = body.with_control_points(waved(body, 4))
    found = certified(body, table())
    wall = found["wall"]
    surface = next(surface for surface in body.surfaces if surface.name == wall.surface)
    point = surface.points([wall.q], [wall.r])[0]
    others = [fine_points(other)[2].reshape(-1, 3) for other in body.surfaces if other is not surface]
    nearest = min(np.linalg.norm(other - point, axis=1).min() for other in others)
    plane = min(point[2], 24.0 - point[2]) if surface.cavity else np.inf
    assert min(nearest, plane) == pytest.approx(wall.attained, abs=5e-3)
    widest = found["envelope"]
    assert np.hypot(*body.exterior.points([widest.q], [widest.r])[0, :2]) == pytest.approx(widest.attained)


def test_what_is_violated_is_said_in_a_sentence(make_body, table):
    found = certified(make_body(), table(wall=3.5, envelope=7.0))
    assert not found.satisfied()
    wall, envelope = found.violated()
    assert str(wall).startswith("wall is 3 mm, must be at least 3.5 mm (on A, at (")
    assert str(envelope).startswith("envelope is 8.02 mm, must be at most 7 mm (on exterior, at (")
    assert wall.excess() == pytest.approx(1 / 7, rel=1e-6)


def test_exterior_beyond_its_ends_is_reported(make_body, table):
    body = make_body()
    points = body.control_points()
    points[body.slices[0]][body.exterior.net.shape[1] : 2 * body.exterior.net.shape[1], 2] -= 5.0
    found = certified(body.with_control_points(points), table())
    assert found["ends"].value > 0.3
    assert "ends" in {reading.limit for reading in found.violated()}


def test_a_folded_net_is_never_held(make_body, table):
    body = make_body()
    found = certified(body.with_control_points(0.05 * body.control_points()), table())
    assert {"wall", "area"} <= {reading.limit for reading in found.violated()}


@pytest.mark.parametrize("scale", [0.0, 1.0, 30.0])
def test_crumpled_nets_end_in_finite_numbers(make_body, table, scale):
    body = make_body()
    points = np.random.default_rng(0).normal(scale=scale, size=(body.n_points, 3))
    found = certified(body.with_control_points(points), table())
    assert not found.satisfied()
    assert np.all(np.isfinite([[reading.value, reading.attained] for reading in found.readings]))


@pytest.mark.parametrize("wave", [1.0, 1.8])
def test_certificate_agrees_with_what_the_optimiser_holds(make_body, table, waved, wave):
    body = make_body(length=30.0, chambers=((5.5, (0.0, 0.0), (3.0, 27.0), "flat"),))
    points = waved(body, 1, wave=wave, noise=0.1)
    limits = build_limit_functions(body, table())
    coarse = limits.values(points, limits.partners(points))
    fine = certified(body.with_control_points(points), table())
    walls = 2.0 * (1.0 - max(float(coarse["wall"].max()), float(coarse["ends"].max())))
    assert fine["wall"].value <= walls + 1e-6
    assert walls - fine["wall"].value < 0.03
    for name, bound in (("curvature", 0.3), ("stretch", 0.1)):
        sampled = bound * (1.0 + float(coarse[name].max()))
        assert sampled - 1e-9 <= fine[name].value <= 1.02 * sampled + 0.01 * bound


def test_linear_example_is_within_its_limits_at_the_start(make_body, table):
    body = make_body(length=80.0, chambers=((4.0, (0.0, 0.0), (3.0, 77.0), "flat"),), ripple=(0.2, 10.0))
    found = certified(body, table())
    assert found["wall"].value == pytest.approx(3.0)
    assert found.satisfied()


def test_places_are_all_that_is_beyond(make_body, table, waved):
    body = make_body(length=30.0, chambers=((5.5, (0.0, 0.0), (3.0, 27.0), "flat"),))
    body = body.with_control_points(waved(body, 1, wave=1.8, noise=0.1))
    found = certified(body, table())
    assert count(found.places) > 0
    for name, limit in BY_NAME.items():
        if isinstance(places := found.places.get(name), Points):
            worst = limit.excess(np.asarray(places.certified), limit.read(table()))
            assert np.all(worst > 0.0)
            assert np.all(limit.excess(places.attained, limit.read(table())) <= worst + 1e-12)
    wall = found.places["wall"]
    assert len(wall.attained)
    for k in range(len(wall.attained)):
        ends = []
        for number, (q, r, s) in ((wall.surface_a[k], wall.a[k]), (wall.surface_b[k], wall.b[k])):
            surface = body.surfaces[number]
            ends.append(cap_points(surface, r > 0.5, [q], [s])[0] if s < 1.0 else surface.points([q], [r])[0])
        assert np.linalg.norm(ends[0] - ends[1]) == pytest.approx(wall.attained[k], abs=1e-9)
        assert wall.certified[k] <= min(wall.attained[k], 2.0)


def test_worst_place_between_samples_is_found(make_body, table):
    # A crest of one control point: the exterior is widest where no sample of the optimiser is.
    body = make_body()
    points = body.control_points()
    net = points[body.slices[0]].reshape(body.exterior.net.shape)
    net[7, 3, :2] *= 1.3
    net[7, 4, :2] *= 1.24
    body = body.with_control_points(points)
    x = fine_points(body.exterior, 60)[2]
    widest = np.hypot(x[..., 0], x[..., 1]).max()
    spec = table(envelope=float(widest) / 1.001)
    found = certified(body, spec)["envelope"]
    assert widest <= found.value <= 1.004 * widest
    assert found.attained <= found.value


def test_several_threads_find_the_same(make_body, table, waved, request):
    body = make_body(chambers=((4.0, (1.5, 0.0), (4.0, 20.0), "flat"),))
    body = body.with_control_points(waved(body, 5, wave=1.2))
    limits = tube_limits(body, table())
    report, rows = limits.certify(body), limits.rows(body, 1.0, -0.5)
    request.getfixturevalue("three_threads")
    with_threads, rows_with_threads = limits.certify(body), limits.rows(body, 1.0, -0.5)
    assert with_threads.readings == report.readings
    assert len(rows.value) > 100
    np.testing.assert_array_equal(rows_with_threads.kind, rows.kind)
    np.testing.assert_array_equal(rows_with_threads.value, rows.value)
    assert abs(rows_with_threads.jacobian - rows.jacobian).max() == 0.0
