"""The displacements of all nodes, as functions of the unknowns, with their derivatives.

Nodes on the tip follow the plate, and images in a sector's cut the nodes whose images they are; see `tip.py`.
"""

from __future__ import annotations

from functools import cached_property

import numpy as np

from pneumorph.mechanics.assembly.tip import Ride, Tip
from pneumorph.mechanics.elements.kinematics import State


class Displacement:
    """The displacements of all nodes of a body at X (N, 3) mm in a state, with derivatives by nodes and unknowns."""

    def __init__(self, tip: Tip, X: np.ndarray, state: State):
        self.tip, self.X, self.state = tip, X, state
        self.ride = Ride(tip, X, state.plate)

    @cached_property
    def u(self) -> np.ndarray:
        """Displacements (N, 3), mm."""
        return self._whole(self.state.u, self.ride.displacement())

    def along(self, change: State, dX: np.ndarray | None = None) -> np.ndarray:
        """Their derivative (N, 3) along a change of the unknowns and a motion dX (N, 3) of the nodes."""
        on_tip = self.ride.along(change.plate)
        if dX is not None:
            on_tip = on_tip + self.ride.moved(dX[self.tip.nodes])
        return self._whole(change.u, on_tip)

    def none(self) -> State:
        """Zeros by the displacements of all nodes and by the other unknowns."""
        return State(np.zeros(self.X.shape), *(np.zeros(part.shape) for part in self.state[1:]))

    def on_unknowns(self, full: State) -> State:
        """Forces on the unknowns from those on all nodes, which are overwritten: forces on the tip act on the plate."""
        nodes = self.tip.nodes
        self.tip.tied.gathered(full.u)
        if not len(nodes):
            return full
        plate = full.plate + self.ride.on_plate(full.u[nodes])
        full.u[nodes] = 0.0
        return full._replace(plate=plate)

    def pulled(self, by_u: np.ndarray) -> State:
        """The transpose of `along`: derivatives by the unknowns from those (N, 3) by all displacements."""
        return self.on_unknowns(self.none()._replace(u=by_u.copy()))

    def pulled_to_nodes(self, by_u: np.ndarray) -> np.ndarray:
        """Derivatives (N, 3) by X, through the tip, from those by all displacements."""
        by_X, nodes = np.zeros(self.X.shape), self.tip.nodes
        if len(nodes):
            by_X[nodes] = self.ride.on_places(by_u[nodes])
        return by_X

    def _whole(self, u: np.ndarray, on_tip: np.ndarray) -> np.ndarray:
        whole = np.array(u, dtype=float)
        whole[self.tip.nodes] = on_tip
        self.tip.tied.led(whole)
        return whole


def displacement(tip: Tip, X: np.ndarray, state: State) -> np.ndarray:
    """Displacements (N, 3) of all nodes in a state, mm."""
    return Displacement(tip, X, state).u
