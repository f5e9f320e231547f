"""A force on an obstacle."""

from __future__ import annotations

import jax.numpy as jnp
from jax import Array

from pneumorph.objective.features import Features
from pneumorph.objective.kinds.kind import Scope
from pneumorph.objective.objective import Objective, amount
from pneumorph.problem import Press


def build(asked: Press, scope: Scope) -> Objective:
    """The largest force on an obstacle, or a target for it: a component, or the sum of the normal forces; N or N²."""

    def force(f: Features) -> Array:
        on = f.contact[asked.obstacle]
        return on.normal if asked.direction is None else jnp.dot(on.force, jnp.array(asked.direction))

    return amount(force, asked.force, "force_N")
