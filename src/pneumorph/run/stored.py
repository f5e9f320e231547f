"""One design as a run stores it."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from pneumorph.geometry import Body, Surface
from pneumorph.geometry.starting import body_of
from pneumorph.problem import Problem
from pneumorph.results.arrays import floats

BEYOND = 100.0
"""Farthest that a point of a stored design may lie from the origin, in lengths of the body."""


@dataclass(frozen=True)
class StoredDesign:
    """One design as stored.

    Attributes
    ----------
    exterior : ndarray, mm
        Control points of the exterior, for a tube its net (n_r, n_q, 3).
    chambers : dict of str to ndarray, mm
        Those of every chamber, by its name in the problem.
    pressures : dict of str to dict of str to float, MPa
        Pressures by task, then by chamber.
    """

    exterior: np.ndarray
    chambers: dict[str, np.ndarray]
    pressures: dict[str, dict[str, float]]

    @classmethod
    def of(cls, body: Body, pressures: dict[str, dict[str, float]]) -> StoredDesign:
        """The stored form of a body and its pressures."""
        exterior, *chambers = body.nets()
        return cls(exterior, {each.name: net for each, net in zip(body.chambers, chambers, strict=True)}, pressures)

    def body(self, problem: Problem) -> Body:
        """The body of this design; `problem` is the one it was made for."""
        return self.on(body_of(problem))

    def on(self, start: Body) -> Body:
        """The same from the body with which the run began."""
        nets = [self.exterior, *(self.chambers[chamber.name] for chamber in start.chambers)]
        return start.with_control_points(np.concatenate([net.reshape(-1, 3) for net in nets]))

    def pack(self, tasks: Sequence[str]) -> dict[str, np.ndarray]:
        """Its arrays for a file, with a row of pressures for each task."""
        rows = [[self.pressures[task][name] for name in self.chambers] for task in tasks]
        nets = {f"chamber_{name}": net for name, net in self.chambers.items()}
        return {"exterior": self.exterior, **nets, "pressures": np.array(rows)}


def unpack_design(arrays: dict[str, np.ndarray], start: Body, tasks: Sequence[str]) -> StoredDesign:
    """The design of a file, checked to be one of a run that begins with a body and has these tasks.

    Raises
    ------
    KeyError, ValueError
        If it is not one.
    """
    chambers = [chamber.name for chamber in start.chambers]
    most = BEYOND * float(np.abs(start.control_points()).max())
    pressures = floats(arrays, "pressures", len(tasks), len(chambers))
    return StoredDesign(
        exterior=_net(arrays, "exterior", start.exterior, most),
        chambers={each.name: _net(arrays, f"chamber_{each.name}", each, most) for each in start.chambers},
        pressures={
            task: dict(zip(chambers, map(float, row), strict=True)) for task, row in zip(tasks, pressures, strict=True)
        },
    )


def _net(arrays: dict[str, np.ndarray], name: str, start: Surface, most: float) -> np.ndarray:
    """A stored control net, of the shape that it had at the start, and with an extent in every direction."""
    net = floats(arrays, name, *start.shape, 3, most=most)
    if not np.ptp(net.reshape(-1, 3), axis=0).min() > 0.0:
        raise ValueError(f'"{name}" is no body: its points lie in a plane')
    return net.astype(float)
