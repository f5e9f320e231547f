"""What a small spherical void at pressure, put into the rubber at any place, does to what is measured: to first order.

This is the topological derivative of elasticity (Garreau, Guillaume & Masmoudi, SIAM J. Control Optim. 39 (2001)
1756), with the strains around a spherical void from Eshelby (Proc. R. Soc. A 241 (1957) 376). With the adjoint w, of
which e is the deviator of the symmetric gradient in the deformed body and q the hydrostatic stress that it makes, the
change per volume is

    15 (1 − ν)/(7 − 5 ν) s : e + 9 (1 − ν)/(4 μ (1 + ν)) q (π + p̂) − ρ₀ g·w

where s and π are the deviator and the mean of the stress that was there, and ν, μ those of the rubber at rest. Where p
is a large part of μ, a void swells more than linearly: p̂ is the pressure that would swell it as much if it did not, by
the solution for a spherical cavity in incompressible rubber. The stress that the void releases counts to first order.
"""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from pneumorph.mechanics import Configuration, State
from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.elements.element import TET_CORNER_N
from pneumorph.mechanics.elements.kinematics import deformation_gradients
from pneumorph.mechanics.material.rubber import Rubber, nominal_stress

SWOLLEN = (0.6, 2.0)
"""Radii of a cavity over that at rest between which its pressure is known; beyond, the last one is used."""

STRETCHES = 400
"""Radii at which the pressure of a cavity is computed."""


def swelling(rubber: Rubber, pressure: float) -> float:
    """Growth of the volume of a spherical cavity in infinite incompressible rubber, over its volume at rest.

    Its pressure at the stretch λ of its wall is ∫ ψ'(l)/(l³ − 1) dl from 1 to λ, with ψ(l) at the stretches l⁻², l, l.

    Parameters
    ----------
    rubber : of which it is.
    pressure : in it, MPa.
    """
    low, high = SWOLLEN
    below, above = 1.0 - np.geomspace(1.0 - low, 1e-3, STRETCHES), 1.0 + np.geomspace(1e-3, high - 1.0, STRETCHES)
    stretch, step = np.concatenate([below, above]), 1e-4

    def energy(at: np.ndarray) -> np.ndarray:
        F = np.zeros((3, 3, len(at)))
        F[0, 0], F[1, 1], F[2, 2] = at**-2, at, at
        return np.asarray(rubber.isochoric(jnp.asarray(F), jnp.array(rubber.parameters)))

    slope = (energy(stretch + step) - energy(stretch - step)) / (2.0 * step) / (stretch**3 - 1.0)
    pressures = np.concatenate([[0.0], np.cumsum(0.5 * (slope[1:] + slope[:-1]) * np.diff(stretch))])
    pressures -= np.interp(1.0, stretch, pressures)
    # Beyond the largest pressure there is no state: it goes on growing there.
    last = int(np.argmax(pressures)) + 1
    return float(np.interp(pressure, pressures[:last], stretch[:last])) ** 3 - 1.0


def insertion_slopes(
    at: Configuration, state: State, adjoints: Sequence[State], pressures: Sequence[float]
) -> np.ndarray:
    """What voids do to each of k measured values, per volume of the void at rest: (k, P, E), per mm³.

    Of a part of a body, a void at one place of the whole; its images add as much.

    Parameters
    ----------
    at, state : an equilibrium of E elements.
    adjoints : of the k values, as `gradient` and `tip_motion_adjoints` have them.
    pressures : in the voids, P values in MPa.
    """
    model, nodes = at.model, Displacement(at.model.tip, at.X, state)
    tets = model.tets.nodes[: model.elements]
    F = deformation_gradients(tets, at.X, nodes.u)
    inverse = np.moveaxis(np.linalg.inv(np.moveaxis(F, (0, 1), (-2, -1))), (-2, -1), (0, 1))
    fields = []
    for adjoint in adjoints:
        moved = nodes.along(adjoint)
        gradient = deformation_gradients(tets, at.X, moved) - np.eye(3)[:, :, None, None]
        strain = np.einsum("ik...,kj...->ij...", gradient, inverse)
        fields.append((0.5 * (strain + strain.swapaxes(0, 1)), moved[tets[:, :4]].mean(axis=1)))
    found = np.empty((len(adjoints), len(pressures), len(tets)))
    for row, (name, rubber) in enumerate(model.rubbers.items()):
        own = model.regions[name]

        def hydrostatic(of: State, own: np.ndarray = own, row: int = row) -> np.ndarray:
            """π (4, e) of mixed elements."""
            values = np.asarray(of.hydrostatic)[row * model.nodes + tets[own, :4]]
            return TET_CORNER_N @ values.T

        energy = rubber.isochoric if model.mixed else rubber.energy
        nominal = nominal_stress(energy, F[..., own], np.array(rubber.parameters))
        stress = np.einsum("ik...,jk...->ij...", nominal, F[..., own])
        mean = hydrostatic(state) if model.mixed else np.trace(stress) / 3.0
        stress -= np.trace(stress) / 3.0 * np.eye(3)[:, :, None, None]
        mu, kappa = rubber.shear_modulus, rubber.bulk_modulus
        nu = (3.0 * kappa - 2.0 * mu) / (2.0 * (3.0 * kappa + mu))
        by_shear, by_mean = 15.0 * (1.0 - nu) / (7.0 - 5.0 * nu), 9.0 * (1.0 - nu) / (4.0 * mu * (1.0 + nu))
        swollen = np.array([4.0 * mu / 3.0 * swelling(rubber, pressure) for pressure in pressures])
        weight = rubber.density * np.asarray(at.loads.acceleration)
        for number, (adjoint, (strain, moved)) in enumerate(zip(adjoints, fields, strict=True)):
            part = strain[..., own]
            made = hydrostatic(adjoint) if model.mixed else kappa * np.trace(part)
            # The stress is a deviator: so is what counts of the strain.
            sheared = by_shear * np.einsum("ij...,ij...->...", stress, part).mean(axis=0) - moved[own] @ weight
            released, grown = by_mean * (made * mean).mean(axis=0), by_mean * made.mean(axis=0)
            found[number][:, own] = sheared + released + swollen[:, None] * grown
    return found / model.copies
