import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree

from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import cap_points
from pneumorph.limits.certify.enclosed import Accuracy
from pneumorph.limits.tube.certify.cells import knot_spans
from pneumorph.limits.tube.certify.patch_distances import gaps, nearest, patches, without_discs
from pneumorph.limits.tube.certify.quadratic_bounds import clears
from pneumorph.limits.tube.certify.slabs import slab, steps
from pneumorph.problem import BodySpec

# Start and width in q and r of a part of a tube, and its circumference relative to that at the start: 1 mm of 40.
PLANE = np.array([0.0, 0.025, 0.0, 0.025, 1.0, 0.0, 0.0, 0.0])


def moved(seed, wave, ends):
    """A body whose walls undulate at random."""
    chamber = {"name": "A", "radius": "4 mm", "center": ["1 mm", "0 mm"], "span": ["3 mm", "21 mm"], "ends": ends}
    table = {"length": "24 mm", "radius": "8 mm", "control_density": "0.6 /mm", "chamber": [chamber]}
    body = starting_body(BodySpec.model_validate(table))
    rng = np.random.default_rng(seed)
    points = body.control_points()
    for where in body.slices:
        growth = 0.1 * wave * np.cos(0.7 * points[where, 2:] + rng.uniform(0, 6))
        points[where] = points[where] * (1.0 + growth * [1.0, 1.0, 0.0])
    return body.with_control_points(points)


def measured(first, second, neighbourhood, accuracy):
    return gaps(first, second, neighbourhood, accuracy, nearest(first, second, neighbourhood), np.inf)


def wall(body, bound=2.0):
    first, second = (patches(surface, knot_spans(surface)) for surface in body.surfaces)
    found, beyond = measured(first, second, 0.0, Accuracy(-bound, -0.995 * bound, 0.003 * bound, 0.003 * bound, 0.01))
    return min(beyond, found.lower.min()), found.attained.min()


def fold(surface, bound=1.0, neighbourhood=2.0):
    part = knot_spans(surface)
    tube = without_discs(patches(surface, part))
    accuracy = Accuracy(-bound, -0.995 * bound, 0.003 * bound, 0.003 * bound, 0.8)
    found, beyond = measured(tube, tube, neighbourhood, accuracy)
    return min(beyond, found.lower.min()), found.attained.min()


def test_concentric_cylinders(make_body):
    certified, seen = wall(make_body(), bound=4.0)
    assert 0.997 * 4.0 - 0.002 <= certified <= seen == pytest.approx(4.0, abs=2e-3)


def test_walls_much_thicker_than_patches_are_certified_as_accurately(make_body):
    body = make_body(radius=17.0, chambers=((9.9, (0.0, 0.0), (7.5, 16.5), "flat"),), density=0.9)
    certified, seen = wall(body, bound=7.0)
    assert 0.997 * 7.0 - 0.005 <= certified <= seen == pytest.approx(7.1, abs=5e-3)


def test_discs_of_chambers_count(make_body):
    body = make_body(chambers=((4.0, (0.0, 0.0), (3.0, 11.0), "flat"), (4.0, (0.0, 0.0), (13.5, 21.0), "flat")))
    first, second = (patches(surface, knot_spans(surface)) for surface in body.chambers)
    found, beyond = measured(first, second, 0.0, Accuracy(-2.5, -2.49, 0.0075, 0.0075, 0.01))
    assert 2.5 - 0.0076 <= min(beyond, found.lower.min()) <= found.attained.min() == pytest.approx(2.5, abs=1e-9)
    k = int(np.argmin(found.attained))
    assert found.a[k, 1] == 1.0
    assert found.b[k, 1] == 0.0


@given(st.integers(0, 999), st.floats(0.0, 2.0), st.sampled_from(["flat", "pole"]))
@settings(max_examples=8, deadline=None)
def test_walls_contain_brute_force(seed, wave, ends):
    body = moved(seed, wave, ends)
    outer, inner = (surface.sample(np.linspace(0, 1, 200), np.linspace(0, 1, 400)) for surface in body.surfaces)
    points = [inner.reshape(-1, 3)]
    if ends == "flat":
        s, q = (part.ravel() for part in np.meshgrid(np.linspace(0, 1, 20), np.linspace(0, 1, 100)))
        points += [cap_points(body.chambers[0], tip, q, s) for tip in (False, True)]
    least = KDTree(np.concatenate(points)).query(outer.reshape(-1, 3))[0].min()
    certified, seen = wall(body)
    assert certified <= least + 1e-9
    assert certified <= seen
    # Surfaces nearer than half the limit are not looked at more closely.
    if 1.0 < least < 3.5:
        assert certified >= least - 0.006 - 0.01 * abs(least - 2.0) - 0.02
        # Nearer points are sought until the limit is decided, to 0.3 % of it.
        assert seen <= least + 0.003 * 2.0 or least > 2.05


@pytest.mark.parametrize("seed", range(3))
def test_folds_contain_brute_force(make_body, waved, seed):
    body = make_body()
    body = body.with_control_points(waved(body, seed, wave=2.0))
    for surface in body.surfaces:
        q = np.arange(4 * surface.net.shape[1]) / (4 * surface.net.shape[1])
        r = np.linspace(0, 1, 6 * surface.basis_r.spans + 1)
        x = surface.sample(q, r).reshape(-1, 3)
        along, around = (part.ravel() for part in np.meshgrid(r * surface.size[1], q, indexing="ij"))
        least = np.inf
        for i in range(0, len(x), 3):
            aside = np.abs(around - around[i])
            apart = np.hypot(np.sin(np.pi * aside) / np.pi * surface.size[0], along - along[i])
            least = min(least, np.linalg.norm(x[apart >= 2.0] - x[i], axis=1).min())
        certified, seen = fold(surface)
        assert certified <= least
        assert certified <= seen
        assert certified >= min(least - 0.1, 0.995)


def test_places_round_a_pole_are_neighbours(make_body):
    # A circle round the pole that is twice the neighbourhood long is only 2/π of it across.
    body = make_body(chambers=((4.0, (0.0, 0.0), (3.0, 21.0), "pole"),))
    certified, seen = fold(body.chambers[0], bound=1.9)
    assert 0.995 * 1.9 <= certified <= seen


def widest(a, b):
    """The widest slab between two patches (4, 4, 3)."""
    return slab(np.stack([a, b]).reshape(2, 48), np.zeros((4, 3)))


def test_slabs_are_of_second_order():
    # Facing pieces of cylinders about one axis, of radius 3 and 5.
    errors = []
    for width in 0.4 * 0.5 ** np.arange(4):
        angle = width * np.array([-0.5, 0.5])
        nets = [arc(radius, *angle) for radius in (3.0, 5.0)]
        errors.append(2.0 - widest(*nets))
    rates = np.log2(np.array(errors[:-1]) / errors[1:])
    np.testing.assert_allclose(rates, 2.0, atol=0.1)


def largest_cleared(a, b, boxes=(PLANE, PLANE), neighbourhood=0.0):
    """The largest distance that `clears` proves, by bisection."""
    nets, path = np.stack([a, b]).reshape(2, 48), np.empty((3, 2))
    arrays = [np.empty(shape) for shape in ((13, 3), (4, 4), (4, 4), (4, 4), (4, 4))]
    steps(np.stack(boxes), np.arange(2), np.tile([0.0, 1.0], 4), np.array([40.0, 40.0]), neighbourhood, path)
    low, high = 0.0, 10.0
    for _ in range(50):
        middle = 0.5 * (low + high)
        if clears(nets, path, neighbourhood, middle, *arrays):
            low = middle
        else:
            high = middle
    return low


def test_quadratics_are_of_third_order():
    errors = []
    for width in 0.4 * 0.5 ** np.arange(4):
        angle = width * np.array([-0.5, 0.5])
        nets = [arc(radius, *angle) for radius in (3.0, 5.0)]
        errors.append(2.0 - largest_cleared(*nets))
        assert errors[-1] < 0.25 * (2.0 - widest(*nets))
    assert np.log2(errors[-2] / errors[-1]) > 2.9


@given(st.integers(0, 9999), st.sampled_from([0.0, 1.0, 1.5]))
@settings(max_examples=200, deadline=None)
def test_quadratics_are_below_every_sample(seed, neighbourhood):
    # Patches of about 1 mm beside or above each other, bent at random.
    rng = np.random.default_rng(seed)
    step = rng.uniform(0.7, 1.5, 2) if neighbourhood else rng.uniform(-0.5, 0.5, 2)
    height = 0.0 if neighbourhood else rng.uniform(0.5, 2.0)
    side = np.linspace(0.0, 1.0, 4)
    flat = np.stack([*np.meshgrid(side, side), np.zeros((4, 4))], axis=-1)
    bend = rng.choice([0.02, 0.1, 0.3])
    a, b = (flat + start + rng.normal(scale=bend, size=(4, 4, 3)) for start in ([0, 0, 0], [*step, height]))
    boxes = PLANE, PLANE + np.array([step[0] / 40.0, 0, step[1] / 40.0, 0, 0, 0, 0, 0])
    cleared = largest_cleared(a, b, boxes, neighbourhood)

    t = np.linspace(0.0, 1.0, 13)
    weights = np.stack([(1 - t) ** 3, 3 * (1 - t) ** 2 * t, 3 * (1 - t) * t**2, t**3], axis=1)
    x, y = (np.einsum("vi,uj,ijc->vuc", weights, weights, net).reshape(-1, 3) for net in (a, b))
    v, u = (part.ravel() for part in np.meshgrid(t, t, indexing="ij"))
    turn = (u[:, None] - u[None] - step[0]) / 40.0
    apart = np.hypot(np.sin(np.pi * turn) / np.pi * 40.0, v[:, None] - v[None] - step[1])
    distance = np.linalg.norm(x[:, None] - y[None], axis=-1)
    assert cleared <= distance[apart >= neighbourhood].min() + 1e-9


def test_the_edge_of_the_neighbourhood_is_cleared():
    # Nearest points of two parts of a plane are on the edge; no slab separates the parts, which have a common side.
    side = np.linspace(0.0, 0.5, 4)
    flat = np.stack([*np.meshgrid(side, side), np.zeros((4, 4))], axis=-1)
    boxes = np.array([0, 0.0125, 0, 0.0125, 1, 0, 0, 0]), np.array([0.0125, 0.0125, 0, 0.0125, 1, 0, 0, 0])
    beside = flat + np.array([0.5, 0.0, 0.0])
    assert widest(flat, beside) == 0.0
    # The neighbourhood is a chord of the tube, and 0.0005 shorter than the arc.
    assert largest_cleared(flat, beside, boxes, 0.8) == pytest.approx(0.8, abs=6e-4)


def arc(radius, first, last):
    """A cubic patch (4, 4, 3) close to a piece of a cylinder."""
    handle = 4.0 / 3.0 * np.tan((last - first) / 4.0)
    ends = [np.array([np.cos(a), np.sin(a)]) for a in (first, last)]
    turned = [np.array([-np.sin(a), np.cos(a)]) for a in (first, last)]
    row = np.array([ends[0], ends[0] + handle * turned[0], ends[1] - handle * turned[1], ends[1]]) * radius
    height = np.linspace(0.0, radius * (last - first), 4)
    return np.stack([np.column_stack([row, np.full(4, z)]) for z in height])
