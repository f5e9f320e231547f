"""How fast the tip's motion changes with pressures and with the rubber's modulus, from adjoints at the equilibrium."""

from __future__ import annotations

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np

from pneumorph.analysis.analyse import Analysis, Discretisation
from pneumorph.mechanics.assembly import products
from pneumorph.objective.objective import squares
from pneumorph.results import MotionRates
from pneumorph.sensitivity import with_border

_MOTIONS = squares([(1.0, lambda f: jnp.concatenate([f.translation, f.rotation]))], {})


def motion_rates(disc: Discretisation, analysis: Analysis) -> Mapping[str, MotionRates]:
    """Derivatives of the tip's translation and rotation vector in every task, by one adjoint for each of the six.

    If all moduli grew by the factor s, the state would be that of all loads divided by s. The derivative by ln s is
    therefore minus the sum of every load times the derivative by it; sheets, fibres and contact are loads in this
    sense, and so are gases, but their shares are not known here, so with them there is no derivative by the modulus.
    """
    rates = {}
    for name, equilibrium in analysis.equilibria.items():
        at, state, model = analysis.configurations[name], equilibrium.state, disc.model
        _, _, seeds = _MOTIONS.jacobian(model, at.X, state)
        rhs = np.array([np.where(at.constrained, 0.0, model.vector(seed)) for seed in seeds])
        tangent = disc.tangents[name]
        solved, _ = with_border(at, tangent, state, tangent.solve_at(at, state, rhs.T).T)
        adjoints = [model.state(w) for w in solved]
        acting = [loads for _, loads in products.pullback(model.potential, at.X, state, at.loads, adjoints)]
        by_pressure = -np.array([loads.pressure for loads in acting])
        if at.enclosed is not None:
            by_pressure[:, at.enclosed.rows(model)] = 0.0
        sealed = at.enclosed is not None and bool(at.enclosed.gas.any())
        alone = model.contact is None and len(at.loads.reinforcement) == 0 and not sealed
        free = np.ones(len(model.chambers)) if at.enclosed is None else ~np.isin(model.chambers, at.enclosed.chambers)
        by_modulus = np.array([_work(loads, at.loads, free) for loads in acting]) if alone else None
        rates[name] = MotionRates(
            {chamber: tuple(map(float, by_pressure[:, k])) for k, chamber in enumerate(model.chambers)},
            None if by_modulus is None else tuple(map(float, by_modulus)),
        )
    return rates


def _work(acting, loads, free) -> float:
    """The sum of all loads times the derivatives by them; pressures that are not free of the state are no loads."""
    parts = ("acceleration", "spring", "wrench")
    by_pressure = float(np.sum(np.asarray(acting.pressure) * loads.pressure * free))
    return by_pressure + sum(float(np.sum(np.asarray(getattr(acting, part)) * getattr(loads, part))) for part in parts)
