"""The motions of the tip that limits bound: vectors, the lengths of which are limited.

A vector is smooth where its length is not, as where a plate is not tilted at all.
"""

from __future__ import annotations

import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements.plate import rotation
from pneumorph.objective.features import Features
from pneumorph.objective.objective import FeatureFunction, Objective, squares
from pneumorph.problem.components import MOTIONS

_DEGREE = float(np.degrees(1.0))


def _tilt(f: Features) -> Array:
    """The tip's normal across the axis (2,), of the length of its angle with the axis, in degrees."""
    x, y, z = rotation(f.rotation)[:, 2]
    square = x**2 + y**2
    small = (square < 1e-6) & (z > 0)
    sine = jnp.sqrt(jnp.where(small, 1.0, square))
    # arcsin(s)/s where s is small, to 1e-16.
    factor = jnp.where(small, 1 + square / 6 + 3 * square**2 / 40, jnp.arctan2(sine, z) / sine)
    return _DEGREE * factor * jnp.stack([x, y])


def _component(number: int) -> FeatureFunction:
    if number < 3:
        return lambda f: f.translation[number]
    return lambda f: _DEGREE * f.rotation[number - 3]


def _alone(number: int) -> Objective:
    read = _component(number)
    return squares([(1.0, lambda f: read(f)[None])], {})


COMPONENTS = {name: Objective(_component(number)) for number, name in enumerate(MOTIONS)}
"""The motions of the tip along and about the axes as functions of a state, in mm and degrees."""

LIMITED = {
    "tilt": squares([(1.0, _tilt)], {}),
    "shift": squares([(1.0, lambda f: f.translation[:2])], {}),
    **{name: _alone(number) for number, name in enumerate(MOTIONS)},
}
"""Their vectors as residuals, in mm and degrees, by the keys of `problem.task_limits.MotionLimits`."""
