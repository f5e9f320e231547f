"""Uniaxial and equibiaxial tension of a block against closed forms."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from functools import partial

import numpy as np
from scipy.optimize import root_scalar

from pneumorph.mechanics import Rubber, Tangent, configuration, loads, model, rubber
from pneumorph.verify.prescribed import equilibrium, prescribed, residual
from pneumorph.verify.solids import distorted_cube
from pneumorph.verify.verdict import Case, Verdict, relative

Slopes = Callable[[np.ndarray], np.ndarray]
"""λ̄_i ∂ψ_iso/∂λ̄_i (3,) in MPa of the isochoric principal stretches (3,)."""

UNIAXIAL, EQUIBIAXIAL = (0,), (0, 1)


def neo_hookean(shear: float) -> Slopes:
    """Of ψ_iso = μ/2 (Ī₁ − 3)."""
    return lambda stretch: shear * stretch**2


def cases() -> tuple[Case, ...]:
    """Both tests for every rubber."""
    source = "principal stresses of an isotropic hyperelastic solid (Holzapfel 2000, ch. 6), derived by hand"
    return tuple(
        Case(f"{word} {name}", partial(tension, solid, slopes, pulled), source)
        for name, solid, slopes in (("neo-hookean", rubber(0.49, 4.80, 1.1e-9), neo_hookean(0.49)),)
        for word, pulled in (("uniaxial", UNIAXIAL), ("equibiaxial", EQUIBIAXIAL))
    )


def tension(
    solid: Rubber, slopes: Slopes, pulled: tuple[int, ...], stretches: tuple[float, ...] = (0.8, 1.2, 1.5, 2.0)
) -> Iterator[Verdict]:
    """A distorted unit cube pulled along the axes `pulled`, its other sides free."""
    mesh = distorted_cube(2)
    X = mesh.points
    near, far = np.abs(X) < 1e-9, np.abs(X - 1) < 1e-9
    far[:, [axis for axis in range(3) if axis not in pulled]] = False
    built = model(mesh, solid, plate=False, supports=near | far)
    at = configuration(built, X, loads(built, {}))
    tangent = Tangent(built)
    for stretch in stretches:
        start = X * (homogeneous(solid.parameters[-1], slopes, pulled, stretch)[0] - 1)
        # The free sides begin a little off, so that the solver has to find them.
        found = equilibrium(at, tangent, prescribed(at, np.where(near | far, start, 0.99 * start)))
        forces = np.asarray(built.state(residual(at, found)).u)[: len(X)]
        force = forces[far[:, 0], 0].sum()
        _, stress = homogeneous(solid.parameters[-1], slopes, pulled, stretch)
        yield relative(f"nominal stress at stretch {stretch:g}, MPa", force, stress, 1e-9)


def homogeneous(bulk: float, slopes: Slopes, pulled: tuple[int, ...], stretch: float) -> tuple[np.ndarray, float]:
    """Principal stretches (3,) and the nominal stress along the first axis (MPa), the sides not pulled being free.

    With s_i = λ̄_i ∂ψ_iso/∂λ̄_i the principal Cauchy stresses are (s_i − ⅓Σs)/J + κ(J − 1).
    """

    def state(side: float) -> tuple[np.ndarray, np.ndarray, float]:
        principal = np.where(np.isin(range(3), pulled), stretch, side)
        J = float(principal.prod())
        s = slopes(principal * J ** (-1 / 3))
        return principal, (s - s.mean()) / J + bulk * (J - 1), J

    # About the side of an incompressible body.
    side = stretch ** (-len(pulled) / (3 - len(pulled)))
    bracket = (0.75 * side, 1.3 * side)
    side = root_scalar(lambda side: state(side)[1][2], bracket=bracket, xtol=1e-15).root
    principal, cauchy, J = state(side)
    return principal, float(cauchy[0] * J / principal[0])
