"""What the body presses on obstacles with: the force, the sum of normal forces, and the area; with derivatives.

All are functions of the poses of the obstacles and of the places x = X + u of the nodes, so their derivatives by X and
by u are equal.
"""

from __future__ import annotations

from collections.abc import Iterator

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.obstacles import SAMPLE_DN, SAMPLE_N, SAMPLE_WEIGHTS, Obstacle, barrier
from pneumorph.mechanics.contact.triangulated import Triangulated, TriangulatedTouch
from pneumorph.mechanics.elements import sums
from pneumorph.mechanics.elements.terms import Values

FORCE, NORMAL, AREA = slice(0, 3), 3, 4
"""What is at which place in the five numbers of an obstacle."""

FULL = 0.95
"""Surface nearer than this share of the activation distance counts in full as area: there it presses by 0.8 % of κ."""


def pressed(contact: Contact | None, x: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """For every obstacle (K, 5) the force on it (3,), N, the sum of the normal forces, N, and the area, mm².

    Nodes are at x (N, 3), obstacles at poses (K, 6); the area is that of the deformed surface.
    """
    if contact is None:
        return np.zeros((0, 5))
    found = np.zeros((len(contact.obstacles), 5))
    for (name, obstacle), row, view in zip(contact.obstacles.items(), found, contact.views(poses), strict=True):
        y = view.seen(x)
        if isinstance(obstacle, Triangulated):
            touch = obstacle.touch(y)
            row[:] = *touch.slope.sum(axis=0), touch.normal, touch.touching(FULL)[0]
        else:
            row[:] = sums.summed(_pressed, contact.surface, y, np.zeros(x.shape), obstacle)
        if name in contact.guards:
            forces = contact.guards[name].touch(y).slope
            row[FORCE] += forces.sum(axis=0)
            row[NORMAL] += np.linalg.norm(forces, axis=1).sum()
        row[FORCE] = view.directed(row[FORCE])
    return found


def pulled_back(
    contact: Contact, x: np.ndarray, poses: np.ndarray, cotangents: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of cotangent·`pressed` by the places of the nodes (k, N, 3) and by the poses (k, K, 6).

    The latter if there are free obstacles, else zero. For k cotangents (k, K, 5) at once.
    """
    by_x, by_pose = np.zeros((len(cotangents), *x.shape)), np.zeros((len(cotangents), *poses.shape))
    forces = pressed(contact, x, poses)[:, FORCE] if contact.free else None
    for number, ((name, obstacle), view) in enumerate(
        zip(contact.obstacles.items(), contact.views(poses), strict=True)
    ):
        # As the obstacle sees it.
        bars, y, by_y = cotangents[:, number].copy(), view.seen(x), np.zeros(by_x.shape)
        bars[:, FORCE] = view.drawn(bars[:, FORCE])
        some = bars.any(axis=1)
        if not some.any():
            continue
        if isinstance(obstacle, Triangulated):
            by_y += _on_triangulated(obstacle.touch(y), bars)
        else:
            by_y[some] += sums.pulled_back(_pressed, contact.surface, y, np.zeros(x.shape), bars[some], obstacle)[0]
        if name in contact.guards:
            touch = contact.guards[name].touch(y)
            for out, motion in zip(by_y, _motions(touch.slope, bars), strict=True):
                out += touch.product(motion)
        by_x += view.directed(by_y)
        if forces is not None:
            by_pose[:, number] = np.stack([view.by_pose(x, by_y[k]) for k in range(len(by_y))])
            by_pose[:, number, 3:] += view.turning(view.drawn(forces[number]), cotangents[:, number, FORCE])
    return by_x, by_pose


def _on_triangulated(touch: TriangulatedTouch, bars: np.ndarray) -> np.ndarray:
    """Derivatives (k, N, 3) of cotangents (k, 5) times what is pressed on an obstacle of triangles."""
    normal, area = touch.normal_slope(), touch.touching(FULL)[1]
    along = (touch.product(np.broadcast_to(bar[FORCE], area.shape)) for bar in bars)
    return np.stack([each + bar[NORMAL] * normal + bar[AREA] * area for each, bar in zip(along, bars, strict=True)])


def _motions(forces: np.ndarray, bars: np.ndarray) -> Iterator[np.ndarray]:
    """Motions (N, 3) of the nodes along which forces of theirs (N, 3) do the work cotangent·(force, normal force)."""
    size = np.linalg.norm(forces, axis=1, keepdims=True)
    along = np.divide(forces, size, out=np.zeros(forces.shape), where=size > 0.0)
    for bar in bars:
        yield bar[FORCE] + bar[NORMAL] * along


def _pressed(x: Values, u: Values, data: Values, weight: Values, obstacle: Obstacle) -> Array:
    places = jnp.einsum("qa,eai->eqi", jnp.asarray(SAMPLE_N), x)
    distance = obstacle.shape.distance(places)
    away = jax.grad(lambda places: jnp.sum(obstacle.shape.distance(places)))(places)
    slope = jax.grad(lambda each: jnp.sum(barrier(each, obstacle.activation, obstacle.stiffness)))(distance)
    normal = -weight[:, None] * data * slope
    along, across = jnp.einsum("eai,qak->keqi", x, jnp.asarray(SAMPLE_DN))
    area = jnp.asarray(SAMPLE_WEIGHTS)[:, None] * jnp.cross(along, across)
    # Faces beside what touches, which stand on the obstacle, are near it too: only what faces it counts.
    facing = jnp.maximum(-jnp.sum(area * away, axis=-1), 0.0)
    share = _faded((1.0 - distance / obstacle.activation) / (1.0 - FULL))
    touching = weight[:, None] * share * facing**2 / jnp.sqrt(jnp.sum(area**2, axis=-1))
    force = -jnp.einsum("eq,eqi->i", normal, away)
    return jnp.concatenate([force, jnp.sum(normal)[None], jnp.sum(touching)[None]])


def _faded(share: Array) -> Array:
    """From 0 to 1 as a share does, with two continuous derivatives."""
    share = jnp.clip(share, 0.0, 1.0)
    return share**3 * (10.0 - 15.0 * share + 6.0 * share**2)
