import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import cap_points, enclosed_volume

Q, R = np.linspace(0.0, 1.0, 181), np.linspace(0.0, 1.0, 211)


def test_a_tube_has_the_stated_counts(spec):
    exterior, chamber, _ = starting_body(spec()).surfaces
    assert exterior.net.shape == (51, 30, 3)
    assert chamber.net.shape == (47, 15, 3)
    assert 3 * (51 * 30 + 47 * 15) == 6705


@given(length=st.floats(60.0, 120.0), radius=st.floats(7.0, 12.0))
@settings(max_examples=10, suppress_health_check=[HealthCheck.function_scoped_fixture])
def test_circle_and_length_are_exact(spec, length, radius):
    body = starting_body(spec(length=length, radius=radius, chambers="A"))
    for surface, wanted, height in ((body.exterior, radius, length), (body.chambers[0], radius / 2, length - 6.0)):
        points = surface.sample(Q, R)
        distance = np.hypot(*np.moveaxis(points[..., :2] - surface.end_centres[0, :2], -1, 0))
        np.testing.assert_allclose(distance, wanted, rtol=1e-4 if surface.net.shape[1] >= 13 else 3e-4)
        rise = points[..., 2] - points[0, 0, 2] - height * R[:, None]
        np.testing.assert_allclose(rise, 0.0, atol=1e-12)
        np.testing.assert_allclose(enclosed_volume(surface), np.pi * wanted**2 * height, rtol=1e-5)


def test_ripples_are_in_phase_and_symmetric(spec):
    body = starting_body(spec(ripple=(0.2, 10.0)))
    for surface, radius in zip(body.surfaces[:2], (8.0, 4.0), strict=True):
        profile = surface.sample([0.0], R)[:, 0]
        wave = 0.2 * np.cos(2.0 * np.pi * (profile[:, 2] - 40.0) / 10.0)
        np.testing.assert_allclose(profile[:, 0], radius + wave, atol=2e-3)
        np.testing.assert_allclose(profile[:, 0], profile[::-1, 0], atol=1e-12)


def test_pole_ends_close_in_domes(spec):
    chamber = starting_body(spec()).chambers[1]
    assert np.ptp(chamber.net[0], axis=0).max() == np.ptp(chamber.net[-1], axis=0).max() == 0.0
    points = chamber.sample(Q, R) - [1.0, 2.0, 0.0]
    nearest = np.clip(points[..., 2], 13.0, 47.0)
    distance = np.sqrt(points[..., 0] ** 2 + points[..., 1] ** 2 + (points[..., 2] - nearest) ** 2)
    np.testing.assert_allclose(distance, 3.0, rtol=1e-2)
    np.testing.assert_allclose(points[[0, -1], 0, 2], [10.0, 50.0])
    np.testing.assert_allclose(enclosed_volume(chamber), np.pi * 9.0 * (34.0 + 4.0), rtol=1e-4)


def test_normals_point_from_solid_to_void(spec):
    body = starting_body(spec(ripple=(0.2, 10.0)))
    for surface in body.surfaces:
        inside = slice(20, -20)
        normal = np.cross(surface.sample(Q, R, dq=1), surface.sample(Q, R, dr=1))[inside]
        outward = surface.sample(Q, R)[inside] - [*surface.end_centres[0, :2], 0.0]
        flux = np.einsum("rqi,rqi->rq", normal[..., :2], outward[..., :2])
        assert np.all(flux < 0.0 if surface.cavity else flux > 0.0)


def test_pairs_and_grids_agree_and_derivatives_are_consistent(spec):
    rng = np.random.default_rng(1)
    body = starting_body(spec())
    body = body.with_control_points(body.control_points() + rng.normal(scale=0.3, size=(body.n_points, 3)))
    surface = body.exterior
    q, r = rng.uniform(size=5), rng.uniform(0.01, 0.99, size=7)
    grid_r, grid_q = np.meshgrid(r, q, indexing="ij")
    for dq, dr in ((0, 0), (1, 0), (0, 1), (2, 0), (1, 1), (0, 2)):
        pairs = surface.points(grid_q.ravel(), grid_r.ravel(), dq, dr)
        np.testing.assert_allclose(surface.sample(q, r, dq, dr).reshape(-1, 3), pairs, atol=1e-8)
    step = 1e-6
    np.testing.assert_allclose(
        surface.sample(q, r, 1, 1),
        (surface.sample(q + step, r, 0, 1) - surface.sample(q - step, r, 0, 1)) / (2 * step),
        rtol=1e-4,
        atol=1e-2,
    )


def test_control_points_round_trip(spec):
    body = starting_body(spec())
    points = np.random.default_rng(0).normal(size=(body.n_points, 3))
    moved = body.with_control_points(points)
    np.testing.assert_array_equal(moved.control_points(), points)
    for surface, where in zip(moved.surfaces, moved.slices, strict=True):
        np.testing.assert_array_equal(surface.net.reshape(-1, 3), points[where])
    with pytest.raises(ValueError, match="reshape"):
        body.with_control_points(points[1:])


def test_caps_blend_from_centre_to_rim(spec):
    body = starting_body(spec())
    points = np.random.default_rng(0).normal(size=(body.n_points, 3))
    exterior = body.with_control_points(points).exterior
    for tip, row in ((False, 0), (True, -1)):
        rim = exterior.sample(Q, [float(tip)])[0]
        np.testing.assert_allclose(cap_points(exterior, tip, Q, np.ones_like(Q)), rim, atol=1e-12)
        np.testing.assert_allclose(rim[:-1].mean(axis=0), exterior.net[row].mean(axis=0), atol=1e-12)
        halfway = (rim + exterior.end_centres[row]) / 2.0
        np.testing.assert_allclose(cap_points(exterior, tip, Q, np.full_like(Q, 0.5)), halfway, atol=1e-12)
