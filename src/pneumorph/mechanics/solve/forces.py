"""Forces of contact at a state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.potential import poses
from pneumorph.mechanics.assembly.tangent import Configuration
from pneumorph.mechanics.contact.obstacle import AREA, FORCE, NORMAL
from pneumorph.mechanics.contact.pressing import pressed
from pneumorph.mechanics.elements import sums
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.seal import SealPressure, seal_volumes


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
    pull : {obstacle: float}
        Of those that close chambers: with what they must be pulled from the body, along their normals, to be where
        they are, N. It is the force of the pressure on them less that of the rim.
    """

    on: dict[str, np.ndarray]
    normal: dict[str, float]
    area: dict[str, float]
    own: float
    pull: dict[str, float]


def contact_forces(at: Configuration, state: State) -> ContactForces:
    """The forces of contact at a state; nothing touches where there is no contact."""
    contact = at.model.contact
    if contact is None:
        return ContactForces({}, {}, {}, 0.0, {})
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
        pull=_pull(at, state, table[:, NORMAL]),
    )


def _pull(at: Configuration, state: State, normal: np.ndarray) -> dict[str, float]:
    """What closes chambers is drawn by the vacuum in them, and pushed by the normal forces (K,) of the rim."""
    names = tuple(at.model.contact.obstacles) if at.model.contact else ()
    found = {}
    for seal in at.model.seals:
        energy = seal.energy
        assert isinstance(energy, SealPressure)
        number = int(energy.number)
        point, across = energy.plane(at.loads.shift)
        u = displacement(at.model.tip, at.X, state)
        # Volumes are linear in the point of the plane: what they grow by with it is the area that is closed.
        here, away = (
            sums.summed(seal_volumes, seal.connectivity, at.X, u, place, across) for place in (point, point - across)
        )
        drawn = -float((away - here) @ np.asarray(at.loads.pressure))
        found[names[number]] = found.get(names[number], -float(normal[number])) + at.model.copies * drawn
    return found
