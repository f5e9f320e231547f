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
from pneumorph.geometry.tube.bent import bent
from pneumorph.geometry.tube.fitted import FITTED, fitted
from pneumorph.geometry.tube.surface import Ends, TubeSurface, dome_fit
from pneumorph.problem.columns import columns, columns_multiple
from pneumorph.problem.outline import directions

if TYPE_CHECKING:
    from pneumorph.problem import BodySpec, Ripple
    from pneumorph.problem.body import ChamberSpec

Array = NDArray[np.float64]


def starting_body(spec: BodySpec) -> Body[TubeSurface]:
    """Build the tubes from which a design starts; the surfaces, not the control nets, have the given sizes.

    Parameters
    ----------
    spec : BodySpec
        The problem's body: length or axis, radius, control density, ripple and chambers.
    """

    def waves(ripple: Ripple | None) -> Callable[[Array, Array], Array]:
        if ripple is None:
            return lambda z, theta: np.zeros(np.broadcast(z, theta).shape)
        # z is measured on the body, not on the surface, so that all walls undulate in phase and symmetrically about
        # the body's middle.
        wave = 2.0 * np.pi / ripple.period
        return lambda z, theta: ripple.amplitude * np.cos(wave * (z - spec.length / 2.0) - ripple.lobes * theta)

    axis = spec.bent

    def placed(tube: TubeSurface) -> TubeSurface:
        return tube if axis is None else bent(tube, axis)

    def cavity(tube: TubeSurface) -> TubeSurface:
        # The first column stays and q runs in the opposite sense, so that the normal points into the cavity.
        return replace(tube, cavity=True, net=tube.net[:, -np.arange(tube.net.shape[1])])

    multiple, density = columns_multiple(spec.symmetry), spec.control_density

    exterior = _tube("exterior", spec, (0.0, 0.0), spec.extent, spec.domes, density, multiple, waves(spec.ripple))
    chambers = [
        _tube(each.name, each, each.center, each.span, each.domes, density, multiple, waves(spec.ripple_of(each)))
        for each in spec.chamber
    ]
    if spec.dome:
        capsule = _Capsule(spec.mean_radius, 0.0, spec.length, spec.domes)
        exterior = replace(exterior, bonded=capsule.narrowing(spec.bonded / spec.tip_radius))
    return Body(placed(exterior), tuple(cavity(placed(chamber)) for chamber in chambers))


def _tube(
    name: str,
    spec: BodySpec | ChamberSpec,
    center: tuple[float, float],
    span: tuple[float, float],
    domes: tuple[float, float],
    density: float,
    multiple: int,
    ripple: Callable[[Array, Array], Array],
) -> TubeSurface:
    """A tube about a line parallel to z, q running counter-clockwise; ends without a dome are flat."""
    radius = spec.mean_radius
    n_q = columns(radius, density, multiple)
    capsule = _Capsule(radius, *span, domes) if any(domes) else None
    length = span[1] - span[0] if capsule is None else capsule.arc_length
    spans = max(4, round(density * length))
    angle = 2.0 * np.pi * periodic(n_q).greville
    around, outwards = _outline(spec, n_q)
    if capsule is None:
        widths, waves, z = _flat_profile(span, spans, spec.taper, lambda z: ripple(z[:, None], angle))
    else:
        widths, waves, z = _pole_profile(capsule, spans, spec.taper, lambda z: ripple(z[:, None], angle))
    net = np.empty((len(z), n_q, 3))
    net[..., :2] = center + widths[..., None] * around + waves[..., None] * outwards
    net[..., 2] = z[:, None]
    ends: Ends = ("pole" if domes[0] else "flat", "pole" if domes[1] else "flat")
    return TubeSurface(name, net, ends, (2.0 * np.pi * radius, length), cavity=False)


def _outline(spec: BodySpec | ChamberSpec, n_q: int) -> tuple[Array, Array]:
    """Control points (n_q, 2) of a tube's outline about its axis, and of the unit normals on it."""
    basis = periodic(n_q)
    if spec.section is None:
        # A periodic spline is smaller than the circle of its control points by this factor (its first Fourier
        # eigenvalue).
        outwards = directions(2.0 * np.pi * basis.greville) / np.sinc(1.0 / n_q) ** 4
        return spec.radius * outwards, outwards
    around, share = fitted(spec.section.outline, basis), np.arange(FITTED * n_q) / (FITTED * n_q)
    values, along = basis.matrix(share), basis.matrix(share, 1) @ around
    normals = np.column_stack([along[:, 1], -along[:, 0]]) / np.linalg.norm(along, axis=1)[:, None]
    return around, np.asarray(np.linalg.lstsq(values, normals, rcond=None)[0], float)


def _flat_profile(
    span: tuple[float, float], spans: int, taper: float, ripple: Callable[[Array], Array]
) -> tuple[Array, Array, Array]:
    """Control values (n_r, 1) of the section's size, (n_r, n_q) of the ripple and (n_r,) of z, which is linear in r."""
    basis = clamped(spans)
    z = span[0] + (span[1] - span[0]) * basis.greville
    widths = 1.0 + (taper - 1.0) * basis.greville
    waves = np.asarray(np.linalg.solve(basis.matrix(basis.greville), ripple(z)), float)
    return widths[:, None], waves, z


def _pole_profile(
    capsule: _Capsule, spans: int, taper: float, ripple: Callable[[Array], Array]
) -> tuple[Array, Array, Array]:
    """The same of a capsule, whose ripple is in its size: by least squares with exact ends, poles with tangents."""
    basis, radius, base, tip = clamped(spans), capsule.radius, capsule.base, capsule.tip
    t = np.linspace(0.0, 1.0, 16 * spans + 1)
    rho, z = capsule.at(t)
    widths = (rho / radius * (1.0 + (taper - 1.0) * (z - base) / (tip - base)))[:, None]
    widths = widths * (1.0 + ripple(z) / radius)
    values = basis.matrix(t)
    # At a pole the row beside it has its z.
    low, high = (2 if pole else 1 for pole in capsule.poles)
    fitted_z = np.repeat([base, tip], [low, basis.count - low])
    rest = z - values[:, :low].sum(axis=1) * base - values[:, -high:].sum(axis=1) * tip
    fitted_z[low:-high] = np.linalg.lstsq(values[:, low:-high], rest, rcond=None)[0]
    return dome_fit(basis, widths, capsule.poles), np.zeros((1, 1)), fitted_z


_FINE = 2000
"""Points of the polygon of a dome's meridian."""


@dataclass(frozen=True)
class _Capsule:
    """Meridian of a tube from z = `base` to `tip`, closed by half ellipsoids of given heights, mm, or flat where 0."""

    radius: float
    base: float
    tip: float
    domes: tuple[float, float]

    @property
    def poles(self) -> tuple[bool, bool]:
        """Whether base and tip are closed by domes."""
        base, tip = self.domes
        return base > 0.0, tip > 0.0

    @cached_property
    def _meridian(self) -> tuple[Array, Array, Array]:
        """Arc length, radius and z (mm) at the points of a fine polygon."""
        # From an end inwards; a flat one is its rim alone.
        quarter, rim = np.linspace(0.0, np.pi / 2.0, _FINE), np.array([np.pi / 2.0])
        angles = [quarter if pole else rim for pole in self.poles]
        rho = np.concatenate([self.radius * np.sin(angles[0]), self.radius * np.sin(angles[1])[::-1]])
        depth = [height * (1.0 - np.cos(angle)) for height, angle in zip(self.domes, angles, strict=True)]
        z = np.concatenate([self.base + depth[0], self.tip - depth[1][::-1]])
        s = np.concatenate([[0.0], np.cumsum(np.hypot(np.diff(rho), np.diff(z)))])
        return s, rho, z

    @property
    def arc_length(self) -> float:
        return float(self._meridian[0][-1])

    def narrowing(self, share: float) -> float:
        """Fraction of the arc length at which the radius of the tip's dome is a share of the cylinder's."""
        s, rho, _ = self._meridian
        return float(np.interp(-share * self.radius, -rho[-_FINE:], s[-_FINE:]) / s[-1])

    def at(self, t: Array) -> tuple[Array, Array]:
        """Radius and z (mm) at fractions t of the arc length."""
        s, rho, z = self._meridian
        return np.interp(t * s[-1], s, rho), np.interp(t * s[-1], s, z)
