"""As little as possible of the rubber, the air, the pressure or the stretch."""

from __future__ import annotations

import jax.numpy as jnp

from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.objective import Objective, in_place_of_features
from pneumorph.objective.strain import StrainShare
from pneumorph.problem import Minimize

_PER_MPA, _PER_MM3 = 1e3, 1e-3
"""kPa and ml."""


def build(asked: Minimize, scope: Scope) -> Objective:
    """The mass of the rubber in g, the volume of the chambers in ml, the sum of pressures in kPa, or the stretch."""
    if asked.of == "stretch":
        return in_place_of_features(StrainShare(of_range=False))
    if asked.of == "mass":
        return Objective(lambda f: f.mass)
    if asked.of == "air":
        return Objective(lambda f: _PER_MM3 * sum(f.volume.values(), jnp.zeros(())))
    rates = {name: sign * _PER_MPA for name, sign in scope.designed.items()}
    return Objective(lambda f: 0.0 * f.mass, by_pressure=rates)
