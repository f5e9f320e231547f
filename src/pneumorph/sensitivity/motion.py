"""First derivatives of the six motions of the tip, or of what an objective measures, by all that may vary: nodes, loads
and the moduli of rubbers. One adjoint for each."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace

import jax.numpy as jnp
import numpy as np

from pneumorph.mechanics import Configuration, State, Tangent
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.potential import forces, grouped
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.objective import Objective
from pneumorph.objective.objective import squares
from pneumorph.sensitivity.adjoint import with_border

_MOTIONS = squares([(1.0, lambda f: jnp.concatenate([f.translation, f.rotation]))], {})


@dataclass(frozen=True)
class MotionSlopes:
    """Derivatives at an equilibrium, of the tip's translation (mm) and rotation vector (rad): k = 6, or of others.

    Attributes
    ----------
    motion : (k,)
        Their values.
    X : (k, N, 3)
        Per mm of the motion of nodes.
    loads : sequence of k Loads
        By all loads; those of pressures that are found with the state are 0.
    moduli : {region: (k,)}
        Per relative change of all moduli of its rubber.
    adjoints : (k, n)
        Of what is measured, per N on all n unknowns.
    """

    motion: np.ndarray
    X: np.ndarray
    loads: Sequence[Loads]
    moduli: Mapping[str, np.ndarray]
    adjoints: np.ndarray


def motion_slopes(at: Configuration, tangent: Tangent, state: State, measured: Objective = _MOTIONS) -> MotionSlopes:
    """The derivatives at an equilibrium, near whose state the tangent was factorised.

    A factor s of the moduli of a rubber multiplies its part of Π, and its π in mixed elements are s times unknowns by
    which R stays 0. So the derivative by ln s is −wᵀR_s with the forces R_s of that rubber.

    Parameters
    ----------
    at, tangent, state : the equilibrium.
    measured : whose residuals have these derivatives, or whose value if it has none; by default the tip's motions.
    """
    found = slopes_by(at, state, *adjoints_of(at, tangent, state, measured))
    given = np.array([measured.by_pressure.get(chamber, 0.0) for chamber in at.model.chambers])
    return replace(found, loads=[each._replace(pressure=each.pressure + given) for each in found.loads])


def slopes_by(
    at: Configuration, state: State, values: np.ndarray, direct: np.ndarray, adjoints: np.ndarray, more: np.ndarray
) -> MotionSlopes:
    """The derivatives of k values at an equilibrium.

    Parameters
    ----------
    at, state : the equilibrium.
    values : (k,)
    direct : (k, N, 3) by nodes, with the state as it is.
    adjoints : (k, n) w, with which they change by −wᵀ∂R as the state follows.
    more : (k, N, 3) what pressures that are found with the state add, see `with_border`.
    """
    model = at.model
    pulled = products.pullback(model.potential, at.X, state, at.loads, [model.state(w) for w in adjoints])
    rubbers = {name: -adjoints @ model.vector(by) for name, by in rubber_forces(at, state).items()}
    by_X = direct - np.array([shape for shape, _ in pulled]).reshape(direct.shape) + more
    return MotionSlopes(values, by_X, [_negative(loads) for _, loads in pulled], rubbers, adjoints)


def _negative(loads: Loads) -> Loads:
    return Loads(*(-np.asarray(load) for load in loads))


def tip_motion_adjoints(at: Configuration, tangent: Tangent, state: State) -> tuple[np.ndarray, np.ndarray]:
    """The tip's motion (6,) in mm and rad at a state, and the adjoints (6, n) of its components."""
    motion, _, solved, _ = adjoints_of(at, tangent, state)
    return motion, solved


def adjoints_of(
    at: Configuration, tangent: Tangent, state: State, measured: Objective = _MOTIONS
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """What is measured (k,), its direct derivatives by X (k, N, 3), its adjoints, and what unknown pressures add."""
    if measured.residuals is None:
        value, by_X, seed = measured.slope(at.model, at.X, state)
        motion, direct, seeds = np.array([value]), by_X[None], [seed]
    else:
        motion, direct, seeds = measured.jacobian(at.model, at.X, state)
    rhs = np.array([np.where(at.constrained, 0.0, at.model.vector(seed)) for seed in seeds])
    return motion, direct, *with_border(at, tangent, state, tangent.solve_at(at, state, rhs.T).T)


def rubber_forces(at: Configuration, state: State) -> dict[str, State]:
    """The forces of every rubber by itself on all unknowns."""
    model, nodes = at.model, Displacement(at.model.potential.tip, at.X, state)
    alone = model.potential._replace(contact=None)
    return {
        name: nodes.on_unknowns(forces(alone, grouped([term]), nodes, at.loads)[1])
        for name, term in zip(model.rubbers, _solids(model), strict=True)
    }


def _solids(model: Model):
    return [term for term in model.terms if term.energy.of_rubber]
