"""Limits on bodies from files: distances of triangles, what encloses displaced faces, certificates, and rows."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import KDTree
from solids import box, cylinder, problem, written

from pneumorph.geometry.lattice import deviations_of
from pneumorph.geometry.lattice.pieces import displaced, patches_of
from pneumorph.geometry.starting import body_of, space_of
from pneumorph.limits.lattice.beside import beside
from pneumorph.limits.lattice.neighbours import balls, close_pairs
from pneumorph.limits.lattice.parts import foremost
from pneumorph.limits.lattice.sampled import scalings
from pneumorph.limits.lattice.triangles import bowed_distances, distances
from pneumorph.limits.of_shape import lattice_limits, limits_of
from pneumorph.limits.table import ROWS
from pneumorph.optimize.smoothing import build_smoothing
from pneumorph.problem import loads
from pneumorph.problem.body import Symmetry
from pneumorph.symmetry.operations import operations

LIMITS = """
[design]
spacing = "5 mm"
[limits]
wall = "1.5 mm"
envelope = { radius = "13 mm" }
"""
STEPS = np.linspace(0.0, 1.0, 13)
GRID = np.array([[1 - u - v, u, v] for u in STEPS for v in STEPS if u + v <= 1 + 1e-12])

AFTER = np.roll(GRID, -1, axis=1)


@pytest.fixture(scope="module")
def folder(tmp_path_factory):
    """A file with a block that has a round void and a slot of 1.4 mm in its side."""
    where = tmp_path_factory.mktemp("limits")
    block = box((-8, -7, 0), (8, 7, 24)) - cylinder(3, 4, 20, x=-3)
    written(block - box((2, -9, 9), (9, 9, 10.4)), where / "block.step")
    return where


@pytest.fixture(scope="module")
def block(folder):
    asked = loads(problem("block.step", size="4 mm") + LIMITS, folder=folder)
    return asked, space_of(asked), limits_of(asked, body_of(asked))


def moved(space, seed, far):
    z = build_smoothing(space).apply(np.random.default_rng(seed).uniform(-1, 1, space.n))
    return space.body(space.start + far * z / np.abs(z).max())


def dense(surface):
    """Points of all triangles of a displaced surface, and where they are in the reference."""
    patches = patches_of(surface)
    count = len(patches.nodes)
    places = patches.places(np.repeat(np.arange(count), len(GRID)), np.tile(GRID, (count, 1)))
    return surface.lattice.weights(places) @ surface.net, places


CORNER = st.tuples(*[st.floats(-1, 1, width=16)] * 3)


@settings(max_examples=200, deadline=None)
@given(st.lists(CORNER, min_size=6, max_size=6), st.floats(-2, 2, width=16))
def test_distances_of_triangles(corners, apart):
    a, b = np.array(corners).reshape(2, 1, 3, 3)
    b = b + np.array([0, 0, apart])
    distance, u, v = distances(a, b, np.array([0]), np.array([0]))
    one, other = GRID @ a[0], GRID @ b[0]
    sampled = np.linalg.norm(one[:, None] - other, axis=2).min()
    assert distance[0] <= sampled + 1e-9
    gap = 3.0 * 0.5 * np.linalg.norm(np.ptp(np.concatenate([a[0], b[0]]), axis=0)) / (len(STEPS) - 1)
    assert distance[0] >= sampled - gap - 1e-9
    assert np.linalg.norm(u[0] @ a[0] - v[0] @ b[0]) == pytest.approx(distance[0], abs=1e-6)


@settings(max_examples=200, deadline=None)
@given(
    st.lists(CORNER, min_size=6, max_size=6), st.lists(CORNER, min_size=6, max_size=6), st.floats(0, 2), st.floats(0, 1)
)
def test_distances_of_triangles_that_bow(corners, bows, apart, by):
    x = np.array(corners).reshape(2, 1, 3, 3) + np.array([0, 0, apart]) * np.arange(2)[:, None, None, None]
    bow = by * np.array(bows).reshape(2, 1, 3, 3)
    first = np.zeros(1, int)
    _, u, v = distances(x[0], x[1], first, first)
    lower = bowed_distances(((x[0], bow[0], np.zeros(1)), (x[1], bow[1], np.zeros(1))), first, first, u, v)
    shapes = 4.0 * GRID * AFTER
    one, other = GRID @ x[0, 0] + shapes @ bow[0, 0], GRID @ x[1, 0] + shapes @ bow[1, 0]
    assert lower[0] <= np.linalg.norm(one[:, None] - other, axis=2).min() + 1e-9


def neighbours(X, map_of, neighbourhood):
    """The bound of `beside` for two flat triangles (3, 3) that a linear map moves, and the least sampled distance."""
    still = np.zeros(1)
    sides = [(part[None], still, part[None] @ map_of.T, still) for part in X]
    within, lower = np.zeros(1, bool), np.zeros(1)
    beside(*sides, (np.zeros(1, int), np.zeros(1, int), np.ones(1, bool)), neighbourhood, (within, lower))
    one, other = GRID @ X[0], GRID @ X[1]
    ways = one[:, None] - other
    counts = np.linalg.norm(ways, axis=2) >= neighbourhood
    assert not (within[0] and counts.any())
    return lower[0], np.linalg.norm(ways @ map_of.T, axis=2)[counts].min(initial=np.inf)


@settings(max_examples=200, deadline=None)
@given(st.lists(CORNER, min_size=6, max_size=6), st.lists(CORNER, min_size=3, max_size=3), st.floats(0, 2))
def test_distances_beyond_a_neighbourhood(corners, map_of, apart):
    X = np.array(corners).reshape(2, 3, 3) + apart * np.array([[[0, 0, 0]], [[1, 0, 0]]])
    lower, sampled = neighbours(X, np.eye(3) + np.array(map_of), 1.0)
    assert lower <= sampled + 1e-9


def test_distances_beyond_a_neighbourhood_err_by_the_square_of_the_size():
    unit = np.array([[0.0, 0.0, 0.0], [1.0, 0.2, 0.0], [0.1, 0.9, 0.1]])
    short = []
    for size in (0.2, 0.1, 0.05):
        X = np.stack([size * unit, np.array([1.0, 0.0, 0.0]) + size * (unit - 0.3)])
        lower, _ = neighbours(X, np.diag([0.6, 1.0, 1.0]), 1.0)
        short.append(0.6 - lower)
    assert 0.0 < short[2] < short[1] / 3.5 < short[0] / 12.0


@pytest.mark.parametrize(("seed", "far"), [(0, 0.5), (1, 2.0)])
def test_pieces_contain_their_points(block, seed, far):
    body = moved(block[1], seed, far)
    for surface in body.surfaces:
        shown = displaced(surface, patches_of(surface))
        pieces, errors = shown.pieces(), []
        for _ in range(3):
            inside = np.einsum("gc,ncb->ngb", GRID, pieces.bary).reshape(-1, 3)
            points = shown.at(np.repeat(pieces.patch, len(GRID)), inside).reshape(len(pieces.patch), -1, 3)
            away = np.linalg.norm(points - np.einsum("gc,ncb->ngb", GRID, pieces.x), axis=2).max(axis=1)
            assert (away <= pieces.error + 1e-9).all()
            bow, rest = shown.bows(pieces)
            bowed = np.einsum("gc,ncb->ngb", GRID, pieces.x) + np.einsum("ge,neb->ngb", 4 * GRID * AFTER, bow)
            assert (np.linalg.norm(points - bowed, axis=2).max(axis=1) <= rest + 1e-9).all()
            gradients = shown.gradients(shown.patches.places(np.repeat(pieces.patch, len(GRID)), inside))
            corners = shown.gradients(pieces.place.reshape(-1, 3)).reshape(-1, 3, 3, 3)
            differs = gradients.reshape(-1, len(GRID), 3, 3) - np.einsum("gc,ncij->ngij", GRID, corners)
            twisted = shown.twisted(pieces)
            assert (np.linalg.norm(differs, axis=(2, 3)).max(axis=1) <= twisted + 1e-9).all()
            errors.append([pieces.error.max(), rest.max(), twisted.max()])
            pieces = shown.divided(pieces)
        assert (np.array(errors[2]) > 0.0).all()
        assert (np.array(errors[2]) < np.array(errors[0]) / [14, 50, 14]).all()


def test_points_and_gradients_are_those_of_the_lattice(block):
    surface = moved(block[1], 2, 1.0).exterior
    places = dense(surface)[1][::50]
    shown = displaced(surface, patches_of(surface))
    np.testing.assert_allclose(shown.map(places), surface.lattice.weights(places) @ surface.net, atol=1e-12)
    for axis, order in enumerate(((1, 0, 0), (0, 1, 0), (0, 0, 1))):
        slope = surface.lattice.weights(places, order) @ surface.net
        np.testing.assert_allclose(shown.gradients(places)[:, :, axis], slope, atol=1e-12)


@pytest.mark.parametrize(("seed", "far"), [(3, 0.3), (4, 0.8)])
def test_certificates_contain_dense_samples(block, seed, far):
    _, space, limits = block
    body = moved(space, seed, far)
    report = limits.certify(body)
    points = [dense(surface) for surface in body.surfaces]
    # The faces of the file may be nearer than the triangles: on the exterior all are plane, of the void one is round.
    outer, inner = (np.repeat(margin, len(GRID)) for margin in limits.sampled(body).margins)
    assert outer.max() == inner.min() == 0.0 < inner.max()
    wall = (KDTree(points[0][0]).query(points[1][0])[0] - inner).min()
    assert report["wall"].value <= wall
    assert report["wall"].attained == pytest.approx(wall, abs=0.02)
    assert report["wall"].value == pytest.approx(report["wall"].attained, abs=0.02)
    radius = np.hypot(*points[0][0][:, :2].T).max()
    assert radius <= report["envelope"].value <= radius + 0.05
    found = [
        scalings(displaced(s, patches_of(s)).gradients(x)) for s, (_, x) in zip(body.surfaces, points, strict=True)
    ]
    least, largest = min(each[:, 0].min() for each in found), max(each[:, 1].max() for each in found)
    assert report["least scaling"].value <= least + 1e-12
    assert report["largest scaling"].value >= largest - 1e-12
    assert least > 0
    # The slot is the only fold; its sides are not near each other along the surface.
    x, places = points[0]
    below, above = (np.abs(places[:, 2] - z) < 1e-6 for z in (9.0, 10.4))
    inner = places[:, 0] > 5.0
    slot = KDTree(x[below & inner]).query(x[above & inner])[0].min()
    assert report["fold"].value <= slot


def test_a_slot_is_a_fold_and_flat_faces_are_none(folder):
    text = problem("block.step", size="4 mm") + LIMITS + 'fold = { distance = "1.6 mm", neighbourhood = "2.4 mm" }\n'
    asked = loads(text, folder=folder)
    body = body_of(asked)
    limits = limits_of(asked, body)
    report = limits.certify(body)
    assert report["fold"].value == pytest.approx(1.4, abs=1e-3)
    assert [each.limit for each in report.violated()] == ["fold"]
    places = report.places["fold"]
    assert set(places.surface_a) == {0}
    wider = loads(text.replace("1.6 mm", "1.3 mm"), folder=folder)
    assert limits_of(wider, body).certify(body).satisfied()


def test_distances_are_certified_without_the_deviation_of_the_triangles(block):
    asked, _, limits = block
    body = body_of(asked)
    found = deviations_of(asked)
    plane, curved = (each.max() for each in found)
    assert plane == 0.0 < 1e-4 < curved
    everywhere = [[np.full(len(each), by) for each in found] for by in (0.0, 0.15)]
    exact, far = (lattice_limits(body, asked.limits, asked.body.length, by).certify(body) for by in everywhere)
    for name in ("wall", "fold"):
        assert far[name].bound == exact[name].bound
        assert far[name].attained == pytest.approx(exact[name].attained - 0.6, abs=0.01)
    assert exact["wall"].satisfied()
    assert not far["wall"].satisfied()
    # The round void alone deviates, at which the wall begins.
    own = limits.certify(body)
    assert own["wall"].attained == pytest.approx(exact["wall"].attained - 2.0 * curved, abs=1.5 * curved)
    assert own["fold"].attained == pytest.approx(exact["fold"].attained, abs=1e-9)


def test_rows_are_derivatives(block):
    _, space, limits = block
    body = moved(space, 5, 0.8)
    step = 1e-4 * np.random.default_rng(6).normal(size=3 * space.reference.n_points)
    other = body.with_control_points(body.control_points() + step.reshape(-1, 3))
    rows = limits.rows(body, 3.0, -0.99)
    predicted = rows.value + rows.jacobian @ step
    again = limits.rows(other, 3.0, -0.99)
    for name in ("wall", "fold", "least scaling", "largest scaling", "envelope"):
        number = ROWS.index(name)
        assert (rows.kind == number).any(), name
        worst = [np.max(values[kind == number]) for values, kind in ((predicted, rows.kind), (again.value, again.kind))]
        before = rows.value[rows.kind == number].max()
        # Points that are closest on flat triangles are nearly so on the faces.
        share = 0.15 if name in ("wall", "fold") else 0.02
        assert worst[0] == pytest.approx(worst[1], abs=share * abs(worst[1] - before) + 1e-8), name


def test_hulls_contain_boxes(block):
    surface = moved(block[1], 7, 1.0).exterior
    shown = displaced(surface, patches_of(surface))
    draw = np.random.default_rng(8)
    width = surface.lattice.upper - surface.lattice.lower
    lower = surface.lattice.lower + width * draw.uniform(0.0, 0.8, (30, 3))
    upper = lower + width * draw.uniform(0.0, 0.2, (30, 3))
    directions = draw.normal(size=(20, 3))
    inside = lower[:, None] + (upper - lower)[:, None] * draw.uniform(0, 1, (30, 200, 3))
    reached = (shown.map(inside.reshape(-1, 3)) @ directions.T).reshape(30, 200, 20).max(axis=1)
    most = np.full((30, 20), -np.inf)
    for number, points in shown.hulls(lower, upper):
        most[number] = np.maximum(most[number], (points @ directions.T).max(axis=1))
    assert (reached <= most + 1e-12).all()
    assert (most - reached).mean() < 0.5 * np.linalg.norm(upper - lower, axis=1).mean()


@pytest.fixture(scope="module")
def opened(folder):
    """A block with a void that opens through a port in its base."""
    void = box((-5, -5, 4), (5, 4.5, 20)) + cylinder(2, -1, 5)
    written(box((-8, -7, 0), (8, 7, 24)) - void, folder / "open.step")
    port = '[[body.chamber]]\nname = "A"\ninside = ["0 mm", "0 mm", "12 mm"]\nport = "z = 0 mm"\n'
    asked = loads(problem("open.step", port, size="4 mm") + LIMITS.replace("13 mm", "30 mm"), folder=folder)
    return asked, space_of(asked), limits_of(asked, body_of(asked))


@pytest.mark.parametrize("far", [0.0, 0.6])
def test_walls_are_certified_up_to_the_rim_of_a_port(opened, far):
    """Between points of which the way over the rim, in the file, is at least twice the wall."""
    asked, space, limits = opened
    body = moved(space, 5, far) if far else space.reference
    reading = limits.certify(body)["wall"]
    (outer, at_outer), (inner, at_inner) = map(dense, body.surfaces)
    over = [np.maximum(np.hypot(np.hypot(*at.T[:2]) - 2.0, at[:, 2]), 0.0) for at in (at_outer, at_inner)]
    least = np.inf
    for point, way in zip(inner[::11], over[1][::11], strict=True):
        allowed = over[0] + way >= 2.0 * asked.limits.wall + 0.05
        least = min(least, np.linalg.norm(outer[allowed] - point, axis=1).min())
    assert reading.value <= least
    assert reading.attained == pytest.approx(least, rel=0.1)
    assert reading.satisfied()


def test_pairs_do_not_depend_on_the_design_for_which_they_were_kept(block):
    asked, space, known = block
    # Pairs are kept for the first design, serve for those near it, and are found again for the last ones.
    for seed, far, reach in ((1, 0.0, 0.5), (1, 0.1, 0.5), (2, 0.2, 0.3), (3, 1.5, 0.5), (3, 0.5, 2.0)):
        body = moved(space, seed, far)
        rows, alone = known.rows(body, reach, -0.3), limits_of(asked, space.reference).rows(body, reach, -0.3)
        assert np.array_equal(rows.value, alone.value) and np.array_equal(rows.jacobian.data, alone.jacobian.data)


@settings(max_examples=30, deadline=None)
@given(st.integers(0, 9), st.floats(0.0, 3.0), st.booleans())
def test_close_pairs_are_all_pairs_of_balls(seed, within, own):
    rng = np.random.default_rng(seed)
    one, other = (rng.uniform(-5, 5, (n, 1, 3)) + rng.uniform(-1, 1, (n, 3, 3)) for n in (40, 60))
    other = one if own else other + 4.0
    (here, small), (there, large) = balls(one), balls(other)
    away = np.linalg.norm(here[:, None] - there, axis=2) - small[:, None] - large
    i, j = np.nonzero((away <= within) & (np.triu(np.ones(away.shape, bool)) if own else True))
    found = close_pairs(one, other, within, own)
    assert np.array_equal(found[0], i) and np.array_equal(found[1], j)


def test_of_images_one_gets_a_row():
    group = operations(Symmetry(mirror=("xz", "yz")))
    places = np.random.default_rng(0).uniform(-1, 1, (200, 3))
    images = np.array([foremost(group, places @ operation.T, np.zeros(len(places))) for operation in group])
    assert (images.sum(axis=0) == 1).all()


def test_several_threads_find_the_same(block, request):
    _, space, limits = block
    body = moved(space, 3, 0.3)
    report, rows = limits.certify(body), limits.rows(body, 1.0, -0.5)
    request.getfixturevalue("three_threads")
    with_threads, rows_with_threads = limits.certify(body), limits.rows(body, 1.0, -0.5)
    assert with_threads.readings == report.readings
    np.testing.assert_array_equal(rows_with_threads.value, rows.value)
    assert abs(rows_with_threads.jacobian - rows.jacobian).max() == 0.0
