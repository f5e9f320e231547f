"""Forces of contact at a state."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.mechanics.assembly import derivatives
from pneumorph.mechanics.assembly.kinematics import State
from pneumorph.mechanics.assembly.obstacles import away_from, distances, normals, sample_places
from pneumorph.mechanics.assembly.potential import displacement
from pneumorph.mechanics.assembly.tangent import Configuration


@dataclass(frozen=True)
class ContactForces:
    """What a body touches.

    Attributes
    ----------
    on : {obstacle: (3,)}
        Force of the body on every obstacle, N.
    area : {obstacle: float}
        Area of the body's surface, at rest, that is within the activation distance of it and faces it, mm².
    own : float
        Sum of the forces with which the body's surface presses on itself, N; each counts once.
    """

    on: dict[str, np.ndarray]
    area: dict[str, float]
    own: float


def contact_forces(at: Configuration, state: State) -> ContactForces:
    """The forces of contact at a state; nothing touches where there is no contact."""
    contact, X = at.model.contact, at.X
    if contact is None:
        return ContactForces({}, {}, 0.0)
    u, seen = displacement(at.model.tip, X, state), contact.surface
    local, places = seen.local(X, u, state.hydrostatic, state.plate), sample_places(seen, X + u)
    on, area = {}, {}
    for name, obstacle in contact.obstacles.items():
        _, found = derivatives.forces(obstacle, seen, local, at.loads)
        # The padding of the last chunk has no energy, but repeats a face.
        on[name] = np.asarray(found.u).sum(axis=(0, 1))
        if name in contact.guards:
            on[name] = on[name] + contact.guards[name].touch(X + u).slope.sum(axis=0)
        near = distances(obstacle.shape, seen, places) < obstacle.activation
        # Faces that stand on the obstacle, beside what touches, are near it too.
        facing = np.maximum(-np.sum(normals(seen, X + u) * away_from(obstacle.shape, seen, places), axis=-1), 0.0)
        area[name] = float(np.sum(seen.weight[:, None] * near * facing * seen.data))
    pressed = 0.0 if contact.own is None else np.linalg.norm(contact.own.touch(X + u).slope, axis=1).sum() / 2
    return ContactForces(on, area, float(pressed))
