"""A chain of rigid links with springs and pressures as torques, for programs of rigid bodies.

Between stations on the axis there is a joint in the middle, which extends along the link before it and turns about x, y
and z (in this order, each about the axes turned before). Its spring has the stiffness of a rod as soft as the body's
tip against forces along it and moments. At equilibrium its coordinates are q = q₀ + G p, where q₀ is that without
pressure and G is fitted to exact states: the torques of the pressures p are K G p.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from scipy.spatial.transform import Rotation

from pneumorph.errors import Hopeless, ProblemError
from pneumorph.surrogate.states import Sample, States

HELD_OUT = 5
"""Random states at which the chain is compared with exact ones."""
ORDER = (2, 3, 4, 5)
"""Of the six motions of the tip, those that a joint has: along z, and about x, y and z."""


@dataclass(frozen=True, eq=False)
class Chain:
    """A chain with k joints, driven by C pressures.

    Attributes
    ----------
    chambers : tuple of str
    bounds : (C, 2) array
        MPa, of the pressures to which it is fitted.
    stations : (k + 1,) array
        Heights of the stations at rest, from the base to the tip, mm.
    rest : (k, 4) array
        Coordinates of the joints without pressure: mm along z, rad about x, y and z.
    by_pressure : (k, 4, C) array
        Their derivatives, per MPa.
    stiffness : (k, 4) array
        N/mm and N·mm/rad.
    off : (n, 2) array
        mm and rad, by which its tip misses exact states that it was not fitted to.
    spans : (2,) array
        Largest translation and rotation of the tip at these states, mm and rad.
    sideways : float
        Its compliance against a force across the tip, over that of the body: the rod does not shear.
    """

    chambers: tuple[str, ...]
    bounds: np.ndarray
    stations: np.ndarray
    rest: np.ndarray
    by_pressure: np.ndarray
    stiffness: np.ndarray
    off: np.ndarray
    spans: np.ndarray
    sideways: float

    def tip(self, pressures: np.ndarray) -> tuple[np.ndarray, Rotation]:
        """Place (3,) in mm and rotation of the tip at pressures (C,) in MPa, at equilibrium and without other loads."""
        return _tip(self.stations, self.rest + self.by_pressure @ pressures)


def fitted_chain(states: States, stations: np.ndarray) -> Chain:
    """The chain of a body, fitted to states within the bounds of pressures.

    Parameters
    ----------
    states : with a section for every station but the first and the last.
    stations : (k + 1,) mm

    Raises
    ------
    ProblemError
        If a motion of the tip that the chain has is held.
    Hopeless
        If a state is missing.
    """
    bounds, count = states.bounds, len(states.names)
    resting = _found(states, np.zeros(count))
    soft = np.diag(resting.compliance)[list(ORDER)]
    if (soft <= 0.0).any():
        raise ProblemError("chain: motions of the tip are held; write that of a body whose tip is free to move")
    q0 = _coordinates(stations, resting)
    single = [share * bounds[:, 1] * one for one in np.eye(count) for share in (0.5, 1.0)]
    known = np.array([*single, *([bounds[:, 1]] if count > 1 else [])])
    moved = np.array([_coordinates(stations, _found(states, p)) - q0 for p in known])
    slopes = np.linalg.lstsq(known, moved.reshape(len(known), -1), rcond=None)[0]
    by_pressure = slopes.T.reshape(*q0.shape, count)
    stiffness = stations[-1] / np.diff(stations)[:, None] / soft
    drawn = np.random.default_rng(0).uniform(bounds[:, 0], bounds[:, 1], (HELD_OUT, count))
    off, spans = [], []
    for p in drawn:
        exact = _found(states, p)
        x, turn = _tip(stations, q0 + by_pressure @ p)
        gone = Rotation.from_rotvec(exact.values[3:6])
        off.append([np.linalg.norm(x - exact.values[:3] - [0, 0, stations[-1]]), (turn * gone.inv()).magnitude()])
        spans.append([np.linalg.norm(exact.values[:3]), gone.magnitude()])
    lever = stations[-1] - (stations[1:] + stations[:-1]) / 2
    sideways = (lever**2 / stiffness[:, 2]).sum() / resting.compliance[0, 0]
    return Chain(
        states.names,
        bounds,
        stations,
        q0,
        by_pressure,
        stiffness,
        np.array(off),
        np.max(spans, axis=0),
        float(sideways),
    )


def _found(states: States, pressures: np.ndarray) -> Sample:
    found = states.at(pressures)
    if isinstance(found, Sample):
        return found
    at = ", ".join(f"{name} {1e3 * p:.4g} kPa" for name, p in zip(states.names, pressures, strict=True))
    raise Hopeless(f"chain: at {at}: {found}; give narrower bounds")


def _coordinates(stations: np.ndarray, sample: Sample) -> np.ndarray:
    """Coordinates (k, 4) of the joints in a state."""
    count = len(stations) - 2
    sections = sample.values[len(sample.values) - 6 * count :].reshape(count, 6)
    tip = sample.values[:6] + np.array([0, 0, stations[-1], 0, 0, 0])
    frames = np.array([np.zeros(6), *sections, tip])
    q, half = np.zeros((count + 1, 4)), np.diff(stations) / 2
    for number, (below, above) in enumerate(pairwise(frames)):
        one, other = Rotation.from_rotvec(below[3:]), Rotation.from_rotvec(above[3:])
        links = (one.as_matrix()[:, 2] + other.as_matrix()[:, 2]) * half[number]
        q[number, 0] = (above[:3] - below[:3] - links) @ one.as_matrix()[:, 2]
        q[number, 1:] = (one.inv() * other).as_euler("XYZ")
    return q


def _tip(stations: np.ndarray, q: np.ndarray) -> tuple[np.ndarray, Rotation]:
    place, turn = np.zeros(3), Rotation.identity()
    for half, joint in zip(np.diff(stations) / 2, q, strict=True):
        place = place + turn.apply([0.0, 0.0, half + joint[0]])
        turn = turn * Rotation.from_euler("XYZ", joint[1:])
        place = place + turn.apply([0.0, 0.0, half])
    return place, turn
