"""A position and an orientation of the plate."""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements.plate import rotation as rotation_of
from pneumorph.objective.features import Features
from pneumorph.objective.kinds.kind import Scope, Target
from pneumorph.objective.objective import FeatureFunction, Objective, squares
from pneumorph.objective.rotations import angle_residual
from pneumorph.problem import Reach


def build(asked: Reach, scope: Scope) -> Objective:
    """See `Kind`."""
    return reach(asked, scope.tip)


def target(asked: Reach, length: float, motion: np.ndarray | None) -> Target:
    """The position, and the axis of the orientation."""
    axis = None if asked.rotation is None else np.asarray(rotation_of(jnp.array(asked.rotation)))[:, 2]
    return Target(place=None if asked.position is None else np.array(asked.position), axis=axis)


def reach(asked: Reach, tip: np.ndarray) -> Objective:
    """Objective for a target position of the plate's centre, relative to the base's, and rotation: (8)–(10).

    Relative to the base's centre, the plate's starts at `tip` (3,), mm.
    """
    parts: list[tuple[float, FeatureFunction]] = []
    errors: dict[str, FeatureFunction] = {}
    if asked.position is not None:
        wanted = jnp.array(asked.position) - jnp.asarray(tip)

        def away(f: Features) -> Array:
            return f.translation - wanted

        parts.append((asked.position_weight, away))
        errors["position_mm"] = lambda f: jnp.sqrt(jnp.sum(away(f) ** 2))
    if asked.rotation is not None:
        turned = rotation_of(jnp.array(asked.rotation))

        def off(f: Features) -> Array:
            return angle_residual(rotation_of(f.rotation), turned)

        parts.append((asked.rotation_weight, off))
        errors["orientation_rad"] = lambda f: jnp.sqrt(jnp.sum(off(f) ** 2) / 2)
    return squares(parts, errors)
