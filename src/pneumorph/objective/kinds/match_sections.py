"""Positions and orientations of sections."""

from __future__ import annotations

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements.plate import rotation as rotation_of
from pneumorph.objective.features import Features, Slabs, equidistant
from pneumorph.objective.kinds.kind import Scope, Target
from pneumorph.objective.objective import Objective, squares
from pneumorph.objective.rotations import angle_residual
from pneumorph.problem import MatchSections


def build(asked: MatchSections, scope: Scope) -> Objective:
    """See `Kind`."""
    turns = _turns(asked)
    return match(equidistant(len(turns), scope.length), None, turns)


def target(asked: MatchSections, length: float, motion: np.ndarray | None) -> Target:
    """Straight pieces of length/n, each along the axis of its section and with the section in its middle.

    Orientations alone do not determine a centre line.
    """
    axes = _turns(asked)[:, :, 2]
    joints = np.vstack([np.zeros(3), np.cumsum(axes * length / len(axes), axis=0)])
    return Target(joints, (joints[:-1] + joints[1:]) / 2)


def match(
    slabs: Slabs,
    position: np.ndarray | None,
    rotation: np.ndarray,
    orientation_weight: float = 1.0,
    position_weight: float = 0.0,
) -> Objective:
    """Objective for target positions (S, 3) in mm and rotations (S, 3, 3) of sections: (8)–(10), Section VIII-E.

    The rotation of each section relative to the previous one, or to the clamped base for the first, is compared with
    that of the target. J is the weighted sum of squared geodesic distances (rad²) and squared distances of centres
    (mm²).

    Parameters
    ----------
    slabs : Slabs
        The sections.
    position : (S, 3) array or None
        Of their centres, mm.
    rotation : (S, 3, 3) array
        From the undeformed state.
    orientation_weight, position_weight : float
        1/rad² and 1/mm².
    """
    steps = jnp.asarray(_relative(rotation))
    count = len(rotation)

    def turned(f: Features) -> Array:
        before = jnp.concatenate([jnp.eye(3)[None], f.section_rotation[:-1]])
        relative = jnp.swapaxes(before, 1, 2) @ f.section_rotation
        return jax.vmap(angle_residual)(relative, steps).ravel()

    errors = {"orientation_rad": lambda f: jnp.sqrt(jnp.sum(turned(f) ** 2) / (2 * count))}
    parts = [(orientation_weight, turned)]
    if position is not None:

        def away(f: Features) -> Array:
            return (f.section_position - position).ravel()

        errors["position_mm"] = lambda f: jnp.sqrt(jnp.sum(away(f) ** 2) / count)
        parts.append((position_weight, away))
    return squares(parts, errors, slabs)


def _turns(asked: MatchSections) -> np.ndarray:
    return np.array([rotation_of(jnp.array(turn)) for turn in asked.rotations])


def _relative(rotation: np.ndarray) -> np.ndarray:
    """Each rotation relative to the previous one, the first to the identity."""
    before = np.concatenate([np.eye(3)[None], rotation[:-1]])
    return np.swapaxes(before, 1, 2) @ rotation
