"""What the body presses on obstacles with: the force, the sum of normal forces, and the area; with derivatives.

All are functions of the poses of the obstacles and of the places x = X + u of the nodes, so their derivatives by X and
by u are equal.
"""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.obstacle import FORCE, NORMAL


def pressed(contact: Contact | None, x: np.ndarray, poses: np.ndarray) -> np.ndarray:
    """For every obstacle (K, 5) the force on it (3,), N, the sum of the normal forces, N, and the area, mm².

    Nodes are at x (N, 3), obstacles at poses (K, 6); the area is that of the deformed surface.
    """
    if contact is None:
        return np.zeros((0, 5))
    acting = np.zeros((len(contact.obstacles), 5))
    for (name, obstacle), row, view in zip(contact.obstacles.items(), acting, contact.views(poses), strict=True):
        y = view.in_frame(x)
        row[:] = obstacle.pressed(y)
        if name in contact.guards:
            forces = contact.guards[name].touch(y).slope
            row[FORCE] += forces.sum(axis=0)
            row[NORMAL] += np.linalg.norm(forces, axis=1).sum()
        row[FORCE] = view.directed(row[FORCE])
    return acting


def pulled_back(
    contact: Contact, x: np.ndarray, poses: np.ndarray, cotangents: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Derivatives of cotangent·`pressed` by the places of the nodes (k, N, 3) and by the poses (k, K, 6).

    The latter if there are free obstacles, else zero. For k cotangents (k, K, 5) at once.

    Parameters
    ----------
    contact : Contact
    x : (N, 3) array
        Places of the nodes, mm.
    poses : (K, 6) array
        Of the obstacles, mm and rad.
    cotangents : (k, K, 5) array
        Of what `pressed` gives.
    """
    by_x, by_pose = np.zeros((len(cotangents), *x.shape)), np.zeros((len(cotangents), *poses.shape))
    forces = pressed(contact, x, poses)[:, FORCE] if contact.free else None
    for number, ((name, obstacle), view) in enumerate(
        zip(contact.obstacles.items(), contact.views(poses), strict=True)
    ):
        # As the obstacle sees it.
        bars, y = cotangents[:, number].copy(), view.in_frame(x)
        bars[:, FORCE] = view.drawn(bars[:, FORCE])
        if not bars.any():
            continue
        by_y = obstacle.pressed_back(y, bars)
        if name in contact.guards:
            touch = contact.guards[name].touch(y)
            for out, motion in zip(by_y, _motions(touch.slope, bars), strict=True):
                out += touch.product(motion)
        by_x += view.directed(by_y)
        if forces is not None:
            by_pose[:, number] = np.stack([view.by_pose(x, by_y[k]) for k in range(len(by_y))])
            by_pose[:, number, 3:] += view.turning(view.drawn(forces[number]), cotangents[:, number, FORCE])
    return by_x, by_pose


def _motions(forces: np.ndarray, bars: np.ndarray) -> Iterator[np.ndarray]:
    """Motions (N, 3) of the nodes along which forces of theirs (N, 3) do the work cotangent·(force, normal force)."""
    size = np.linalg.norm(forces, axis=1, keepdims=True)
    along = np.divide(forces, size, out=np.zeros(forces.shape), where=size > 0.0)
    for bar in bars:
        yield bar[FORCE] + bar[NORMAL] * along
