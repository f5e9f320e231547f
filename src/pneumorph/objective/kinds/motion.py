"""Given motions of the tip."""

from __future__ import annotations

from collections.abc import Sequence

import jax.numpy as jnp
import numpy as np

from pneumorph.mechanics.elements.plate import rotation
from pneumorph.objective.kinds.kind import Scope, Target
from pneumorph.objective.objective import Objective, components
from pneumorph.problem import TargetMotion
from pneumorph.problem.components import MOTIONS


def build(asked: TargetMotion, scope: Scope) -> Objective:
    """Target components of the tip's translation and rotation vector, each in the sum of squares if it is given."""
    weights = asked.position_weight, asked.rotation_weight
    return components(asked.targets, lambda f: (f.translation, f.rotation), MOTIONS, weights)


def target(asked: TargetMotion, length: float, motion: np.ndarray | None) -> Target | None:
    """Place and axis of the tip; a twist alone does not change where it faces."""
    place, turn = _filled(asked, MOTIONS[:3], motion), _filled(asked, MOTIONS[3:], motion)
    bends = asked.bending_x is not None or asked.bending_y is not None
    return Target(
        place=None if place is None else np.array([0.0, 0.0, length]) + place,
        axis=np.asarray(rotation(jnp.array(turn)))[:, 2] if bends and turn is not None else None,
    )


def _filled(asked: TargetMotion, motions: Sequence[str], reached: np.ndarray | None) -> np.ndarray | None:
    """Three motions as they are asked for and, where they are free, as they are reached; None if that is not known."""
    wanted = [asked.targets.get(name) for name in motions]
    if all(each is None for each in wanted) or (reached is None and None in wanted):
        return None
    there = np.zeros(6) if reached is None else reached
    return np.array(
        [there[MOTIONS.index(name)] if each is None else each for name, each in zip(motions, wanted, strict=True)]
    )
