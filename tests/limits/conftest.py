import numpy as np
import pytest

from pneumorph.geometry import Body
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.problem import BodySpec, Limits


@pytest.fixture
def make_body():
    """A small body with one chamber or several."""

    def make(length=24.0, radius=8.0, chambers=((4.0, (0.0, 0.0), (3.0, 21.0), "flat"),), density=0.6, ripple=None):
        table = {
            "length": f"{length} mm",
            "radius": f"{radius} mm",
            "control_density": f"{density} /mm",
            "chamber": [
                {
                    "name": name,
                    "radius": f"{size} mm",
                    "center": [f"{part} mm" for part in center],
                    "span": [f"{part} mm" for part in span],
                    "ends": ends,
                }
                for name, (size, center, span, ends) in zip("ABC", chambers, strict=False)
            ],
        }
        if ripple:
            table["ripple"] = {"amplitude": f"{ripple[0]} mm", "period": f"{ripple[1]} mm"}
        return starting_body(BodySpec.model_validate(table))

    return make


@pytest.fixture
def table():
    """The limits of Table I, and others of a test's choice."""

    def make(form="per_mm", envelope=12.0, wall=2.0):
        values = {"wall": f"{wall} mm", "stretch": {"limit": "0.1 /mm^2", "form": form}}
        if envelope:
            values["envelope"] = {"radius": f"{envelope} mm"}
        return Limits.model_validate(values)

    return make


@pytest.fixture
def tube_from():
    """A tube through given points on the tensor grid of its Greville parameters (interpolation)."""

    def make(position, n_q, n_r, size, cavity=False):
        blank = TubeSurface("exterior", np.zeros((n_r, n_q, 3)), ("flat", "flat"), size, cavity)
        q, r = blank.basis_q.greville, blank.basis_r.greville
        wanted = position(*np.meshgrid(q, r))
        net = np.linalg.solve(blank.basis_r.matrix(r), wanted.reshape(n_r, -1)).reshape(n_r, n_q, 3)
        net = np.einsum("ij,rjc->ric", np.linalg.inv(blank.basis_q.matrix(q)), net)
        return TubeSurface("exterior", net, ("flat", "flat"), size, cavity)

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
