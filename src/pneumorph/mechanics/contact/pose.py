"""Poses of rigid obstacles, and the places of a body as an obstacle sees them.

An obstacle at the pose [c, θ] is displaced by c (mm) and turned by the rotation vector θ (rad) about its centre o: a
point Y of it is at o + c + R(θ)(Y − o). A body at places x touches it as one at y(x) = o + Rᵀ(x − o − c) touches the
obstacle in its own place, so a function T of y alone is a function of x and of the pose.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import cached_property

import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.elements.plate import rotation
from pneumorph.mechanics.elements.terms import Values
from pneumorph.mechanics.elements.turns import turns

STILL = np.zeros(6)
"""The pose of an obstacle in its own place."""


def pose_of(given: Sequence[float]) -> np.ndarray:
    """A pose (6,) from three numbers, a displacement in mm, or six, with a rotation vector in rad."""
    return np.concatenate([given, STILL[len(given) :]]).astype(float)


def in_frame(x: Values, centre: Values, pose: Values) -> Array:
    """Places y (..., 3) as an obstacle sees places x (..., 3), in JAX."""
    # Without a turn this is x − c to the last digit.
    away = x - pose[:3]
    return away + (away - centre) @ (rotation(pose[3:]) - jnp.eye(3))


class View:
    """How an obstacle with its centre (3,) at a pose (6,) sees a body, and derivatives by both."""

    def __init__(self, centre: Values, pose: np.ndarray):
        self.centre, self.pose = np.asarray(centre, dtype=float), np.asarray(pose, dtype=float)

    @cached_property
    def _turn(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """R − I with its first (3, 3, 3) and second (3, 3, 3, 3) derivatives by θ, whose axes come last."""
        return turns(self.pose[3:])

    @property
    def turned(self) -> bool:
        """Whether the obstacle is turned at all."""
        return bool(np.any(self.pose[3:]))

    @property
    def rotation(self) -> np.ndarray:
        """R (3, 3)."""
        return np.eye(3) + self._turn[0]

    def in_frame(self, x: np.ndarray) -> np.ndarray:
        """y (..., 3) of places x (..., 3)."""
        away = x - self.pose[:3]
        return away + (away - self.centre) @ self._turn[0] if self.turned else away

    def placed(self, points: np.ndarray) -> np.ndarray:
        """Where points (..., 3) of the obstacle are."""
        return points + self.pose[:3] + (points - self.centre) @ self._turn[0].T

    @property
    def matrix(self) -> np.ndarray:
        """`placed` as a 4 × 4 matrix of homogeneous coordinates."""
        matrix = np.eye(4)
        matrix[:3, :3], matrix[:3, 3] = self.rotation, self.placed(np.zeros(3))
        return matrix

    def directed(self, vectors: np.ndarray) -> np.ndarray:
        """R v of vectors (..., 3) that the obstacle sees."""
        return vectors + vectors @ self._turn[0].T if self.turned else vectors

    def drawn(self, vectors: np.ndarray) -> np.ndarray:
        """Rᵀ v of vectors (..., 3), as the obstacle sees them."""
        return vectors + vectors @ self._turn[0] if self.turned else vectors

    def turning(self, vector: np.ndarray, along: np.ndarray) -> np.ndarray:
        """Derivatives (k, 3) of a·R v by θ, of a vector v (3,) that the obstacle sees, for vectors a (k, 3)."""
        return np.einsum("ki,ijl,j->kl", along, self._turn[1], vector)

    def by_pose(self, x: np.ndarray, by_y: np.ndarray) -> np.ndarray:
        """Derivative (6,) by the pose of a function of y, from that (N, 3) by y, with nodes at x (N, 3)."""
        by_angle = np.einsum("ab,abk->k", self._arm(x).T @ by_y, self._turn[1])
        return np.concatenate([-self.directed(by_y).sum(axis=0), by_angle])

    def change(
        self, x: np.ndarray, by_y: np.ndarray, product: Callable[[np.ndarray], np.ndarray], dx: np.ndarray, dpose
    ) -> tuple[np.ndarray, np.ndarray]:
        """How the derivatives of a function T of y by x (N, 3) and by the pose (6,) change along dx (N, 3) and dpose.

        `by_y` (N, 3) is ∂T/∂y, and `product` its change along a motion of y.

        Parameters
        ----------
        x : (N, 3) array
            Places of the nodes, mm.
        by_y : (N, 3) array
            ∂T/∂y.
        product : callable
            The change (N, 3) of `by_y` along a motion (N, 3) of y.
        dx : (N, 3) array
            Motion of the nodes, mm.
        dpose : (6,) array
            Change of the pose, mm and rad.
        """
        _, first, second = self._turn
        turning, along, arm = first @ dpose[3:], dx - dpose[:3], self._arm(x)
        changed = product(self.drawn(along) + arm @ turning)
        by_x = self.directed(changed) + by_y @ turning.T
        by_angle = np.einsum("ab,abk->k", along.T @ by_y + arm.T @ changed, first)
        by_angle += np.einsum("ab,abkl,l->k", arm.T @ by_y, second, dpose[3:])
        return by_x, np.concatenate([-by_x.sum(axis=0), by_angle])

    def _arm(self, x: np.ndarray) -> np.ndarray:
        """x − o − c, which the obstacle's turn turns."""
        return x - self.centre - self.pose[:3]
