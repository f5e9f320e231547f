"""Bodies to mesh: short ones, so that the suite stays quick."""

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from pneumorph.geometry import Body
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.mesh import Morph
from pneumorph.mesh.tube import mesh_body
from pneumorph.problem import BodySpec, ChamberSpec, Ripple

LENGTH = 40.0
PERIOD = 10.0


def plain(*chambers: tuple[str, float, tuple[float, float], tuple[float, float]], ends: str = "flat") -> Body:
    """A tube of radius 8 mm with round chambers (name, radius, centre, span)."""
    chambers = chambers or (("A", 4.0, (0.0, 0.0), (3.0, LENGTH - 3.0)),)
    spec = BodySpec.model_construct(
        length=LENGTH,
        radius=8.0,
        chamber=tuple(
            ChamberSpec.model_construct(name=name, radius=radius, center=center, span=span, ends=ends)
            for name, radius, center, span in chambers
        ),
    )
    return starting_body(spec)


def shaped(body: Body, exterior: Callable, chamber: Callable) -> Body:
    """The body with other radii: functions of z that its surfaces interpolate."""

    def surface(tube: TubeSurface, radius: Callable) -> TubeSurface:
        basis, net = tube.basis_r, tube.net.copy()
        values = basis.matrix(basis.greville)
        wanted = np.linalg.solve(values, radius(values @ net[:, 0, 2])) / np.sinc(1 / net.shape[1]) ** 4
        net[..., :2] *= (wanted / np.linalg.norm(net[:, 0, :2], axis=1))[:, None, None]
        return replace(tube, net=net)

    return replace(
        body,
        exterior=surface(body.exterior, exterior),
        chambers=tuple(surface(tube, chamber) for tube in body.chambers),
    )


def wave(z: np.ndarray) -> np.ndarray:
    """One fold per period, fading towards both ends."""
    fade = 1 / (1 + np.exp(2 * (6 - z))) / (1 + np.exp(2 * (6 - (LENGTH - z))))
    return np.cos(2 * np.pi * (z - LENGTH / 2) / PERIOD) * fade


@pytest.fixture(scope="session")
def bellows() -> Body:
    """Deep folds in phase, the chamber 2.1 mm inside the exterior."""
    distance = np.linspace(-2.1, 2.1, 401)
    smoothing = np.linspace(-1, 1, 41)
    weights = 1 - np.abs(smoothing)

    def exterior(z: np.ndarray) -> np.ndarray:
        return 8 + 3 * wave(z)

    def chamber(z: np.ndarray) -> np.ndarray:
        z = z[:, None] + smoothing
        inside = exterior(z[..., None] + distance) - np.sqrt(np.maximum(0, 2.1**2 - distance**2))
        return inside.min(axis=-1) @ weights / weights.sum()

    return shaped(plain(), exterior, chamber)


@pytest.fixture(scope="session")
def thin_bellows() -> Body:
    """Folds in antiphase, the wall thin in the valleys."""
    return shaped(plain(), lambda z: 8 + 3 * wave(z), lambda z: 1.9 - wave(z))


@pytest.fixture(scope="session")
def parallel_folds() -> Body:
    """Folds of the exterior and of the chamber at the same heights, with walls of 2.8 mm across the axis."""
    return shaped(plain(), lambda z: 8 + 2.5 * wave(z), lambda z: 5.2 + 2.5 * wave(z))


@pytest.fixture(scope="session")
def tube() -> Body:
    return plain()


@pytest.fixture(scope="session")
def tube_morph(tube: Body) -> Morph:
    return mesh_body(tube, 3.0)


@pytest.fixture(scope="session")
def pole_tube() -> Body:
    return plain(ends="pole")


@pytest.fixture(scope="session")
def parallel() -> Body:
    return plain(("A", 2.0, (-4.0, 0.0), (3.0, LENGTH - 3.0)), ("B", 2.0, (4.0, 0.0), (3.0, LENGTH - 3.0)))


@pytest.fixture(scope="session")
def series() -> Body:
    return plain(("A", 4.0, (0.0, 0.0), (3.0, 18.5)), ("B", 4.0, (0.0, 0.0), (21.5, LENGTH - 3.0)))


@pytest.fixture
def ring() -> Body:
    """Four chambers on a circle."""
    ripple = Ripple.model_construct(amplitude=0.067, period=11.9)
    places = {"A": (4.604281, 0.0), "B": (0.0, 4.604281), "C": (-4.604281, 0.0), "D": (0.0, -4.604281)}
    chambers = tuple(
        ChamberSpec.model_construct(name=name, radius=1.828, center=place, span=(2.2, 33.79), ends="flat")
        for name, place in places.items()
    )
    return starting_body(
        BodySpec.model_construct(length=35.99, radius=8.76, control_density=0.712, ripple=ripple, chamber=chambers)
    )
