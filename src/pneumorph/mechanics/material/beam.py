"""Young's modulus of a rubber from a strip that is clamped at one end and bends under its own weight.

A geometrically exact plane beam (E. Reissner, Journal of Applied Mathematics and Physics 23 (1972) 795): sections may
turn by any angle, and shear and stretch. With the angle θ below the horizontal and the weight W(s) of all that is
farther out, at the undeformed length s,

    EI θ' = M,   M' = −W x',   x' = (1 + ε) cos θ − γ sin θ,   d' = (1 + ε) sin θ + γ cos θ,

    ε = W sin θ / EA,   γ = W cos θ / kGA,

where x is horizontal and d downwards. The rubber is incompressible, G = E/3, and k is that of a rectangle (G. R.
Cowper, Journal of Applied Mechanics 33 (1966) 335). Together this is an equation for the angle alone,

    EI θ'' + W cos θ + W² sin θ cos θ (1/EA − 1/kGA) = 0,   θ'(L) = 0,

which Newton's method solves in finite differences.
"""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np
from scipy.integrate import cumulative_trapezoid
from scipy.linalg import solve_banded
from scipy.optimize import least_squares, root_scalar
from scipy.special import stdtrit

SHEAR = 10.0 * 1.5 / (12.0 + 11.0 * 0.5)
"""k of a rectangle of an incompressible rubber."""

SOFTEST, STIFFEST = 3.0, 1e9
"""Young's moduli between which one is sought, over the stress ρgL of the strip's weight if it hung vertically."""

POINTS = 801
"""Of a computed centre line, so close that what is between them makes no difference."""

MOST_STEPS, ENOUGH = 60, 1e-12
"""Most Newton steps, and the largest change of an angle after which there are no more."""

FEWEST_FOR_TILT = 5
"""Points from which the angle of the clamp is found too."""


@dataclass(frozen=True)
class Strip:
    """A strip that is clamped at one end, horizontally but for `tilt`.

    Attributes
    ----------
    length : float
        Of its free part, mm.
    width, thickness : float
        Of its rectangular section, mm; the thickness is in the vertical plane.
    density : float
        t/mm³.
    gravity : float
        mm/s².
    load : float
        A weight at the tip, N.
    tilt : float
        Angle of the clamp below the horizontal, rad.
    """

    length: float
    width: float
    thickness: float
    density: float
    gravity: float
    load: float = 0.0
    tilt: float = 0.0


def centre_line(strip: Strip, young: float) -> np.ndarray:
    """The centre line (n, 2) from the clamp to the tip: horizontal distances and depths below the clamp, mm.

    Parameters
    ----------
    strip : the strip.
    young : Young's modulus, MPa.
    """
    length, slenderness = strip.length, (strip.length / strip.thickness) ** 2
    section = strip.width * strip.thickness
    stiffness = young * section * strip.thickness**2 / 12.0
    weight = strip.density * strip.gravity * section * length**3 / stiffness
    load = strip.load * length**2 / stiffness
    stretch, shear = 12.0 * slenderness, 4.0 * SHEAR * slenderness

    s = np.linspace(0.0, 1.0, POINTS)
    outer, step = weight * (1.0 - s) + load, s[1]
    turned = outer**2 * (1.0 / stretch - 1.0 / shear)
    angle = np.full(POINTS, strip.tilt)
    for _ in range(MOST_STEPS):
        # The node beyond the tip is the image of the one before it.
        beyond = np.append(angle[2:], angle[-2])
        rest = (angle[:-1] - 2.0 * angle[1:] + beyond) / step**2
        rest += outer[1:] * np.cos(angle[1:]) + turned[1:] * np.sin(2.0 * angle[1:]) / 2.0
        bands = np.full((3, POINTS - 1), 1.0 / step**2)
        bands[1] = -2.0 / step**2 - outer[1:] * np.sin(angle[1:]) + turned[1:] * np.cos(2.0 * angle[1:])
        bands[2, -2] = 2.0 / step**2
        # From above the solution, steps decrease monotonically towards it; no angle is beyond the vertical.
        new = np.minimum(angle[1:] - solve_banded((1, 1), bands, rest), 0.5 * np.pi)
        change, angle[1:] = float(np.abs(new - angle[1:]).max()), new
        if change < ENOUGH:
            break
    along, across = 1.0 + outer * np.sin(angle) / stretch, outer * np.cos(angle) / shear
    out = along * np.cos(angle) - across * np.sin(angle)
    down = along * np.sin(angle) + across * np.cos(angle)
    return length * cumulative_trapezoid(np.column_stack([out, down]), s, axis=0, initial=0.0)


def deflection(strip: Strip, young: float) -> float:
    """How far the tip hangs below the clamp, mm."""
    return float(centre_line(strip, young)[-1, 1])


@dataclass(frozen=True)
class BeamModulus:
    """A modulus from a strip.

    Attributes
    ----------
    young : float
        MPa.
    deviation : float
        Relative standard deviation: of the reading, the sizes and the density together.
    strip : Strip
        With the angle of the clamp that was found.
    misfit : float
        Root mean square of the distances of measured points from the centre line, mm; 0 for a deflection alone.
    """

    young: float
    deviation: float
    strip: Strip
    misfit: float = 0.0


SIZES = {"length": 0.5, "width": 0.1, "thickness": 0.1}
"""Standard deviations of the sizes of a strip, mm: the length ends at the edge of a clamp, the section is measured by a
calliper on a soft body."""

DENSITY = 0.01
"""Relative standard deviation of the density."""


def from_deflection(strip: Strip, measured: float, error: float) -> BeamModulus:
    """The modulus with which the tip of a strip hangs down by a measured deflection.

    Parameters
    ----------
    strip : the strip.
    measured : how far its tip is below the clamp, mm.
    error : standard deviation of that, mm.

    Raises
    ------
    ValueError
        If no modulus has that deflection.
    """

    def young(strip: Strip, measured: float) -> float:
        def off(logarithm: float) -> float:
            return deflection(strip, float(np.exp(logarithm))) - measured

        least, most = _logarithms(strip)
        return math.exp(root_scalar(off, bracket=(least, most), xtol=1e-10).root)

    found = young(strip, measured)
    step = 1e-3
    by_reading = np.log(young(strip, measured * (1 + step)) / found) / step * error / measured
    others = _by_sizes(strip, lambda other: young(other, measured), found)
    return BeamModulus(found, float(np.hypot(by_reading, others)), strip)


def from_points(strip: Strip, points: np.ndarray) -> BeamModulus:
    """The modulus, and with enough points the angle of the clamp, whose centre line is nearest to measured points.

    Parameters
    ----------
    strip : the strip; its tilt is where the search begins.
    points : (n, 2) mm
        Horizontal distances from the clamp and depths below it, of at least two points.

    Raises
    ------
    ValueError
        If no modulus fits.
    """
    tilted = len(points) >= FEWEST_FOR_TILT

    def at(parameters: np.ndarray, strip: Strip = strip) -> tuple[Strip, float]:
        return replace(strip, tilt=float(parameters[1])) if tilted else strip, float(np.exp(parameters[0]))

    def distances(parameters: np.ndarray) -> np.ndarray:
        return _distances(centre_line(*at(parameters)), points)

    deepest = float(points[:, 1].max())
    begin = np.log(from_deflection(strip, min(max(deepest, 1e-3), 0.95 * strip.length), 0.0).young)
    softest, stiffest = _logarithms(strip)
    start, least, most = [begin, strip.tilt], [softest, -0.7], [stiffest, 0.7]
    count = 2 if tilted else 1
    answer = least_squares(distances, start[:count], bounds=(least[:count], most[:count]), x_scale=0.1, diff_step=1e-4)
    fitted, young = at(answer.x)
    free = max(len(points) - count, 1)
    square = float(np.sum(answer.fun**2)) / free
    covariance = square * np.linalg.inv(answer.jac.T @ answer.jac)
    # Of 95 % as of a normal distribution, whatever the number of points.
    wider = float(stdtrit(free, 0.975)) / 1.96

    def again(other: Strip) -> float:
        # To first order: the change of the line at the fitted parameters is made up for by others.
        moved = _distances(centre_line(replace(other, tilt=fitted.tilt), young), points)
        change = np.linalg.lstsq(answer.jac, answer.fun - moved, rcond=None)[0][0]
        return young * float(np.exp(change))

    others = _by_sizes(fitted, again, young)
    by_points = wider * float(np.sqrt(covariance[0, 0]))
    return BeamModulus(young, float(np.hypot(by_points, others)), fitted, float(np.sqrt(np.mean(answer.fun**2))))


def _logarithms(strip: Strip) -> tuple[float, float]:
    """Of the least and the largest modulus that is sought."""
    own = strip.density * strip.gravity * strip.length
    return float(np.log(SOFTEST * own)), float(np.log(STIFFEST * own))


def _by_sizes(strip: Strip, young: Callable[[Strip], float], found: float) -> float:
    """Relative deviation of the modulus by the sizes and the density of the strip."""
    relative = {name: size / getattr(strip, name) for name, size in SIZES.items()} | {"density": DENSITY}
    step = 1e-3
    parts = [
        np.log(young(replace(strip, **{name: getattr(strip, name) * (1 + step)})) / found) / step * size
        for name, size in relative.items()
    ]
    return float(np.linalg.norm(parts))


def _distances(line: np.ndarray, points: np.ndarray) -> np.ndarray:
    """Distances (n,) of points from a line of many short pieces, positive below it; it goes on straight at its ends."""
    ahead = line[-1] + (line[-1] - line[-2]) * POINTS
    behind = line[0] - (line[1] - line[0]) * POINTS
    line = np.vstack([behind, line, ahead])
    piece = np.diff(line, axis=0)
    square = np.sum(piece**2, axis=1)
    along = np.clip(np.einsum("npk,pk->np", points[:, None] - line[None, :-1], piece) / square, 0.0, 1.0)
    off = points[:, None] - (line[None, :-1] + along[..., None] * piece[None])
    nearest = np.argmin(np.sum(off**2, axis=2), axis=1)
    rows = np.arange(len(points))
    tangent, normal = piece[nearest] / np.sqrt(square[nearest])[:, None], off[rows, nearest]
    return tangent[:, 0] * normal[:, 1] - tangent[:, 1] * normal[:, 0]
