import functools
from dataclasses import replace

import jax
import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.tube.measures.formulas import Form, measures
from pneumorph.limits.tube.measures.grid import grid


def measured(surface, form: Form = "per_mm", per_span=(4, 4)):
    samples = grid(surface, per_span)
    return samples, measures(jnp.asarray(surface.net), samples, form)


def test_cylinder(make_body):
    for surface, radius in zip(make_body().surfaces, (8.0, 4.0), strict=True):
        _, found = measured(surface)
        np.testing.assert_allclose(found.curvature, 0.5 / radius**2, rtol=4e-2)  # a spline's peaks on its knots
        np.testing.assert_allclose(found.skew, 0.0, atol=1e-12)
        np.testing.assert_allclose(found.stretch, 0.0, atol=1e-5)
        np.testing.assert_allclose(found.area, 1.0, rtol=1e-3)


def test_torus(tube_from):
    big, small = 10.0, 3.0

    def position(q, r):
        # The outer half of a torus about z: r runs up its meridian.
        angle, around = np.pi * (r - 0.5), 2 * np.pi * q
        rho = big + small * np.cos(angle)
        return np.stack([rho * np.cos(around), rho * np.sin(around), small * np.sin(angle)], axis=-1)

    size = (2 * np.pi * big, np.pi * small)
    samples, found = measured(tube_from(position, 60, 30, size))
    angle = np.pi * (samples.r - 0.5)[:, None]
    rho = big + small * np.cos(angle)
    inner = slice(8, -8)
    wanted = 0.5 * (small**-2 + (np.cos(angle) / rho) ** 2) + np.zeros((1, len(samples.q)))
    np.testing.assert_allclose(found.curvature[inner], wanted[inner], rtol=1e-2)
    # E = (ρ/R)² and G = 1 per mm, so h₃ is the square of d ln ρ/ds = -sin(angle)/ρ.
    wanted = (np.sin(angle) / rho) ** 2 + np.zeros((1, len(samples.q)))
    np.testing.assert_allclose(found.stretch[inner], wanted[inner], atol=2e-4)
    np.testing.assert_allclose(found.area[inner], (rho / big + np.zeros((1, len(samples.q))))[inner], rtol=1e-3)


def test_sphere_with_poles_is_fair_up_to_its_poles(make_body):
    body = make_body(length=40.0, chambers=((5.0, (0.0, 0.0), (10.0, 20.0), "pole"),), density=2.0)
    _, found = measured(body.chambers[0])
    assert np.all(np.isfinite(np.concatenate([np.ravel(part) for part in found])))
    np.testing.assert_allclose(found.curvature, 1.0 / 25.0, rtol=3e-3)
    np.testing.assert_allclose(found.skew, 0.0, atol=1e-9)
    np.testing.assert_allclose(found.stretch, 0.0, atol=1e-9)
    np.testing.assert_allclose(found.area, 1.0, rtol=1e-5)


def test_ellipsoid_has_its_curvature_at_its_poles(make_body):
    # Half as wide across: an ellipsoid's curvature at the tip of its axis c is c/a².
    body = make_body(length=40.0, chambers=((5.0, (0.0, 0.0), (10.0, 20.0), "pole"),), density=2.0)
    surface = body.chambers[0]
    _, found = measured(replace(surface, net=surface.net * [0.5, 0.5, 1.0]))
    np.testing.assert_allclose(np.asarray(found.curvature)[[0, -1]], (5.0 / 2.5**2) ** 2, rtol=5e-3)


@pytest.mark.parametrize("seed", range(2))
def test_poles_are_measured_as_the_limit_of_their_neighbourhood(make_body, seed):
    body = make_body(length=40.0, chambers=((4.0, (0.0, 0.0), (8.0, 30.0), "pole"),), density=0.8)
    surface = body.chambers[0]
    net = surface.net + np.random.default_rng(seed).normal(scale=0.05, size=surface.net.shape)
    for pole, ring in ((0, 1), (-1, -2)):
        net[pole] = net[pole, 0]
        net[ring, :, 2] = net[pole, 0, 2]
    surface = replace(surface, net=net)
    samples, found = measured(surface)
    for row, sign in ((0, 1.0), (-1, -1.0), (3, 0.0)):
        near, nearer = (fundamental(surface, samples.q, samples.r[row] + sign * step) for step in (2e-5, 1e-5))
        for name in ("curvature", "skew"):
            limit = 2.0 * nearer[name] - near[name]
            np.testing.assert_allclose(getattr(found, name)[row], limit, rtol=1e-4, atol=1e-7)


def fundamental(surface, q, r):
    """h₁ and h₂ from the two fundamental forms, which are singular on a pole."""
    orders = ((1, 0), (0, 1), (2, 0), (1, 1), (0, 2))
    x_q, x_r, x_qq, x_qr, x_rr = (surface.points(q, np.full(len(q), r), *order) for order in orders)
    normal = np.cross(x_q, x_r)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    E, F, G = (np.sum(a * b, axis=1) for a, b in ((x_q, x_q), (x_q, x_r), (x_r, x_r)))
    L, M, N = (np.sum(a * normal, axis=1) for a in (x_qq, x_qr, x_rr))
    gauss = (L * N - M**2) / (E * G - F**2)
    mean = (E * N + G * L - 2 * F * M) / (2 * (E * G - F**2))
    return {"curvature": 2 * mean**2 - gauss, "skew": F**2 / (E * G)}


@pytest.mark.parametrize("pitch", [0.3, 1.0])
def test_known_skew(tube_from, pitch):
    def position(q, r):
        around = 2 * np.pi * (q + pitch * r * 20.0 / (2 * np.pi * 8.0))
        return np.stack([8 * np.cos(around), 8 * np.sin(around), 20.0 * r], axis=-1)

    _, found = measured(tube_from(position, 40, 20, (2 * np.pi * 8.0, 20.0)))
    # Unit tangents along q; along r the tangent leans by the pitch: F = pitch, G = 1 + pitch².
    np.testing.assert_allclose(found.skew, pitch**2 / (1.0 + pitch**2), rtol=1e-3)


def test_printed_stretch_is_equation_29_to_the_letter(make_body, waved):
    body = make_body()
    surface = body.with_control_points(waved(body)).exterior
    samples, found = measured(surface, "printed")
    (tau_q, tau_r), at = surface.size, (samples.q, samples.r)
    first = {"q": surface.sample(*at, 1, 0), "r": surface.sample(*at, 0, 1)}
    qq, qr, rr = surface.sample(*at, 2, 0), surface.sample(*at, 1, 1), surface.sample(*at, 0, 2)
    E, G = np.sum(first["q"] ** 2, axis=-1), np.sum(first["r"] ** 2, axis=-1)
    E_q, E_r = 2 * np.sum(first["q"] * qq, axis=-1), 2 * np.sum(first["q"] * qr, axis=-1)
    G_q, G_r = 2 * np.sum(first["r"] * qr, axis=-1), 2 * np.sum(first["r"] * rr, axis=-1)
    wanted = (E_q + E_r) ** 2 / (4 * tau_q**2 * E**2) + (G_q + G_r) ** 2 / (4 * tau_r**2 * G**2)
    np.testing.assert_allclose(found.stretch, wanted, rtol=1e-9)
    _, found = measured(surface)
    wanted = ((E_q / tau_q) ** 2 + (E_r / tau_r) ** 2) / (4 * E**2)
    wanted += ((G_q / tau_q) ** 2 + (G_r / tau_r) ** 2) / (4 * G**2)
    np.testing.assert_allclose(found.stretch, wanted, rtol=1e-9)


nets = st.one_of(
    st.builds(
        lambda seed, scale: np.random.default_rng(seed).normal(scale=scale, size=(7, 8, 3)),
        st.integers(0, 99),
        st.floats(0, 30),
    ),
    st.builds(lambda value: np.full((7, 8, 3), value), st.floats(-9, 9)),
    st.builds(
        lambda axis: np.where(np.arange(3) == axis, 0.0, np.random.default_rng(0).normal(size=(7, 8, 3))),
        st.integers(0, 2),
    ),
)


@functools.cache
def total_of(ends, form):
    samples = grid(TubeSurface("exterior", np.zeros((7, 8, 3)), (ends, ends), (20.0, 12.0), cavity=False), (2, 2))
    return jax.jit(jax.value_and_grad(lambda net: sum(jnp.sum(part) for part in measures(net, samples, form))))


@given(nets, st.sampled_from(["flat", "pole"]), st.sampled_from(["per_mm", "printed"]))
@settings(max_examples=50)
def test_folded_nets_give_numbers(net, ends, form):
    value, gradient = total_of(ends, form)(net)
    assert np.isfinite(value)
    assert np.all(np.isfinite(gradient))
