"""Conditions on elements of any shape: constant strain is represented exactly, and rigid rotations cause no stress."""

from __future__ import annotations

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np

from pneumorph.mechanics import Configuration, Tangent, build_loads, build_model, configure
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.elements.kinematics import deformation_gradients
from pneumorph.mechanics.elements.plate import rotation
from pneumorph.verify.prescribed import equilibrium, prescribed, residual
from pneumorph.verify.solids import RUBBER, distorted_cube
from pneumorph.verify.verdict import Verdict, absolute

"""Hei-Cast 8400, the rubber of the paper."""

DEFORMATION = np.array([[1.3, 0.2, -0.1], [0.05, 0.9, 0.15], [0.1, -0.2, 1.1]])
"""A deformation gradient with stretch, shear and rotation."""


def patch_test() -> Iterator[Verdict]:
    """A distorted mesh with linear displacements of its boundary: they must be linear, and stress constant, inside."""
    mesh = distorted_cube(3)
    supports = np.repeat((np.abs(mesh.points - 0.5) > 0.5 - 1e-9).any(axis=1, keepdims=True), 3, axis=1)
    built = build_model(mesh, RUBBER, plate=False, supports=supports)
    at = configure(built, mesh.points, build_loads(built, {}))
    linear = mesh.points @ (DEFORMATION - np.eye(3)).T
    start = prescribed(at, np.where(supports, linear, 0.9 * linear))
    solution = equilibrium(at, Tangent(built), start)
    yield absolute(
        "largest deviation from the linear displacement / largest displacement",
        np.abs(solution - prescribed(at, linear)).max() / np.abs(linear).max(),
        0.0,
        1e-10,
    )
    expected = np.asarray(_stress(jnp.asarray(DEFORMATION)[:, :, None]))[:, :, 0]
    stress = stresses(at, solution)
    yield absolute(
        "largest deviation from the constant stress / largest stress",
        np.abs(stress - expected[:, :, None, None]).max() / np.abs(expected).max(),
        0.0,
        1e-10,
    )


def rigid_rotation() -> Iterator[Verdict]:
    """A body rotated by 2 rad about an oblique axis and translated: there must be no stress and no nodal forces."""
    mesh = distorted_cube(2)
    built = build_model(mesh, RUBBER, plate=False, supports=np.zeros((len(mesh.points), 3), bool))
    at = configure(built, mesh.points, build_loads(built, {}))
    axis = np.array([1.0, 2.0, -2.0]) / 3
    turn = np.asarray(rotation(jnp.asarray(2.0 * axis)))
    moved = prescribed(at, mesh.points @ (turn - np.eye(3)).T + [5.0, -3.0, 1.0])
    shear = RUBBER.parameters[0]
    yield absolute("largest stress / shear modulus", np.abs(stresses(at, moved)).max() / shear, 0.0, 1e-12)
    yield absolute(
        "largest nodal force / (shear modulus × 1 mm²)", np.abs(residual(at, moved)).max() / shear, 0.0, 1e-12
    )


def stresses(at: Configuration, vector: np.ndarray) -> np.ndarray:
    """First Piola–Kirchhoff stress (3, 3, 4, M) at the quadrature points, MPa."""
    built = at.model
    u = displacement(built.tip, at.X, built.state(vector))
    return np.asarray(_stress(jnp.asarray(deformation_gradients(built.tets.nodes[: built.elements], at.X, u))))


def _stress(F: jnp.ndarray) -> jnp.ndarray:
    energy, parameters = RUBBER.energy, jnp.asarray(RUBBER.parameters)
    return jax.grad(lambda F: jnp.sum(energy(F, parameters)))(F)
