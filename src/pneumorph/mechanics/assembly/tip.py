"""Nodes without displacements of their own: those of the tip, bonded to the rigid plate, and images in a sector's cut.

A node on the tip is displaced by u = c + (R(θ) − I) o, o = X − X̄ its offset from the centroid of the undeformed face;
here are the derivatives by plate and nodes, to second order.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import NamedTuple

import numpy as np

from pneumorph.mechanics.elements.element import TRIANGLE_DN, TRIANGLE_N, TRIANGLE_WEIGHTS
from pneumorph.mechanics.elements.turns import turns


class Tied(NamedTuple):
    """Nodes in the second cut of a sector, which are displaced as those in the first whose images they are.

    Attributes
    ----------
    nodes, sources : (n,) int
        The images, but for those on the tip of a plate, and the nodes in the first cut.
    turn : (3, 3)
        The rotation from the first cut to the second.
    """

    nodes: np.ndarray
    sources: np.ndarray
    turn: np.ndarray

    def led(self, vectors: np.ndarray) -> None:
        """Set nodal vectors (N, 3) at the images."""
        vectors[self.nodes] = vectors[self.sources] @ self.turn.T

    def gathered(self, forces: np.ndarray) -> None:
        """The transpose: forces (N, 3) on the images act on the nodes in the first cut."""
        forces[self.sources] += forces[self.nodes] @ self.turn
        forces[self.nodes] = 0.0


NOTHING_TIED = Tied(np.zeros(0, int), np.zeros(0, int), np.eye(3))


class Tip(NamedTuple):
    """The tip face, and what else has no displacements of its own.

    Attributes
    ----------
    nodes : (t,) int
        Nodes bonded to the plate; empty for a free tip.
    triangles : (T, 6) int
        Triangles of the face.
    even : (3,)
        Ones, with 0 for the components that cancel in means over the whole body.
    tied : Tied
        The images in the second cut of a sector.
    """

    nodes: np.ndarray
    triangles: np.ndarray
    even: np.ndarray
    tied: Tied = NOTHING_TIED


def tip_mean(tip: Tip, X: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Area mean of nodal values (N, k) over the undeformed tip face of the mesh; zero where it has none."""
    if not len(tip.triangles):
        return np.zeros(values.shape[1])
    measure, _, _ = _measures(X[tip.triangles])
    share = np.einsum("fq,qa->fa", measure, TRIANGLE_N) / measure.sum()
    return np.einsum("fa,fak->k", share, values[tip.triangles])


def tip_centre(tip: Tip, X: np.ndarray, x: np.ndarray) -> np.ndarray:
    """Mean (3,) of vectors x (N, 3) over the undeformed tip face of the whole body; the centroid if x is X."""
    return tip.even * tip_mean(tip, X, x)


def centre_slope(tip: Tip, X: np.ndarray) -> np.ndarray:
    """Derivative (3, t, 3) of the centroid by the nodes of the tip: its component, their number, their component."""
    measure, normal, along = _measures(X[tip.triangles])
    total = measure.sum()
    share = np.einsum("fq,qa->fa", measure, TRIANGLE_N) / total
    place = np.einsum("qa,fai->fqi", TRIANGLE_N, X[tip.triangles])
    away = (place - np.einsum("fa,fai->i", share, X[tip.triangles])) / total
    # |n| grows by n̂·(dx_ξ × x_η + x_ξ × dx_η).
    unit = normal / np.linalg.norm(normal, axis=-1, keepdims=True)
    by_first, by_second = np.cross(along[1], unit), np.cross(unit, along[0])
    growth = np.einsum("fqj,qa->fqaj", by_first, TRIANGLE_DN[:, :, 0])
    growth += np.einsum("fqj,qa->fqaj", by_second, TRIANGLE_DN[:, :, 1])
    by_corner = np.einsum("q,fqi,fqaj->faij", TRIANGLE_WEIGHTS, away, growth) + share[..., None, None] * np.eye(3)
    slope = np.zeros((len(tip.nodes), 3, 3))
    np.add.at(slope, np.searchsorted(tip.nodes, tip.triangles), by_corner)
    return tip.even[:, None, None] * slope.transpose(1, 0, 2)


def _measures(x: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Of triangles x (T, 6, 3): areas (T, 6) and normals (T, 6, 3) of the quadrature points; x_ξ, x_η (2, T, 6, 3)."""
    along = np.einsum("fai,qak->kfqi", x, TRIANGLE_DN)
    normal = np.cross(along[0], along[1])
    return TRIANGLE_WEIGHTS * np.linalg.norm(normal, axis=-1), normal, along


@dataclass(frozen=True)
class Ride:
    """The tip nodes of a body at X (N, 3), carried along by the plate at [c, θ] (6,)."""

    tip: Tip
    X: np.ndarray
    plate: np.ndarray

    @cached_property
    def _turn(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        return turns(np.asarray(self.plate[3:], dtype=float))

    @cached_property
    def _offset(self) -> np.ndarray:
        if not len(self.tip.nodes):
            return np.zeros((0, 3))
        return self.X[self.tip.nodes] - tip_centre(self.tip, self.X, self.X)

    @cached_property
    def _slope(self) -> np.ndarray:
        return centre_slope(self.tip, self.X) if len(self.tip.nodes) else np.zeros((3, 0, 3))

    def displacement(self) -> np.ndarray:
        """Displacements u (t, 3) of the tip nodes."""
        return self.plate[:3] + self._offset @ self._turn[0].T

    def along(self, dplate: np.ndarray) -> np.ndarray:
        """δu (t, 3) where the plate moves by dplate (6,)."""
        return dplate[:3] + self._offset @ (self._turn[1] @ dplate[3:]).T

    def moved(self, dX: np.ndarray) -> np.ndarray:
        """δu (t, 3) where the nodes of the tip move by dX (t, 3)."""
        return self._apart(dX) @ self._turn[0].T

    def _apart(self, dX: np.ndarray) -> np.ndarray:
        """Change of the offsets."""
        return dX - np.einsum("itj,tj->i", self._slope, dX)

    def on_plate(self, forces: np.ndarray) -> np.ndarray:
        """Force and moment (6,) on the plate of forces (t, 3) on the nodes."""
        by_angle = np.einsum("ti,ijk,tj->k", forces, self._turn[1], self._offset)
        return np.concatenate([forces.sum(axis=0), by_angle])

    def on_plate_changed(self, forces: np.ndarray, dplate: np.ndarray, dX: np.ndarray | None = None) -> np.ndarray:
        """Change (6,) of `on_plate` where the plate moves by dplate and the nodes by dX (t, 3), at constant forces."""
        _, first, second = self._turn
        moment = forces.T @ self._offset
        by_angle = np.einsum("ij,ijkl,l->k", moment, second, dplate[3:])
        if dX is not None:
            by_angle += np.einsum("ij,ijk->k", forces.T @ self._apart(dX), first)
        return np.concatenate([np.zeros(3), by_angle])

    def on_places(self, forces: np.ndarray) -> np.ndarray:
        """Derivative (t, 3) of forces·u by the positions of the nodes."""
        return self._back(forces, self._turn[0])

    def on_places_along(self, forces: np.ndarray, dplate: np.ndarray) -> np.ndarray:
        """Derivative (t, 3) of forces·δu by the positions of the nodes, with δu of `along`."""
        return self._back(forces, self._turn[1] @ dplate[3:])

    def _back(self, forces: np.ndarray, turn: np.ndarray) -> np.ndarray:
        turned = forces @ turn
        return turned - np.einsum("itj,i->tj", self._slope, turned.sum(axis=0))
