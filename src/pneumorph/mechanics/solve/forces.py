"""Forces of contact at a state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.potential import poses
from pneumorph.mechanics.assembly.tangent import Configuration
from pneumorph.mechanics.contact.obstacle import AREA, FORCE, NORMAL
from pneumorph.mechanics.contact.pressing import pressed
from pneumorph.mechanics.elements.kinematics import State


@dataclass(frozen=True)
class ContactForces:
    """What a body touches.

    Attributes
    ----------
    on : {obstacle: (3,)}
        Force of the body on every obstacle, N, with friction.
    normal : {obstacle: float}
        Sum of the normal forces on it, N: forces that oppose each other count too.
    area : {obstacle: float}
        Area of the body's deformed surface that touches it, mm².
    own : float
        Sum of the forces with which the body's surface presses on itself, N; each counts once.
    """

    on: dict[str, np.ndarray]
    normal: dict[str, float]
    area: dict[str, float]
    own: float


def contact_forces(at: Configuration, state: State) -> ContactForces:
    """The forces of contact at a state; nothing touches where there is no contact."""
    contact = at.model.contact
    if contact is None:
        return ContactForces({}, {}, {}, 0.0)
    x = at.X + displacement(at.model.tip, at.X, state)
    own = 0.0
    if contact.own is not None:
        own = at.model.copies * float(np.linalg.norm(contact.own.touch(x).slope, axis=1).sum()) / 2
    table = pressed(contact, x, poses(at.model.potential, state, at.loads))
    for surface, energy in at.model.terms:
        if (number := energy.drags) is not None:
            _, forces = energy.forces(surface, surface.local(at.X, x - at.X, state), at.loads)
            table[number, FORCE] += np.asarray(forces.u).sum(axis=(0, 1))
    rows = dict(zip(contact.obstacles, table, strict=True))
    return ContactForces(
        on={name: row[FORCE] for name, row in rows.items()},
        normal={name: float(row[NORMAL]) for name, row in rows.items()},
        area={name: float(row[AREA]) for name, row in rows.items()},
        own=own,
    )
