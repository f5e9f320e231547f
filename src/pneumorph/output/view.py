"""What is drawn, and how it is looked at."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from pneumorph.mesh.tets import TetMesh

COLOURS = ("#cdd8e2", "#f5e6a8", "#f4a24e", "#d6321f", "#7a0403")
"""From rubber at rest to rubber stretched most."""

CUT = "#9fb0c0"
"""Of the cut through rubber at rest."""

RIM = "#46525e"
"""Of the line around a cut."""


def colour_map() -> LinearSegmentedColormap:
    """The colours of stretch."""
    return LinearSegmentedColormap.from_list("stretch", COLOURS)


@dataclass(frozen=True, eq=False)
class Shape:
    """A body to draw: its mesh at rest, displacements u (N, 3) in mm, and a field on the nodes (N,) that colours it."""

    mesh: TetMesh
    u: np.ndarray
    field: np.ndarray | None = None


@dataclass(frozen=True, eq=False)
class View:
    """How bodies are looked at, by parallel projection.

    Attributes
    ----------
    normal : (3,) unit vector across z; what lies in front of a plane, against it, is cut away.
    offset : mm from the axis to that plane, along the normal.
    elevation, turn : degrees by which the camera stands above the horizon and beside the normal.
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
    """Shapes to draw, each in a picture of its own of the same extent (mm) and with the same range of colours."""

    shapes: list[Shape]
    view: View
    extent: np.ndarray
    range: tuple[float, float]
