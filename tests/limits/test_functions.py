import jax
import jax.numpy as jnp
import numpy as np
import pytest
from certifying import certified

from pneumorph.limits.of_shape import build_limit_functions


def two_walls(make_body, table, **other):
    body = make_body()
    return body, build_limit_functions(body, table(wall=5.0, **other))


def test_shapes_never_change(make_body, table, waved):
    body, limits = two_walls(make_body, table)
    traced = []

    @jax.jit
    def values(points, partners):
        traced.append(True)
        return limits.values(points, partners)

    shapes = []
    for seed in range(3):
        points = waved(body, seed)
        shapes.append({name: value.shape for name, value in values(points, limits.partners(points)).items()})
    assert shapes[0] == shapes[1] == shapes[2]
    assert len(traced) == 1
    assert set(shapes[0]) == {
        "wall",
        "planes",
        "ends",
        "fold",
        "rim",
        "curvature",
        "skew",
        "stretch",
        "area",
        "envelope",
    }
    assert "envelope" not in build_limit_functions(body, table(envelope=None)).values(points, limits.partners(points))


def test_concentric_cylinders_and_end_walls(make_body, table):
    body, limits = two_walls(make_body, table)
    points = body.control_points()
    values = limits.values(points, limits.partners(points))
    # Samples beside the chamber see a wall of 4 mm, where samples alone would see up to 0.02 mm more.
    assert float(values["wall"].max()) == pytest.approx(1.0 - 4.0 / 5.0, abs=2e-4)
    assert float(values["planes"].max()) == pytest.approx(1.0 - 3.0 / 5.0, abs=1e-9)
    assert float(values["fold"].max()) == -1.0
    assert float(values["envelope"].max()) == pytest.approx((8.0 - 12.0) / 5.0, abs=1e-4)


def test_eccentric_chamber_and_corner_of_its_disc(make_body, table):
    body = make_body(chambers=((3.0, (2.0, 1.0), (3.0, 21.0), "flat"),))
    limits = build_limit_functions(body, table(wall=4.0))
    points = body.control_points()
    partners = limits.partners(points)
    x = np.asarray(limits.positions([field.x for field in limits.fields(points)]))
    distance = 4.0 * (1.0 - np.asarray(limits.values(points, partners)["wall"]))
    q = np.arctan2(x[: len(distance), 1], x[: len(distance), 0])
    aside = np.hypot(8.0 * np.cos(q) - 2.0, 8.0 * np.sin(q) - 1.0) - 3.0
    beyond = np.maximum(np.abs(x[: len(distance), 2] - 12.0) - 9.0, 0.0)
    true = np.hypot(aside, beyond)
    active = np.asarray(partners.wall.active)
    assert np.all(active == (true < 4.5)) or np.abs(true[active != (true < 4.5)] - 4.5).max() < 1e-2
    np.testing.assert_allclose(distance[active], true[active], atol=5e-3)


def test_chambers_in_series_are_kept_apart_by_their_discs(make_body, table):
    flat = ((4.0, (0.0, 0.0), (3.0, 11.0), "flat"), (4.0, (0.0, 0.0), (13.5, 21.0), "flat"))
    body = make_body(chambers=flat)
    limits = build_limit_functions(body, table(wall=2.5))
    points = body.control_points()
    values = limits.values(points, limits.partners(points))
    between = values["wall"][-limits._first[2] + limits._first[1] :]
    assert float(between.max()) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("form", ["per_mm", "printed"])
def test_gradients_by_taylor_remainders(make_body, table, waved, form):
    body, limits = two_walls(make_body, table, form=form)
    points = waved(body, wave=1.5)
    partners = limits.partners(points)
    values = limits.values(points, partners)
    rng = np.random.default_rng(5)
    weights = {name: rng.uniform(size=value.shape) for name, value in values.items()}
    for name in ("planes", "ends", "rim"):
        weights[name] *= values[name] > -1.0  # half-way up, the nearer of the two ends changes

    @jax.jit
    def total(points):
        found = limits.values(points, partners)
        return jnp.stack([jnp.vdot(weights[name], found[name]) for name in sorted(found)])

    direction = rng.normal(size=points.shape) * 0.1
    slope = jax.jvp(total, (points,), (direction,))[1]
    steps = 0.5 ** np.arange(3, 9)
    remainder = np.array([np.abs(total(points + h * direction) - total(points) - h * slope) for h in steps])
    rates = np.log2(remainder[:-1] / np.maximum(remainder[1:], 1e-300))
    for name, value, rate in zip(sorted(values), remainder.T, rates.T, strict=True):
        if value.max() > 1e-9:  # ends are linear
            assert np.median(rate) == pytest.approx(2.0, abs=0.1), name
    back = jax.grad(lambda p: total(p).sum())(points)
    assert float(jnp.vdot(back, direction)) == pytest.approx(float(slope.sum()), rel=1e-9)


def test_distances_follow_motion_until_partners_are_found_anew(make_body, table, waved):
    body, limits = two_walls(make_body, table)
    start = waved(body, wave=1.5)
    direction = np.random.default_rng(2).normal(size=start.shape)
    direction *= 0.1 / np.linalg.norm(direction, axis=1).max()
    partners = limits.partners(start)
    assert not limits.moved(start + direction, partners)
    assert limits.moved(start + 1.3 * direction, partners)
    moved = start + direction
    kept, fresh = (np.asarray(limits.values(moved, found)["wall"]) for found in (partners, limits.partners(moved)))
    active = np.asarray(partners.wall.active)
    assert np.abs(5.0 * (kept - fresh))[active].max() < 0.04


def bellows(make_body, gap):
    """A tube whose meridian turns back on itself, walls facing each other across a given gap."""
    body = make_body(length=24.0)
    points = body.control_points()
    net = points[body.slices[0]].reshape(body.exterior.net.shape)
    basis, tau = body.exterior.basis_r, 24.0
    # The meridian goes out along z = 12 - gap/2 and comes back along z = 12 + gap/2, round the fold's tip at radius 14.
    path = np.array(
        [[6.0, 0.0], [6.0, 11.0 - gap / 2], [7.0, 12 - gap / 2], [14.0, 12 - gap / 2], [14.0 + gap / 4, 12.0]]
    )
    path = np.vstack([path, np.stack([path[-2::-1, 0], tau - path[-2::-1, 1]], axis=1)])
    s = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(path, axis=0).T))])
    dense = np.linspace(0, 1, 400)
    meridian = np.stack([np.interp(dense * s[-1], s, path[:, k]) for k in range(2)], axis=1)
    fitted = np.linalg.lstsq(basis.matrix(dense), meridian, rcond=None)[0]
    around = 2 * np.pi * np.arange(net.shape[1]) / net.shape[1]
    rho = fitted[:, :1] / np.sinc(1.0 / net.shape[1]) ** 4
    net[..., 0], net[..., 1], net[..., 2] = rho * np.cos(around), rho * np.sin(around), fitted[:, 1:]
    return body, points


@pytest.mark.parametrize("gap", [0.8, 1.2])
def test_fold_of_a_bellows(make_body, table, gap):
    body, points = bellows(make_body, gap)
    limits = build_limit_functions(body, table())
    values = limits.values(points, limits.partners(points))
    surface = body.with_control_points(points).exterior
    profile = surface.sample([0.0], np.linspace(0, 1, 4001))[:, 0]
    gaps = np.linalg.norm(profile[:, None] - profile[None], axis=2)
    apart = np.abs(np.subtract.outer(np.arange(4001), np.arange(4001))) * 24.0 / 4000
    true = gaps[apart >= 2.0].min()
    assert float(values["fold"].max()) == pytest.approx(1.0 - true, abs=0.02)


def test_paper_arguments(make_body, table):
    body, limits = two_walls(make_body, table)
    points = body.control_points()
    values = limits.values(points, limits.partners(points))
    arguments = limits.paper_arguments(values)
    assert float(arguments["wall"].max()) == pytest.approx((5.0 - 4.0) / 0.05, rel=1e-3)
    np.testing.assert_allclose(arguments["curvature"], values["curvature"] + 1.0)
    assert float(arguments["envelope"].max()) == pytest.approx((8.0 - 12.0) / 0.05, rel=1e-3)


def test_no_nan_where_surfaces_touch_or_fold(make_body, table):
    body = make_body()
    limits = build_limit_functions(body, table())
    total = jax.jit(
        jax.value_and_grad(lambda points, partners: sum(c.sum() for c in limits.values(points, partners).values()))
    )
    rng = np.random.default_rng(0)
    for points in (np.zeros((body.n_points, 3)), rng.normal(size=(body.n_points, 3)), np.full((body.n_points, 3), 3.0)):
        value, gradient = total(points, limits.partners(points))
        assert np.isfinite(value)
        assert np.all(np.isfinite(gradient))


@pytest.mark.parametrize(("slope", "excess"), [(0.7, 0.0), (0.3, 0.4)])
def test_a_chamber_may_not_lie_flat_on_its_own_end(make_body, table, slope, excess):
    body = make_body()
    limits = build_limit_functions(body, table())
    points = body.control_points()
    net = points[body.slices[1]].reshape(body.chambers[0].net.shape)
    along = 18.0 * body.chambers[0].basis_r.greville
    row = along < 6.0
    # The wall runs inward over the disc; with a rise of 0.3 it is 0.6 mm above it where 1 mm is asked.
    net[row, :, 2] = 3.0 + slope * along[row, None]
    net[row, :, :2] *= (1.0 - 0.08 * along[row])[:, None, None]
    rim = float(limits.values(points, limits.partners(points))["rim"].max())
    reading = certified(body.with_control_points(points), table())["fold"]
    if excess:
        assert rim == pytest.approx(excess, abs=0.02)
        assert (reading.attained, reading.surface) == (pytest.approx(0.6, abs=0.02), "A")
        assert reading.value <= reading.attained
    else:
        assert rim <= 0.0
        assert reading.value >= 0.995
