from dataclasses import replace

import jax.numpy as jnp
import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from pneumorph.geometry.regions import Cylinder, box
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.limits.certify.enclosed import Accuracy
from pneumorph.limits.tube import rim
from pneumorph.limits.tube.certify.cells import Bounds, Cells, knot_spans, recentred, refine, whole
from pneumorph.limits.tube.certify.hull_bounds import hull_bounds
from pneumorph.limits.tube.certify.shape_bounds import enclosed, polynomials
from pneumorph.limits.tube.certify.taylor import Taylor, modelled
from pneumorph.limits.tube.measures.formulas import measures
from pneumorph.limits.tube.measures.grid import grid
from pneumorph.limits.tube.measures.pole_frame import frame
from pneumorph.problem import BodySpec

BOUNDS = {"curvature": 0.3, "skew": 0.2, "stretch": 0.1, "area": -0.1}


def bounded(surface, form="per_mm", bounds=BOUNDS):
    accuracies = [
        Accuracy(bound, 1.01 * bound, 0.003 * abs(bound), 0.003 * abs(bound), 0.01) for bound in bounds.values()
    ]
    return dict(zip(BOUNDS, enclosed(surface, knot_spans(surface), form, accuracies, [-np.inf] * 4), strict=True))


def sampled(surface, form="per_mm"):
    found = measures(jnp.asarray(surface.net), grid(surface, (9, 15)), form)
    return {name: -float(found.area.min()) if name == "area" else float(getattr(found, name).max()) for name in BOUNDS}


def moved(ends, seed, wave, noise):
    """A chamber whose net is moved at random within the design space."""
    chamber = {"name": "A", "radius": "4 mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", "27 mm"], "ends": ends}
    table = {"length": "30 mm", "radius": "8 mm", "control_density": "0.6 /mm", "chamber": [chamber]}
    surface = starting_body(BodySpec.model_validate(table)).chambers[0]
    rng = np.random.default_rng(seed)
    net = surface.net * (1.0 + wave * np.cos(rng.uniform(0, 6) + 0.8 * surface.net[..., 2:]) * [1.0, 1.0, 0.0])
    net = net + rng.normal(scale=noise, size=net.shape)
    for end, ring in ((0, 1), (-1, -2)):
        net[end] = net[end, 0] if ends == "pole" else net[end] * [1, 1, 0] + [0, 0, net[end, 0, 2]]
        if ends == "pole":
            net[ring, :, 2] = net[end, 0, 2]
    return replace(surface, net=net)


@given(
    st.sampled_from(["flat", "pole"]),
    st.integers(0, 99),
    st.floats(0, 0.4),
    st.floats(0, 0.04),
    st.sampled_from(["per_mm", "printed"]),
)
@settings(max_examples=25, deadline=None)
def test_enclosures_contain_every_sample_and_are_tight_at_the_limit(ends, seed, wave, noise, form):
    surface = moved(ends, seed, wave, noise)
    dense = sampled(surface, form)
    # Limits right where the surface is.
    bounds = {name: value if abs(value) > 1e-3 else BOUNDS[name] for name, value in dense.items()}
    for name, found in bounded(surface, form, bounds).items():
        assert np.all(found.attained <= found.upper + 1e-12)
        assert dense[name] <= found.upper.max() + 1e-9
        assert found.upper.max() <= found.attained.max() + 0.0101 * abs(bounds[name]) + 0.01 * abs(found.attained.max())


def test_seen_values_are_attained_where_it_says():
    surface = moved("pole", 1, 0.3, 0.05)
    found = bounded(surface)["curvature"]
    k = int(np.argmax(found.attained))
    at = grid(surface, (1, 1))
    here = replace(
        at,
        q=found.at[k : k + 1, 0],
        r=found.at[k : k + 1, 1],
        values_q=tuple(surface.basis_q.matrix(found.at[k, 0], d) / surface.size[0] ** d for d in range(3)),
        frame=frame(surface, [found.at[k, 1]]),
    )
    assert float(measures(jnp.asarray(surface.net), here).curvature[0, 0]) == pytest.approx(found.attained[k], rel=0.02)


def test_a_pole_without_tangent_plane_is_never_within_a_limit():
    surface = moved("pole", 1, 0.0, 0.0)
    net = surface.net.copy()
    net[1, :, 2] += 0.2
    assert bounded(replace(surface, net=net))["curvature"].upper.max() == np.inf


def test_models_are_of_third_order():
    rng = np.random.default_rng(0)
    polynomials = rng.normal(size=(2, 4, 4)) / np.exp(np.add.outer(np.arange(4), np.arange(4)))
    polynomials[:, 0, 0] = 3.0
    widths = []
    for level in range(5):
        half = np.full((1, 2), 0.5 * 0.5**level)
        local = recentred(polynomials[..., None], Cells(np.zeros(1, dtype=int), np.full((1, 2), 0.4), half))
        a, b = modelled(local)
        # Zero, but for the rest.
        widths.append((a * b * b * b.inverse * a.inverse - a * b * a.inverse).c[6, 0])
    rates = np.log2(np.array(widths[:-1]) / widths[1:])
    assert rates[-1] == pytest.approx(3.0, abs=0.15)


@given(st.integers(0, 999))
@settings(max_examples=50, deadline=None)
def test_models_contain_products_and_quotients(seed):
    rng = np.random.default_rng(seed)
    a, b = np.append(rng.normal(size=(2, 6)), 0.1 * rng.uniform(size=(2, 1)), axis=1)
    b[0] += 8.0 * np.sign(b[0])
    s, t = rng.uniform(-1, 1, size=(2, 40))

    def polynomial(c, s, t):
        return c[0] + c[1] * s + c[2] * t + c[3] * s * s + c[4] * s * t + c[5] * t * t

    one, two = Taylor(a[:, None]), Taylor(b[:, None])
    for off_a, off_b in rng.uniform(-1, 1, size=(5, 2)):
        x, y = polynomial(a, s, t) + off_a * a[6], polynomial(b, s, t) + off_b * b[6]
        found = one * two, one + two, one - two * 2.0, two.inverse
        for model, exact in zip(found, (x * y, x + y, x - 2 * y, 1 / y), strict=True):
            assert model.bottom[0] - 1e-9 <= exact.min() and exact.max() <= model.top[0] + 1e-9
            c, rest = model.c[:6, 0], model.c[6, 0]
            if np.isfinite(rest):
                (value,), (at,) = model.highest_sample()
                assert np.all(np.abs(polynomial(c, s, t) - exact) <= rest + 1e-9)
                assert c[0] <= value <= max(polynomial(c, *at) - rest, c[0]) + 1e-12


def test_polynomials_are_the_surface():
    surface = moved("flat", 0, 0.2, 0.1)
    part = knot_spans(surface)
    made = polynomials(surface, part)
    k, u, v = 100, 0.3, 0.8
    powers = np.outer(v ** np.arange(4), u ** np.arange(4))
    q, r = part.q[k, 0] + u * part.q[k, 1], part.r[k, 0] + v * part.r[k, 1]
    np.testing.assert_allclose((part.x[k] * powers).sum(axis=(1, 2)), surface.points([q], [r])[0], atol=1e-12)
    slopes = np.concatenate([surface.points([q], [r], 1, 0)[0], surface.points([q], [r], 0, 1)[0]])
    scale = np.repeat(surface.size, 3)
    np.testing.assert_allclose((made.parts[k] * powers).sum(axis=(1, 2)), slopes / scale, atol=1e-11)


@pytest.mark.parametrize("seed", range(4))
def test_extents_contain_every_sample(seed):
    surface = moved("flat", seed, 0.3, 0.1)
    part, accuracy = knot_spans(surface), Accuracy(1.0, 1.02, 0.003, 0.003, 0.01)
    q, r = np.linspace(0, 1, 400), np.linspace(0, 1, 1001)
    x = surface.sample(q, r)
    widest = np.hypot(x[..., 0], x[..., 1]).max()

    def beyond(region, accuracy):
        read = lambda net: region.beyond(np.moveaxis(net, 1, -1))  # noqa: E731
        return hull_bounds(part.x, read, part, accuracy, -np.inf)

    widest -= 3.0
    found = beyond(Cylinder(3.0), accuracy)
    assert found.attained.max() <= widest + 1e-3
    assert widest <= found.upper.max() <= found.attained.max() + 0.02

    passed = np.maximum(4.0 - x[..., 2] - 4.0, x[..., 2] - 26.0).max()
    found = beyond(box((-np.inf, -np.inf, 0.0), (np.inf, np.inf, 26.0)), Accuracy(1.0, 1.0, 0.003, 0.003, 0.01))
    assert passed <= found.upper.max() + 1e-9
    assert found.upper.max() <= passed + 0.02

    share = np.minimum(r * surface.size[1] / 2.0, 1.0)[1:-1, None]
    heights = (x[1:-1, :, 2] - x[0, 0, 2]) / share, (x[-1, 0, 2] - x[1:-1, :, 2]) / share[::-1]
    for found, height in zip(
        rim.bounds(surface, part, 2.0, Accuracy(-1.0, -0.995, 0.003, 0.003, 0.01), -np.inf), heights, strict=True
    ):
        assert found.upper.max() >= -height.min() - 1e-9
        assert found.upper.max() <= -height.min() + 0.03


def test_torus(tube_from):
    big, small = 10.0, 3.0

    def position(q, r):
        angle, around = np.pi * (r - 0.5), 2 * np.pi * q
        rho = big + small * np.cos(angle)
        return np.stack([rho * np.cos(around), rho * np.sin(around), small * np.sin(angle)], axis=-1)

    surface: TubeSurface = tube_from(position, 60, 30, (2 * np.pi * big, np.pi * small))
    found = bounded(surface, bounds=BOUNDS | {"curvature": 0.06})["curvature"]
    inner = (found.at[:, 1] > 0.2) & (found.at[:, 1] < 0.8)
    exact = 0.5 * (small**-2 + (big + small) ** -2)
    assert exact * 0.99 <= found.upper[inner].max() <= exact * 1.02


def test_halves_of_cells_cover_them():
    seen = []

    def evaluate(cells):
        seen.append(cells)
        n = len(cells.span)
        vary = np.tile([1.0, 0.1], (n, 1)) if len(seen) == 1 else np.ones((n, 2))
        return Bounds(np.full((n, 1), 2.0), np.full((n, 1), -1.0 - len(seen)), np.zeros((n, 1, 2)), vary)

    upper, least, _ = refine(evaluate, whole(2), [Accuracy(1.0, 1.0, 0.1, 0.1, 0.1)], [-np.inf], 2)
    assert np.all(upper == 2.0) and np.all(least == -2.0)
    assert [len(cells.span) for cells in seen[:3]] == [2, 4, 16]
    for cells in seen:
        assert np.bincount(cells.span, np.prod(2.0 * cells.half, axis=1)) == pytest.approx(np.ones(2))
        assert np.all(cells.centre - cells.half >= 0.0) and np.all(cells.centre + cells.half <= 1.0)
        assert len(np.unique(np.column_stack([cells.span, cells.centre]), axis=0)) == len(cells.span)
