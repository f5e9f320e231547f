"""The tubes from which a design starts."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.body import Body
from pneumorph.geometry.bspline import clamped, periodic
from pneumorph.geometry.tube.surface import Ends, TubeSurface, dome_fit
from pneumorph.problem.columns import columns, columns_multiple

if TYPE_CHECKING:
    from pneumorph.problem import BodySpec, Ripple

Array = NDArray[np.float64]


def starting_body(spec: BodySpec) -> Body[TubeSurface]:
    """Build the tubes from which a design starts; the surfaces, not the control nets, have the given radii and lengths.

    Parameters
    ----------
    spec : BodySpec
        The problem's body: length, radius, control density, ripple and chambers.
    """

    def waves(ripple: Ripple | None) -> Callable[[Array, Array], Array]:
        if ripple is None:
            return lambda z, theta: np.zeros(np.broadcast(z, theta).shape)
        # z is measured on the body, not on the surface, so that all walls undulate in phase and symmetrically about
        # the body's middle.
        wave = 2.0 * np.pi / ripple.period
        return lambda z, theta: ripple.amplitude * np.cos(wave * (z - spec.length / 2.0) - ripple.lobes * theta)

    def cavity(tube: TubeSurface) -> TubeSurface:
        # The first column stays and q runs in the opposite sense, so that the normal points into the cavity.
        return replace(tube, cavity=True, net=tube.net[:, -np.arange(tube.net.shape[1])])

    multiple, density = columns_multiple(spec.symmetry), spec.control_density

    def tube(name: str, radius: float, center: tuple[float, float], span: tuple[float, float], ends: Ends, ripple):
        return _tube(name, radius, center, span, ends, density, columns(radius, density, multiple), waves(ripple))

    exterior = tube("exterior", spec.radius, (0.0, 0.0), (0.0, spec.length), "flat", spec.ripple)
    chambers = [
        tube(chamber.name, chamber.radius, chamber.center, chamber.span, chamber.ends, spec.ripple_of(chamber))
        for chamber in spec.chamber
    ]
    return Body(exterior, tuple(cavity(chamber) for chamber in chambers))


def _tube(
    name: str,
    radius: float,
    center: tuple[float, float],
    span: tuple[float, float],
    ends: Ends,
    density: float,
    n_q: int,
    ripple: Callable[[Array, Array], Array],
) -> TubeSurface:
    """A round tube about a line parallel to z, q running counter-clockwise."""
    length = span[1] - span[0] if ends == "flat" else _Capsule(radius, *span).arc_length
    circumference = 2.0 * np.pi * radius
    spans = max(4, round(density * length))
    profile = _flat_profile if ends == "flat" else _pole_profile
    angle = 2.0 * np.pi * periodic(n_q).greville
    rho, z = profile(radius, span, spans, lambda z: ripple(z[:, None], angle))
    # A periodic spline is smaller than the circle of its control points by this factor (its first Fourier eigenvalue).
    rho = rho / np.sinc(1.0 / n_q) ** 4
    net = np.empty((len(z), n_q, 3))
    net[..., 0] = center[0] + rho * np.cos(angle)
    net[..., 1] = center[1] + rho * np.sin(angle)
    net[..., 2] = z[:, None]
    return TubeSurface(name, net, ends, (circumference, length), cavity=False)


def _flat_profile(radius: float, span: tuple[float, float], spans: int, ripple: Callable) -> tuple[Array, Array]:
    """Control values of radius (n_r, n_q) and z (n_r,) of a straight tube: z linear in r, the radius interpolated."""
    basis = clamped(spans)
    z = span[0] + (span[1] - span[0]) * basis.greville
    rho = np.linalg.solve(basis.matrix(basis.greville), radius + ripple(z))
    return rho, z


def _pole_profile(radius: float, span: tuple[float, float], spans: int, ripple: Callable) -> tuple[Array, Array]:
    """Control values of radius (n_r, n_q) and z (n_r,) of a capsule, by least squares with exact poles and tangents."""
    basis = clamped(spans)
    t = np.linspace(0.0, 1.0, 16 * spans + 1)
    capsule = _Capsule(radius, *span)
    rho, z = capsule.at(t)
    rho = rho[:, None] * (1.0 + ripple(z) / radius)
    values = basis.matrix(t)
    fitted_z = np.repeat(span, [2, basis.count - 2])
    rest = z - values[:, [0, 1]].sum(axis=1) * span[0] - values[:, [-2, -1]].sum(axis=1) * span[1]
    fitted_z[2:-2] = np.linalg.lstsq(values[:, 2:-2], rest, rcond=None)[0]
    return dome_fit(basis, rho), fitted_z


@dataclass(frozen=True)
class _Capsule:
    """Meridian of a tube closed by domes: hemispheres, or flatter half ellipsoids if the span is too short for them."""

    radius: float
    base: float
    tip: float

    @cached_property
    def _meridian(self) -> tuple[Array, Array, Array]:
        """Arc length, radius and z (mm) at the points of a fine polygon."""
        height = min(self.radius, (self.tip - self.base) / 2.0)
        angle = np.linspace(0.0, np.pi / 2.0, 2000)
        rho = np.concatenate([self.radius * np.sin(angle), self.radius * np.sin(angle)[::-1]])
        dome = height * (1.0 - np.cos(angle))
        z = np.concatenate([self.base + dome, self.tip - dome[::-1]])
        s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(rho), np.diff(z)))])
        return s, rho, z

    @property
    def arc_length(self) -> float:
        return float(self._meridian[0][-1])

    def at(self, t: Array) -> tuple[Array, Array]:
        """Radius and z (mm) at fractions t of the arc length."""
        s, rho, z = self._meridian
        return np.interp(t * s[-1], s, rho), np.interp(t * s[-1], s, z)
