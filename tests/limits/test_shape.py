"""Compiled measures on samples and at points, and their derivatives, against JAX and difference quotients."""

from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest

from pneumorph.geometry.tube.bent import bent
from pneumorph.limits.tube.measures.derivatives import differentiate
from pneumorph.limits.tube.measures.formulas import measures, pointwise
from pneumorph.limits.tube.measures.grid import grid
from pneumorph.limits.tube.measures.pole_frame import frame
from pneumorph.limits.tube.measures.shape import differentiated, measured, measured_samples
from pneumorph.problem.axis import Arc, Axis


@pytest.fixture
def surfaces(make_body, waved):
    """An exterior, and chambers with poles, along z and about a bent axis, all far from their starts."""
    body = make_body(length=30.0, chambers=((4.0, (0.5, 0.0), (3.0, 27.0), "pole"),))
    body = body.with_control_points(waved(body, 2, wave=0.8, noise=0.1))
    net = body.chambers[0].net.copy()
    for pole, ring in ((0, 1), (-1, -2)):
        net[pole] = net[pole, 0]
        net[ring, :, 2] = net[pole, 0, 2]
    pole = replace(body.chambers[0], net=net)
    along = Axis(
        (
            Arc(length="12 mm", bend="70 deg", towards="20 deg"),
            Arc(length="18 mm", bend="30 deg", towards="110 deg"),
        )
    )
    curved = bent(make_body(length=30.0, chambers=((4.0, (0.5, 0.0), (3.0, 27.0), "pole"),)).chambers[0], along)
    net = curved.net + np.random.default_rng(1).normal(scale=0.1, size=curved.net.shape)
    for pole_row, ring, direction in ((0, 1, curved.directions[0]), (-1, -2, curved.directions[1])):
        net[pole_row] = net[pole_row, 0]
        net[ring] -= ((net[ring] - net[pole_row]) @ direction)[:, None] * np.array(direction)
    return {"flat": body.exterior, "pole": pole, "bent": replace(curved, net=net)}


@pytest.mark.parametrize("form", ["per_mm", "printed"])
@pytest.mark.parametrize("ends", ["flat", "pole", "bent"])
def test_samples_and_points_have_the_same_measures_as_the_grid(surfaces, ends, form):
    surface = surfaces[ends]
    samples = grid(surface, (4, 8))
    expected = np.array(measures(jnp.asarray(surface.net), samples, form))
    found = measured_samples(surface, samples, form)
    np.testing.assert_allclose(found, expected, rtol=1e-10, atol=1e-12)
    q, r = (np.tile(part.ravel(), 4) for part in np.meshgrid(samples.q, samples.r))
    kind = np.repeat(np.arange(4), len(q) // 4)
    np.testing.assert_allclose(measured(surface, kind, q, r, form), found.ravel(), rtol=1e-10, atol=1e-12)


@pytest.mark.parametrize("form", ["per_mm", "printed"])
@pytest.mark.parametrize("size", [1.0, 0.2, 0.005])
def test_derivatives_with_respect_to_tangents_equal_those_of_jax(form, size):
    rng = np.random.default_rng(3)
    tangents, slopes = size * rng.normal(size=(20, 5, 3)), np.empty((5, 3))
    shrink, slope, aspect = rng.uniform(0.1, 1.0, 20), rng.normal(size=20), 1.7

    def wanted(fields, S, S_r, kind):
        found = pointwise(tuple(fields[:, :, None, None]), S[None, None], S_r[None, None], aspect, form)
        return found[kind][0, 0]

    for kind in range(4):
        reference = jax.jit(jax.vmap(jax.value_and_grad(lambda *at, kind=kind: wanted(*at, kind))))
        values, gradients = reference(tangents, shrink, slope)
        for here, S, S_r, value, gradient in zip(tangents, shrink, slope, values, gradients, strict=True):
            assert differentiate(kind, here, S, S_r, aspect, form == "per_mm", slopes) == pytest.approx(float(value))
            np.testing.assert_allclose(slopes, gradient, atol=1e-11 * float(np.abs(gradient).max()) + 1e-300)


@pytest.mark.parametrize("form", ["per_mm", "printed"])
@pytest.mark.parametrize("ends", ["flat", "pole", "bent"])
def test_derivatives_with_respect_to_the_net_pass_a_taylor_test(surfaces, ends, form):
    surface, rng = surfaces[ends], np.random.default_rng(5)
    spans = surface.basis_r.spans
    near = [0.0, 1.0, 1e-9, 1.0 - 1e-7, 0.4 / spans, 1.0 - 0.4 / spans, 2.0 / spans]
    r = np.concatenate([rng.uniform(size=40), near])
    q, r = np.tile(rng.uniform(-0.5, 1.5, len(r)), 4), np.tile(r, 4)
    kind = np.repeat(np.arange(4), len(r) // 4)
    way = rng.normal(size=surface.net.shape)
    value, entry, number = differentiated(surface, kind, q, r, form)
    np.testing.assert_allclose(value, measured(surface, kind, q, r, form), rtol=1e-14)
    linear = np.sum(entry * way.ravel()[number], axis=1)
    errors = [
        np.abs(measured(replace(surface, net=surface.net + step * way), kind, q, r, form) - value - step * linear)
        for step in (2e-4, 1e-4)
    ]
    scale = np.abs(linear) * 1e-4 + 1e-4 * np.abs(value)
    assert np.all((errors[1] < 0.3 * errors[0]) | (errors[1] < 1e-6 * scale))
    for some in range(4):
        of_kind = kind == some
        ratio = np.median(errors[0][of_kind] / errors[1][of_kind])
        assert 3.8 < ratio < 4.2


def test_the_frame_is_that_of_quotients_by_the_circumference(surfaces):
    surface = surfaces["pole"]
    r = np.random.default_rng(0).uniform(0.02, 0.98, 30)
    B, B_r, B_rr = (surface.basis_r.matrix(r, order) / surface.size[1] ** order for order in range(3))
    S, S_r = ((part @ surface.parallels)[:, None] for part in (B, B_r))
    found = frame(surface, r)
    np.testing.assert_allclose(found.shrink, S, rtol=1e-13)
    np.testing.assert_allclose(found.slope, S_r, atol=1e-14)
    # A net that poles may have: x and y any but equal in the rows of the poles, z equal in pole and ring.
    inner = slice(1, -1)
    for part, wanted in zip(found[:4], (B / S, B_r, (B_r - B / S * S_r) / S, B_rr), strict=True):
        np.testing.assert_allclose(part[0][:, inner], wanted[:, inner], atol=1e-11)
        np.testing.assert_allclose(part[1][:, inner], wanted[:, inner], atol=1e-11)
    z = surface.net[:, 0, 2].copy()
    z[-1] = z[-2] = 0.0
    z[:2] = 0.0
    np.testing.assert_allclose(found.across[2] @ z, B @ z / S[:, 0] ** 2, rtol=1e-11, atol=1e-11)
    np.testing.assert_allclose(found.along[2] @ z, B_r @ z / S[:, 0], rtol=1e-11, atol=1e-11)


@pytest.mark.parametrize("pole", [0.0, 1.0])
@pytest.mark.parametrize("ends", ["pole", "bent"])
def test_nothing_is_lost_near_a_pole(surfaces, ends, pole):
    surface = surfaces[ends]
    kind, q = np.arange(4), np.full(4, 0.3)
    at = measured(surface, kind, q, np.full(4, pole), "per_mm")
    for distance in (1e-5, 1e-7, 1e-9, 1e-12, 1e-15):
        near = measured(surface, kind, q, np.full(4, abs(pole - distance)), "per_mm")
        np.testing.assert_allclose(near, at, rtol=1e3 * distance + 1e-13)
