"""Tubes that are wound with fibres or covered by a sheet, against the infinitely long tube.

Far from its ends a closed tube under pressure has r(R), θ = Θ + γ Z, z = λ Z, for which

    Π = ∫ψ 2πR dR + 2πB W − p π r(A)² λ

per length is stationary: ψ of the rubber between the radii A and B, W per area of what is around it, and the volume
inside. It is found with polynomials for r(R), by formulas of its own in cylindrical coordinates.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from numpy.polynomial import chebyshev
from numpy.polynomial.legendre import leggauss

from pneumorph.analysis.bodies import mesh_of
from pneumorph.errors import ComputationError
from pneumorph.geometry.starting import body_of
from pneumorph.mechanics import NoEquilibrium, Tangent, configure, loads_of, mirrors_of, model_of, solve
from pneumorph.problem import Problem
from pneumorph.verify.verdict import Verdict, absolute, at_least, relative

INNER, OUTER, LENGTH = 4.5, 6.0, 60.0
SHEAR, BULK = 0.2, 2.0
STIFFNESS, PRESSURE = 50.0, 0.03
SIZE = 2.0

MAGIC = float(np.degrees(np.arctan(np.sqrt(2.0))))
"""54.7°: at this angle fibres that do not stretch balance the pressure in a closed tube alone, whatever it is."""

Around = Callable[[Array, Array, Array], Array]
"""W in N/mm by the stretch around the tube, the shear r γ, and the stretch λ along it."""


@dataclass(frozen=True)
class Motion:
    """Stretches around the exterior and along the tube, and its twist per length in rad/mm."""

    around: float
    along: float
    twist: float


def fibres(winding: float, families: int) -> Around:
    """Fibres at an angle in degrees."""
    sine, cosine = np.sin(np.radians(winding)), np.cos(np.radians(winding))

    def energy(around: Array, shear: Array, along: Array) -> Array:
        total = jnp.asarray(0.0)
        for hand in (1, -1)[:families]:
            stretch = jnp.sqrt((hand * around * sine + shear * cosine) ** 2 + (along * cosine) ** 2)
            total += STIFFNESS / 2 * (stretch - 1) ** 2
        return total

    return energy


def sheet(poisson: float) -> Around:
    """A sheet without shear, which is taut."""

    def energy(around: Array, shear: Array, along: Array) -> Array:
        a, b = around - 1, along - 1
        return STIFFNESS / (2 * (1 - poisson**2)) * (a * a + b * b + 2 * poisson * a * b)

    return energy


def long_tube(cover: Around, pressure: float = PRESSURE, degree: int = 6) -> Motion:
    """The motion of the infinite tube by Newton's method, with polynomials of this degree.

    Raises
    ------
    ComputationError
        If no equilibrium is found.
    """
    half, (nodes, weights) = (OUTER - INNER) / 2, leggauss(12)
    R = INNER + half * (1 + nodes)
    place = chebyshev.chebvander(nodes, degree)
    slope = np.stack([chebyshev.Chebyshev.basis(k).deriv()(nodes) for k in range(degree + 1)], axis=1) / half
    ends = chebyshev.chebvander(np.array([-1.0, 1.0]), degree)

    def energy(unknown: Array) -> Array:
        shape, twist, along = OUTER * unknown[:-2], unknown[-2] / OUTER, 1 + unknown[-1]
        r, stretch = R + place @ shape, 1 + slope @ shape
        J = stretch * r / R * along
        first = stretch**2 + (r / R) ** 2 + (r * twist) ** 2 + along**2
        density = SHEAR / 2 * (J ** (-2 / 3) * first - 3) + BULK / 2 * (J - 1) ** 2
        inside, outside = INNER + ends[0] @ shape, OUTER + ends[1] @ shape
        rubber = half * jnp.sum(weights * density * 2 * np.pi * R)
        around = 2 * np.pi * OUTER * cover(outside / OUTER, outside * twist, along)
        return rubber + around - pressure * np.pi * inside**2 * along

    slopes, curvatures = jax.grad(energy), jax.hessian(energy)
    unknowns = jnp.zeros(degree + 3)
    for _ in range(100):
        step = jnp.linalg.solve(curvatures(unknowns), -slopes(unknowns))
        unknowns = unknowns + step * jnp.minimum(1.0, 0.1 / jnp.abs(step).max())
        if jnp.abs(step).max() < 1e-10:
            outside = OUTER * (1 + ends[1] @ np.asarray(unknowns[:-2]))
            return Motion(float(outside / OUTER), 1 + float(unknowns[-1]), float(unknowns[-2]) / OUTER)
    raise ComputationError("the long tube has no equilibrium")


def _tube(mirror: tuple[str, ...] = (), **tables: Any) -> Problem:
    chamber = {"name": "A", "radius": f"{INNER} mm", "center": ["0 mm", "0 mm"], "span": ["3 mm", f"{LENGTH - 3} mm"]}
    rubber = {"model": "neo-hookean", "shear_modulus": f"{SHEAR} MPa", "bulk_modulus": f"{BULK} MPa"}
    body = {"length": f"{LENGTH} mm", "radius": f"{OUTER} mm", "control_density": "0.4 /mm", "chamber": [chamber]}
    return Problem.model_validate(
        {
            "material": {**rubber, "density": "1.1 g/cm^3"},
            "body": body | {"symmetry": {"mirror": list(mirror)}},
            "task": [{"name": "one", "pressure": {"A": "30 kPa"}, "objective": {"motion": "extension"}}],
            "limits": {"wall": "1 mm"},
            **tables,
        }
    )


def _solved(problem: Problem, size: float, pressure: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Nodes (N, 3) of the body, or of its half or quarter, their displacements (N, 3), and the plate's motion (6,)."""
    mesh = mesh_of(problem, body_of(problem), mirrors_of(problem), size).mesh
    model = model_of(problem, mesh)
    answer = solve(configure(model, mesh.points, loads_of(problem, model, {"A": pressure})), Tangent(model))
    if isinstance(answer, NoEquilibrium):
        raise ComputationError(answer.reason)
    return mesh.points, answer.u, answer.plate


def _of_the_middle(X: np.ndarray) -> np.ndarray:
    """Which nodes (N,) are on the exterior in the middle third of the length."""
    return (np.hypot(X[:, 0], X[:, 1]) > OUTER - 1e-2) & (np.abs(X[:, 2] - LENGTH / 2) < LENGTH / 6)


def _motion(X: np.ndarray, u: np.ndarray) -> Motion:
    """The mean motion of the middle."""
    on = _of_the_middle(X)
    X, x = X[on], (X + u)[on]
    turned = np.arctan2(X[:, 0] * x[:, 1] - X[:, 1] * x[:, 0], X[:, 0] * x[:, 0] + X[:, 1] * x[:, 1])
    along, twist = (np.polyfit(X[:, 2], values, 1)[0] for values in (x[:, 2], turned))
    return Motion(float(np.hypot(x[:, 0], x[:, 1]).mean() / OUTER), float(along), float(twist))


def magic_angle(
    windings: tuple[float, ...] = (35.0, MAGIC, 70.0), size: float = SIZE, tolerance: float = 5e-4
) -> Iterator[Verdict]:
    """Two families below, at and above the magic angle: the tube shortens, hardly moves, or extends."""
    for winding in windings:
        laid = {"name": "braid", "stiffness": f"{STIFFNESS} N/mm", "winding": f"{winding} deg"}
        X, u, _ = _solved(_tube(("xz", "yz"), fibres=[laid]), size, PRESSURE)
        ours, exact = _motion(X, u), long_tube(fibres(winding, 2))
        yield absolute(f"stretch along the tube, {winding:.1f}°", ours.along, exact.along, tolerance)
        yield absolute(f"stretch around the tube, {winding:.1f}°", ours.around, exact.around, tolerance)
        sense = np.sign(winding - MAGIC)
        if sense:
            word = "extension" if sense > 0 else "shortening"
            yield at_least(f"{word}, {winding:.1f}°", sense * (ours.along - 1), 0.05)
        else:
            yield absolute("extension at the magic angle", ours.along - 1, 0.0, 0.005)


def one_family(size: float = SIZE, tolerance: float = 5e-3) -> Iterator[Verdict]:
    """One family at 45°, a right-handed screw, makes the tube twist: the tip turns clockwise as seen from there."""
    laid = {"name": "helix", "stiffness": f"{STIFFNESS} N/mm", "winding": "45 deg", "families": 1}
    X, u, _ = _solved(_tube(fibres=[laid]), size, PRESSURE / 2)
    ours, exact = _motion(X, u), long_tube(fibres(45.0, 1), PRESSURE / 2)
    yield relative("twist per length, rad/mm", ours.twist, exact.twist, tolerance)
    yield absolute("stretch along the tube", ours.along, exact.along, 0.1 * tolerance)


def covered_tube(size: float = SIZE, tolerance: float = 5e-5) -> Iterator[Verdict]:
    """A sheet all around the tube."""
    laid = {"name": "sheet", "stiffness": f"{STIFFNESS} N/mm", "poisson": 0.3}
    X, u, _ = _solved(_tube(("xz", "yz"), membrane=[laid]), size, PRESSURE)
    ours, exact = _motion(X, u), long_tube(sheet(0.3))
    yield absolute("stretch along the tube", ours.along, exact.along, tolerance)
    yield absolute("stretch around the tube", ours.around, exact.around, tolerance)


def half_covered(size: float = SIZE, tolerance: float = 1e-2) -> Iterator[Verdict]:
    """A sheet on half of the tube, which bends to its side; fibres along that half, as in the theory of beams.

    Under a small force N on the axis, a beam of rubber and fibres with the stiffnesses EA, ES and EI about the axis
    has the curvature N·ES/(EA·EI − ES²). The fibres at x = B cos θ contribute k ∫ (1, x, x²) B dθ.
    """
    side: dict[str, Any] = {"angles": ["-90 deg", "90 deg"]}
    laid = {"name": "sheet", "stiffness": f"{STIFFNESS} N/mm"}
    _, _, plate = _solved(_tube(("xz",), membrane=[laid | side]), size, PRESSURE)
    yield at_least("rotation to the side of the sheet, rad", float(plate[4]), 0.03)
    stiffness, force = 2.0, 1e-3
    laid = {"name": "strands", "stiffness": f"{stiffness} N/mm", "winding": "0 deg", "families": 1}
    effector = {"force": ["0 N", "0 N", f"{force} N"]}
    X, u, _ = _solved(_tube(("xz",), fibres=[laid | side], end_effector=effector), size, 0.0)
    on = _of_the_middle(X)
    x, _, z = X[on].T
    # u_z is linear in x and z, but for their product.
    bent = np.linalg.lstsq(np.column_stack([np.ones_like(x), x, z, x * z]), u[on, 2], rcond=None)[0][3]
    young = 9 * BULK * SHEAR / (3 * BULK + SHEAR)
    EA = young * np.pi * (OUTER**2 - INNER**2) + stiffness * np.pi * OUTER
    ES = stiffness * 2 * OUTER**2
    EI = young * np.pi / 4 * (OUTER**4 - INNER**4) + stiffness * np.pi / 2 * OUTER**3
    exact = force * ES / (EA * EI - ES**2)
    yield relative("curvature of a beam with fibres on half of it, 1/mm", -float(bent), exact, tolerance)
