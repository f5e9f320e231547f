"""Linearised limits: they are what the report sees, and their derivatives are right."""

from dataclasses import replace

import numpy as np
import pytest
from certifying import certified

from pneumorph.limits.certify.places import NO_POINTS, Points
from pneumorph.limits.of_shape import tube_limits
from pneumorph.limits.table import BY_NAME, ROWS
from pneumorph.limits.tube.measures.distances import closest_on_edge, nearest_fold
from pneumorph.limits.tube.measures.shape import measured
from pneumorph.limits.tube.sampled import SampledTubes

CHAMBERS = {
    "flat": ((4.6, (0.5, 0.0), (3.0, 27.0), "flat"),),
    "two": ((2.2, (3.4, 0.0), (3.0, 27.0), "flat"), (2.2, (-3.4, 0.0), (4.0, 20.0), "pole")),
}


SQUARES = ("curvature", "skew", "stretch")


def squared(value):
    """By how much a square is beyond its bound whose row has this value."""
    return np.where(value > -1.0, (1.0 + value / 2.0) ** 2 - 1.0, (value - 0.5) / 2.0)


@pytest.mark.parametrize("chambers", CHAMBERS)
def test_rows_are_first_derivatives(make_body, table, waved, chambers):
    body = make_body(length=30.0, chambers=CHAMBERS[chambers])
    points = waved(body, 3, wave=0.6, noise=0.1)
    body = body.with_control_points(points)
    limits = tube_limits(body, table(envelope=8.5))
    here = limits.rows(body, 2.0, -0.9)
    # Smooth motions keep the same samples the worst of their cells nearly everywhere.
    way = 0.02 * np.sin(points[:, [1, 2, 0]] / 2.5) * np.where(points[:, 2:] % 30.0 < 1e-9, 0.0, 1.0)
    linear = here.jacobian @ way.ravel()
    errors = {}
    for step in (1.0, 0.5):
        there = limits.rows(body.with_control_points(points + step * way), 2.2, -0.95)
        known = {}
        for key, value in zip(zip(there.kind, there.cell, strict=True), there.value, strict=True):
            known.setdefault(key, []).append(value)
        for kind in np.unique(here.kind):
            some = np.flatnonzero(here.kind == kind)
            # A cell may have two rows of a kind: the one that is nearest is meant.
            remainder = [
                np.abs(np.array(known.get((kind, here.cell[i]), [np.nan])) - here.value[i] - step * linear[i]).min()
                for i in some
            ]
            errors.setdefault(ROWS[kind], []).append(float(np.nanmedian(remainder)))
    assert {"curvature", "wall", "envelope", "ends", "rim"} <= set(errors)
    for kind, (whole, half) in errors.items():
        assert half < 0.4 * whole or whole < 1e-6, (kind, whole, half)


def test_the_worst_rows_are_what_the_report_sees(make_body, table, waved):
    body = make_body(length=30.0, chambers=CHAMBERS["flat"])
    body = body.with_control_points(waved(body, 1, wave=1.2))
    spec = table(envelope=9.0)
    rows, found = tube_limits(body, spec).rows(body, 5.0, -0.99), certified(body, spec)
    for kind, sense in (("wall", -1.0), ("curvature", 1.0), ("stretch", 1.0), ("fold", -1.0)):
        reading = found[kind]
        value = float(rows.value[rows.kind == ROWS.index(kind)].max())
        worst = reading.bound * (1.0 + sense * (squared(value) if kind in SQUARES else value))
        if kind == "fold":  # far from its bound there is a safe value, not the exact one
            assert worst > reading.value
        else:
            assert worst == pytest.approx(reading.attained, rel=0.01), kind


def test_places_that_are_given_do_not_hide_worse_ones_beside_them(make_body, table, waved):
    body = make_body(length=30.0, chambers=CHAMBERS["flat"])
    body = body.with_control_points(waved(body, 1, wave=1.2))
    spec = table(wall=1.0).model_copy(update={"curvature": 0.05})
    limits, stretch = tube_limits(body, spec), ROWS.index("stretch")
    rows = limits.rows(body, 0.0, -0.5)
    surface, along = 1, limits.sampled(body).samples.spans[1][1]
    places = rows.places["stretch"]
    of_chamber = places.surface == surface
    worst = np.argmax(np.where(of_chamber, places.attained, -np.inf))
    # A quarter of a sample distance away: less than what two rows of a kind are apart at least.
    beside = places.at[worst] + np.array([0.0, 0.25 / (8 * along), 0.0])
    hiding = {name: NO_POINTS for name in rows.places}
    hiding["stretch"] = Points(np.array([surface]), beside[None], np.zeros(1), np.zeros(1))
    again = limits.rows(body, 0.0, -0.5, hiding)
    assert again.value[again.kind == stretch].max() == pytest.approx(rows.value[rows.kind == stretch].max(), abs=1e-9)


@pytest.mark.parametrize("seed", range(3))
def test_the_worst_rows_are_near_the_peaks_between_samples(make_body, table, waved, seed):
    body = make_body(length=30.0, chambers=CHAMBERS["flat"])
    body = body.with_control_points(waved(body, seed, wave=1.2))
    every = table(envelope=9.0)
    found = certified(body, every)
    # Bounds at what is attained: peaks are sought where values are near them.
    spec = every.model_copy(
        update={
            "curvature": found["curvature"].attained,
            "skew": found["skew"].attained,
            "stretch": every.stretch.model_copy(update={"limit": found["stretch"].attained}),
        }
    )
    rows, found = tube_limits(body, spec).rows(body, 5.0, -0.5), certified(body, spec)
    for kind in (*SQUARES, "envelope"):
        value = rows.value[rows.kind == ROWS.index(kind)].max()
        reading = found[kind]
        worst = reading.bound * (1.0 + squared(value)) if kind in SQUARES else reading.bound + value * spec.wall
        assert 0.999 * reading.attained < worst <= reading.value + 1e-9, kind


@pytest.mark.parametrize("seed", range(3))
def test_facing_walls_of_a_fold_are_measured_between_samples(make_body, table, seed):
    body = make_body(length=30.0, chambers=((2.5, (0.0, 0.0), (3.0, 27.0), "flat"),), ripple=(1.6, 5.0))
    points, outer = body.control_points(), body.slices[0]
    inside = np.abs(points[:, 2] - 15.0) < 14.9
    # The crests of the ripple are wider than its valleys, so that the walls between them are nearest in one place.
    moved = 1.3 * np.sin(4.0 * np.pi * points[outer, 2:] / 5.0) * [0.0, 0.0, 1.0]
    moved += np.random.default_rng(seed).normal(scale=0.15, size=moved.shape)
    points[outer] += moved * inside[outer, None]
    body, spec = body.with_control_points(points), table(envelope=30.0, wall=0.1)
    fold = spec.fold.model_copy(update={"distance": certified(body, spec)["fold"].attained})
    spec = spec.model_copy(update={"fold": fold})
    rows, found = tube_limits(body, spec).rows(body, 1.0, -0.5), certified(body, spec)["fold"]
    nearest = spec.fold.distance * (1.0 - rows.value[rows.kind == ROWS.index("fold")].max())
    assert found.value - 1e-9 <= nearest < 1.05 * found.attained


def test_places_that_are_given_are_rows_whatever_their_values(make_body, table, waved):
    body = make_body(length=30.0, chambers=CHAMBERS["flat"])
    body = body.with_control_points(waved(body, 1, wave=1.2))
    limits = tube_limits(body, table().model_copy(update={"curvature": 0.05}))
    places = limits.rows(body, 0.0, -0.5).places
    count = {name: len(found.at) for name, found in places.items()}
    assert count["curvature"] > 5
    again = limits.rows(body, 0.0, 1e9, places)
    for name, found in places.items():
        of_kind = again.kind == ROWS.index(name)
        assert np.count_nonzero(of_kind) == count[name]
        bound = {"curvature": 0.05, "skew": 0.2, "stretch": 0.1}.get(name, 1.0)
        value = squared(again.value[of_kind]) if name in SQUARES else again.value[of_kind]
        assert np.sort(value) == pytest.approx(np.sort(found.attained / bound - 1.0))


def test_places_that_a_certificate_finds_are_rows_with_what_it_has_seen(make_body, table, waved):
    body = make_body(length=30.0, chambers=((5.0, (0.0, 0.0), (1.5, 28.5), "flat"),))
    points = waved(body, 1, wave=1.8)
    # Chamber and exterior bulge through the planes of their ends, whose rows are flat.
    for part in body.slices:
        rim = np.min(np.abs(points[part][:, 2, None] - points[part][[0, -1], 2]), axis=1)
        beside = (rim > 1e-9) & (rim < 3.0)
        points[part][beside, 2] += 2.0 * np.sin(2.0 * np.arctan2(points[part][beside, 1], points[part][beside, 0]))
    body = body.with_control_points(points)
    spec = table(envelope=7.5)
    limits, found = tube_limits(body, spec), certified(body, spec)
    assert not len(limits.rows(body, -1e6, 1e9).value)
    rows = limits.rows(body, -1e6, 1e9, violated=found.places)
    places = found.places
    for name in ("wall", "planes", "fold", "rim", "ends", "envelope"):
        limit = BY_NAME[name]
        scale = {None: limit.read(spec), "wall": spec.wall, "fold": spec.fold.distance}[limit.per]
        beyond = (places[name].attained - limit.read(spec)) * (-1.0 if limit.at_least else 1.0) / scale
        value = rows.value[rows.kind == ROWS.index(name)]
        assert len(value) > 0, name
        assert np.sort(value) == pytest.approx(np.sort(beyond), rel=5e-3, abs=5e-3), name
    way = np.random.default_rng(2).normal(size=points.shape) * 1e-6
    way[np.min(np.abs(points[:, 2, None] - [0.0, 1.5, 28.5, 30.0]), axis=1) < 1e-9] = 0.0
    moved = limits.rows(body.with_control_points(points + way), -1e6, 1e9, violated=found.places)
    assert moved.value - rows.value == pytest.approx(rows.jacobian @ way.ravel(), rel=1e-4, abs=1e-9)


def test_a_wall_that_has_been_passed_is_told_by_its_sign(make_body, table):
    body = make_body(length=30.0, chambers=((4.0, (0.0, 0.0), (3.0, 27.0), "flat"),))
    limits = tube_limits(body, table())
    points = body.control_points()
    middle = np.abs(points[:, 2] - 15.0) < 5.0
    inner = np.arange(len(points)) >= body.slices[1].start
    points[inner & middle, :2] *= 2.15
    rows = limits.rows(body.with_control_points(points), 1.0, -0.3)
    assert float(rows.value[rows.kind == ROWS.index("wall")].max()) > 1.0


def test_what_lies_beyond_a_sharp_rim_has_not_been_passed(make_body, table):
    """The tube of the chamber is nearly level before its end disc, whose rim is below that of the exterior."""
    body = make_body(length=30.0, chambers=((4.0, (0.0, 0.0), (3.0, 27.0), "flat"),))
    limits = tube_limits(body, table())
    points = body.control_points()
    rim = (np.arange(len(points)) >= body.slices[1].start) & (np.abs(points[:, 2] - 27.0) < 1e-9)
    points[rim, :2] *= 7.5 / 4.0
    rows = limits.rows(body.with_control_points(points), 2.0, -0.9)
    wall = rows.value[rows.kind == ROWS.index("wall")]
    assert 0.0 < float(wall.max()) < 1.0


def test_measures_at_places_are_those_of_any_point_of_the_surface(make_body):
    body = make_body(length=30.0, chambers=((3.0, (0.5, 0.0), (3.0, 27.0), "pole"),))
    net = body.chambers[0].net.copy()
    net[2:-2] += np.random.default_rng(1).normal(scale=0.05, size=net[2:-2].shape)
    surface = replace(body.chambers[0], net=net)
    spans = surface.basis_r.spans
    r = np.array([0.3, 1.0, 1.5, 2.0, 7.4, spans - 1.0, spans - 0.4]) / spans
    q = np.linspace(0.05, 0.9, len(r))
    value = measured(surface, np.zeros(len(r), dtype=int), q, r, "per_mm")
    for one, place in zip(value, zip(q, r, strict=True), strict=True):
        assert one == pytest.approx(half_of_squared_curvatures(surface, *place), rel=1e-8)


def half_of_squared_curvatures(surface, q, r):
    """(k₁² + k₂²)/2 by the eigenvalues of the shape operator."""
    first = [surface.points([q], [r], *order)[0] for order in ((1, 0), (0, 1))]
    second = [surface.points([q], [r], *order)[0] for order in ((2, 0), (1, 1), (0, 2))]
    normal = np.cross(*first)
    normal /= np.linalg.norm(normal)
    metric = np.array([[a @ b for b in first] for a in first])
    bent = np.array([[second[i + j] @ normal for j in range(2)] for i in range(2)])
    return 0.5 * float(np.sum(np.linalg.eigvals(np.linalg.solve(metric, bent)).real ** 2))


@pytest.mark.parametrize("share", [0.3, 0.6])
def test_peaks_between_samples_that_are_far_below_them_are_found(make_body, table, share):
    body = make_body(length=30.0, chambers=CHAMBERS["flat"])
    net = body.exterior.net.copy()
    net[8, :, :2] *= 1.0 - 2.0 / 8.0
    net[9, :, :2] *= 1.0 - share * 2.0 / 8.0
    points = body.control_points().copy()
    points[body.slices[0]] = net.reshape(-1, 3)
    body, spec = body.with_control_points(points), table()
    for _ in range(2):  # certificates are accurate near a bound only
        worst = certified(body, spec)["stretch"].attained
        spec = spec.model_copy(update={"stretch": spec.stretch.model_copy(update={"limit": worst})})
    rows = tube_limits(body, spec).rows(body, 0.1, -0.3)
    assert -0.005 < rows.value[rows.kind == ROWS.index("stretch")].max() < 0.005


@pytest.mark.parametrize("seed", range(3))
def test_peaks_on_knot_lines_are_found(make_body, table, waved, seed):
    """Parabolas across the kink there expect them elsewhere."""
    body = make_body(length=30.0, chambers=CHAMBERS["flat"])
    body, spec = body.with_control_points(waved(body, seed, wave=0.6, noise=0.1)), table()
    for _ in range(2):  # certificates are accurate near a bound only
        worst = certified(body, spec)["stretch"].attained
        spec = spec.model_copy(update={"stretch": spec.stretch.model_copy(update={"limit": worst})})
    rows = tube_limits(body, spec).rows(body, 0.1, -0.3)
    assert -0.003 < rows.value[rows.kind == ROWS.index("stretch")].max() < 0.003


def test_folds_on_the_edge_of_the_neighbourhood_are_found_between_samples(make_body, table, waved):
    body = make_body(length=30.0, chambers=CHAMBERS["flat"])
    body = body.with_control_points(waved(body, 0, wave=0.6, noise=0.1))
    sampled, surface = tube_limits(body, table()).sampled(body), body.exterior
    assert isinstance(sampled, SampledTubes)
    tube = sampled.tubes[0]
    source = np.arange(len(tube.x))
    fold = nearest_fold(tube, 2.0, 2.0, source)
    edge = np.flatnonzero(np.isfinite(fold.distance) & ~fold.facing)
    assert len(edge) > 50
    before = fold.near[edge], fold.offset[edge], np.zeros((len(edge), 2))
    after = closest_on_edge(tube, 2.0, source[edge], *before[:2])

    def apart(near, offset, aside):
        """Distances in space and on the starting tube, which is a cylinder of 8 mm."""
        (row, column), (other, beside) = np.divmod(source[edge], tube.columns), np.divmod(near, tube.columns)
        q, r = tube.grid.q[column] + aside[:, 0] / surface.size[0], tube.grid.r[row] + aside[:, 1] / surface.size[1]
        to_q, to_r = (
            tube.grid.q[beside] + offset[:, 0] / surface.size[0],
            tube.grid.r[other] + offset[:, 1] / surface.size[1],
        )
        chord = surface.size[0] / np.pi * np.sin(np.pi * (to_q - q))
        gap = surface.points(to_q % 1.0, to_r) - surface.points(q % 1.0, r)
        return np.linalg.norm(gap, axis=1), np.hypot(chord, (to_r - r) * surface.size[1])

    (old, on_edge), (new, still) = apart(*before), apart(*after)
    assert on_edge == pytest.approx(2.0, abs=1e-6) and still == pytest.approx(2.0, abs=1e-6)
    assert (new < old + 0.01).all()
    assert np.median(old - new) > 0.005 and (old - new).max() > 0.02
