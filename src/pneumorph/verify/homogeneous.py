"""Uniaxial and equibiaxial tension of a block against closed forms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from scipy.optimize import root_scalar

from pneumorph.mechanics import Rubber, Tangent, build_loads, build_model, configure
from pneumorph.mechanics.material import energies
from pneumorph.verify.prescribed import equilibrium, prescribed, residual
from pneumorph.verify.solids import distorted_cube
from pneumorph.verify.verdict import Case, Verdict, relative

IsochoricStress = Callable[[np.ndarray], np.ndarray]
"""λ̄_i ∂ψ_iso/∂λ̄_i (3,) in MPa, as a function of the isochoric principal stretches (3,)."""

UNIAXIAL, EQUIBIAXIAL = (0,), (0, 1)


def neo_hookean(shear: float) -> IsochoricStress:
    """For ψ_iso = μ/2 (Ī₁ − 3)."""
    return lambda stretch: shear * stretch**2


def mooney_rivlin(c10: float, c01: float) -> IsochoricStress:
    """For ψ_iso = c₁₀ (Ī₁ − 3) + c₀₁ (Ī₂ − 3)."""
    return lambda stretch: 2 * c10 * stretch**2 - 2 * c01 * stretch**-2


def yeoh(c1: float, c2: float, c3: float) -> IsochoricStress:
    """For ψ_iso = Σ cᵢ (Ī₁ − 3)ⁱ."""

    def stress(stretch: np.ndarray) -> np.ndarray:
        excess = np.sum(stretch**2) - 3
        return 2 * (c1 + 2 * c2 * excess + 3 * c3 * excess**2) * stretch**2

    return stress


def gent(shear: float, limit: float) -> IsochoricStress:
    """For ψ_iso = −μ J_m/2 ln(1 − (Ī₁ − 3)/J_m)."""
    return lambda stretch: shear * limit / (limit - np.sum(stretch**2) + 3) * stretch**2


def arruda_boyce(shear: float, locking: float) -> IsochoricStress:
    """For the eight-chain model to fifth order, (18) of Arruda and Boyce (1993)."""

    def stress(stretch: np.ndarray) -> np.ndarray:
        chain = np.sum(stretch**2) / locking**2
        series = 1 / 2 + chain / 10 + 11 * chain**2 / 350 + 19 * chain**3 / 1750 + 519 * chain**4 / 134750
        return 2 * shear * series * stretch**2

    return stress


def ogden(*terms: tuple[float, float]) -> IsochoricStress:
    """For ψ_iso = Σ 2μᵢ/αᵢ² (Σ_k λ̄_k^αᵢ − 3), with terms (μᵢ, αᵢ)."""
    return lambda stretch: sum((2 * modulus / power * stretch**power for modulus, power in terms), 0 * stretch)


def cases() -> tuple[Case, ...]:
    """Uniaxial and equibiaxial tension for every rubber."""
    bulk, density = 4.80, 1.1e-9
    rubbers = (
        ("neo-Hookean", energies.neo_hookean, (0.49,), neo_hookean(0.49)),
        ("Mooney–Rivlin", energies.mooney_rivlin, (0.2, 0.05), mooney_rivlin(0.2, 0.05)),
        ("Yeoh", energies.yeoh, (0.24, 0.01, 0.001), yeoh(0.24, 0.01, 0.001)),
        ("Gent", energies.gent, (0.49, 12.0), gent(0.49, 12.0)),
        ("Arruda–Boyce", energies.arruda_boyce, (0.45, 2.5), arruda_boyce(0.45, 2.5)),
        ("Ogden", energies.ogden, (0.6, 1.3, -0.02, -2.0), ogden((0.6, 1.3), (-0.02, -2.0))),
    )
    source = "principal stresses of an isotropic hyperelastic solid (Holzapfel 2000, ch. 6), derived by hand"
    return tuple(
        Case(f"{word} {name}", partial(tension, Rubber(energy, (*own, bulk), density), isochoric, pulled), source)
        for name, energy, own, isochoric in rubbers
        for word, pulled in (("uniaxial", UNIAXIAL), ("equibiaxial", EQUIBIAXIAL))
    )


def tension(
    solid: Rubber,
    isochoric: IsochoricStress,
    pulled: tuple[int, ...],
    stretches: tuple[float, ...] = (0.8, 1.2, 1.5, 2.0),
) -> Iterator[Verdict]:
    """A unit cube with a distorted mesh, pulled along some axes, its other sides free.

    Parameters
    ----------
    solid : Rubber
    isochoric : IsochoricStress
        Of the same rubber.
    pulled : tuple of int
        The axes along which it is pulled.
    stretches : tuple of float
        Along these.
    """
    mesh = distorted_cube(2)
    X = mesh.points
    near, far = np.abs(X) < 1e-9, np.abs(X - 1) < 1e-9
    far[:, [axis for axis in range(3) if axis not in pulled]] = False
    built = build_model(mesh, solid, plate=False, supports=near | far)
    at = configure(built, X, build_loads(built, {}))
    tangent = Tangent(built)
    for stretch in stretches:
        start = X * (homogeneous(solid.parameters[-1], isochoric, pulled, stretch)[0] - 1)
        # The start is slightly wrong at the free sides, so that the solver has to find them.
        solution = equilibrium(at, tangent, prescribed(at, np.where(near | far, start, 0.99 * start)))
        forces = np.asarray(built.state(residual(at, solution)).u)[: len(X)]
        force = forces[far[:, 0], 0].sum()
        _, stress = homogeneous(solid.parameters[-1], isochoric, pulled, stretch)
        yield relative(f"nominal stress at stretch {stretch:g}, MPa", force, stress, 1e-9)


def homogeneous(
    bulk: float, isochoric: IsochoricStress, pulled: tuple[int, ...], stretch: float
) -> tuple[np.ndarray, float]:
    """Principal stretches (3,) and the nominal stress (MPa) along the first axis, with the other sides free.

    With s_i = λ̄_i ∂ψ_iso/∂λ̄_i the principal Cauchy stresses are (s_i − ⅓Σs)/J + κ(J − 1).

    Parameters
    ----------
    bulk : float
        κ, MPa.
    isochoric : IsochoricStress
    pulled : tuple of int
        The axes along which the body is pulled.
    stretch : float
        Along these.
    """

    def state(side: float) -> tuple[np.ndarray, np.ndarray, float]:
        principal = np.where(np.isin(range(3), pulled), stretch, side)
        J = float(principal.prod())
        s = isochoric(principal * J ** (-1 / 3))
        return principal, (s - s.mean()) / J + bulk * (J - 1), J

    # Near the stretch of the free sides of an incompressible body.
    side = stretch ** (-len(pulled) / (3 - len(pulled)))
    bracket = (0.75 * side, 1.3 * side)
    side = root_scalar(lambda side: state(side)[1][2], bracket=bracket, xtol=1e-15).root
    principal, cauchy, J = state(side)
    return principal, float(cauchy[0] * J / principal[0])
