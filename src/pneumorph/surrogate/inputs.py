"""What a fast model may depend on beside pressures: the force on the tip, and where gravity points."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from pneumorph.mechanics import Loads
from pneumorph.problem.acting import Acting

FORCES = ("force_x", "force_y", "force_z")
"""Components of the force on the plate, N."""

GRAVITIES = ("gravity_x", "gravity_y", "gravity_z")
"""Components of gravity in parts of the acceleration that the problem has: of length one where it only turns."""


def acting_at(under: Acting, values: Mapping[str, float]) -> Acting:
    """Loads with some components at other values.

    Parameters
    ----------
    under : Acting
        The others; with gravity, if components of it are given.
    values : {name: float}
        Of `FORCES` and `GRAVITIES`.
    """
    force = tuple(values.get(name, own) for name, own in zip(FORCES, under.force, strict=True))
    if under.gravity is None or not any(name in values for name in GRAVITIES):
        return replace(under, force=force)
    parts = np.array([values.get(name, own) for name, own in zip(GRAVITIES, under.gravity.direction, strict=True)])
    length = float(np.linalg.norm(parts))
    along = tuple((parts / length).tolist()) if length else under.gravity.direction
    gravity = under.gravity.model_copy(update={"acceleration": length * under.gravity.acceleration, "direction": along})
    return replace(under, force=force, gravity=gravity)


def usual_of(under: Acting, names: Sequence[str]) -> list[float]:
    """The values that components have in loads."""
    direction = (0.0, 0.0, 0.0) if under.gravity is None else under.gravity.direction
    own: dict[str, float] = dict(zip((*FORCES, *GRAVITIES), (*under.force, *direction), strict=True))
    return [float(own[name]) for name in names]


def changed(loads: Loads, name: str, acceleration: float) -> Loads:
    """Loads with one more of a component; gravity has this acceleration, mm/s²."""
    if name in FORCES:
        return loads._replace(wrench=np.asarray(loads.wrench) + np.eye(6)[FORCES.index(name)])
    more = acceleration * np.eye(3)[GRAVITIES.index(name)]
    return loads._replace(acceleration=np.asarray(loads.acceleration) + more)
