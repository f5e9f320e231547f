from types import SimpleNamespace

import numpy as np
import pytest

from pneumorph.geometry import Body, TubeSurface, starting_body


@pytest.fixture
def make_body():
    """A small body with one chamber; its control points may be moved along and about the axis."""

    def make(length=24.0, radius=8.0, chambers=((4.0, (0.0, 0.0), (3.0, 21.0), "flat"),), density=0.6):
        chamber = tuple(
            SimpleNamespace(name=name, radius=size, center=center, span=span, ends=ends)
            for name, (size, center, span, ends) in zip("ABC", chambers, strict=False)
        )
        spec = SimpleNamespace(length=length, radius=radius, control_density=density, ripple=None, chamber=chamber)
        return starting_body(spec)

    return make


@pytest.fixture
def table():
    """The limits of Table I."""

    def make(form="per_mm", envelope=12.0, **other):
        values = {
            "wall": 2.0,
            "fold": SimpleNamespace(distance=1.0, neighbourhood=2.0),
            "curvature": 0.3,
            "skew": 0.2,
            "stretch": SimpleNamespace(limit=0.1, form=form),
            "envelope": envelope and SimpleNamespace(radius=envelope),
        }
        return SimpleNamespace(**(values | other))

    return make


@pytest.fixture
def tube_from():
    """A tube through given points on the tensor grid of its Greville parameters (interpolation)."""

    def make(position, n_q, n_r, size, cavity=False):
        blank = TubeSurface("exterior", np.zeros((n_r, n_q, 3)), "flat", size, cavity)
        q, r = blank.basis_q.greville, blank.basis_r.greville
        wanted = position(*np.meshgrid(q, r))
        net = np.linalg.solve(blank.basis_r.matrix(r), wanted.reshape(n_r, -1)).reshape(n_r, n_q, 3)
        net = np.einsum("ij,rjc->ric", np.linalg.inv(blank.basis_q.matrix(q)), net)
        return TubeSurface("exterior", net, "flat", size, cavity)

    return make


@pytest.fixture
def waved():
    """Control points of a body moved at random, by smooth waves and by noise."""

    def move(body: Body, seed=0, wave=1.0, noise=0.05):
        rng = np.random.default_rng(seed)
        points = body.control_points().copy()
        around, up = np.arctan2(points[:, 1], points[:, 0]), points[:, 2]
        growth = wave * np.cos(up * 0.7 + rng.uniform(0, 6)) * (1.0 + 0.3 * np.cos(2 * around + rng.uniform(0, 6)))
        points[:, 0] += growth * np.cos(around)
        points[:, 1] += growth * np.sin(around)
        points += rng.normal(scale=noise, size=points.shape)
        for surface, where in zip(body.surfaces, body.slices, strict=True):
            net = points[where].reshape(surface.net.shape)
            net[[0, -1], :, 2] = surface.net[[0, -1], :, 2]
            points[where] = net.reshape(-1, 3)
        return points

    return move
