"""What is drawn, from where it is seen, and its colours."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from pneumorph.mesh.tets import TetMesh

COLOURS = ("#cdd8e2", "#f5e6a8", "#f4a24e", "#d6321f", "#7a0403")
"""Colours of the rubber, from no stretch to the largest."""

CUT = "#9fb0c0"
"""Colour of the cut face of a body at rest."""

RIM = "#46525e"
"""Colour of the line around a cut face."""


def colour_map() -> LinearSegmentedColormap:
    """The colour map of the stretch."""
    return LinearSegmentedColormap.from_list("stretch", COLOURS)


@dataclass(frozen=True, eq=False)
class Shape:
    """A body to draw: its mesh at rest, displacements u (N, 3) in mm, and a field (N,) at the nodes for its colours."""

    mesh: TetMesh
    u: np.ndarray
    field: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class View:
    """A view of bodies, in parallel projection.

    Attributes
    ----------
    normal : (3,) unit vector perpendicular to z, away from the camera: the normal of the plane of the cut. The part in
        front of the plane is removed.
    offset : distance of the plane from the axis along the normal, mm.
    elevation, turn : degrees by which the camera is above the horizon and to the side of the normal.
    """

    normal: np.ndarray
    offset: float = 0.0
    elevation: float = 12.0
    turn: float = 18.0

    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Unit vectors to the right, up, and towards the camera."""
        across = np.cross(self.normal, [0.0, 0.0, 1.0])
        turn, up = np.radians([self.turn, self.elevation])
        level = -np.cos(turn) * self.normal + np.sin(turn) * across
        camera = np.cos(up) * level + np.sin(up) * np.array([0.0, 0.0, 1.0])
        right = np.cross([0.0, 0.0, 1.0], level)
        return right, np.cross(camera, right), camera

    def extent(self, shapes: list[Shape]) -> np.ndarray:
        """Left, right, bottom and top (4,) in mm of the smallest picture that holds every shape."""
        right, up, _ = self.axes()
        flat = [(shape.mesh.points + shape.u) @ np.column_stack([right, up]) for shape in shapes]
        low = np.min([points.min(axis=0) for points in flat], axis=0)
        high = np.max([points.max(axis=0) for points in flat], axis=0)
        return np.array([low[0], high[0], low[1], high[1]])


@dataclass(frozen=True, eq=False)
class Job:
    """Shapes to draw, each in its own picture, all with the same extent (mm) and range of colours."""

    shapes: list[Shape]
    view: View
    extent: np.ndarray
    range: tuple[float, float]
