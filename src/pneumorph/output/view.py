"""What is drawn, from where it is seen, and its colours."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from matplotlib.colors import LinearSegmentedColormap

from pneumorph.mesh.tets import TetMesh

COLOURS = ("#cdd8e2", "#f5e6a8", "#f4a24e", "#d6321f", "#7a0403")
"""Colours of the rubber, from no stretch to the largest."""

CUT = "#9fb0c0"
"""Colour of a cut face without a field."""

OBSTACLE = "#8d8d8d"
"""Colour of rigid obstacles."""

COVERING = "#1f5f8b"
"""Colour of sheets and fibres."""

RIM = "#46525e"
"""Colour of the line around a cut face."""

JOBS = "jobs"
"""The file with the jobs, in the folder of a process that draws."""


@dataclass(frozen=True)
class Colours:
    """A scale of colours: what it is of, and its colours from the least value to the largest."""

    label: str
    stops: tuple[str, ...]

    def map(self) -> LinearSegmentedColormap:
        """The colour map."""
        return LinearSegmentedColormap.from_list(self.label, self.stops)


STRETCH = Colours("largest principal stretch", COLOURS)


@dataclass(frozen=True, eq=False)
class Shape:
    """A meshed body to draw.

    Attributes
    ----------
    mesh : TetMesh
        At rest.
    u : (N, 3) mm
        Displacements.
    field : (N,) or None
        Values at the nodes for its colours.
    inside : bool
        Whether the field is known inside too; otherwise the cut face has no colours.
    """

    mesh: TetMesh
    u: np.ndarray
    field: np.ndarray | None = None
    inside: bool = True

    @property
    def rest(self) -> np.ndarray:
        """Points (N, 3) of the body at rest."""
        return self.mesh.points

    @property
    def points(self) -> np.ndarray:
        """Points (N, 3) of the body as it is drawn."""
        return self.mesh.points + self.u


@dataclass(frozen=True, eq=False)
class Shell:
    """A body at rest by its surfaces alone: closed triangles (T, 3) of points (N, 3), with normals out of the solid."""

    points: np.ndarray
    triangles: np.ndarray

    @property
    def rest(self) -> np.ndarray:
        """The points."""
        return self.points


@dataclass(frozen=True, eq=False)
class Covering:
    """What lies on surfaces of a body: triangles (m, 3) or strokes (m, 2) between points (n, 3), and these at rest."""

    rest: np.ndarray
    points: np.ndarray
    cells: np.ndarray


@dataclass(frozen=True, eq=False)
class View:
    """A view of bodies, in parallel projection.

    Attributes
    ----------
    normal : (3,) unit normal of the cutting plane, perpendicular to the axis z or along it, away from the camera.
        The part in front of the plane is removed.
    offset : distance of the plane from the origin along the normal, mm; None for no cut.
    elevation, turn : degrees by which the camera is above the normal and to its side.
    """

    normal: np.ndarray
    offset: float | None = 0.0
    elevation: float = 12.0
    turn: float = 18.0

    @property
    def along(self) -> bool:
        """Whether the body is seen along its axis."""
        return abs(float(self.normal[2])) > 0.5

    def axes(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Unit vectors to the right, up, and towards the camera."""
        top = np.array([0.0, 1.0, 0.0] if self.along else [0.0, 0.0, 1.0])
        across = np.cross(self.normal, top)
        turn, up = np.radians([self.turn, self.elevation])
        level = -np.cos(turn) * self.normal + np.sin(turn) * across
        camera = np.cos(up) * level + np.sin(up) * top
        right = np.cross(top, level)
        return right, np.cross(camera, right), camera

    def flat(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) as they are seen: mm to the right and up (..., 2)."""
        right, up, _ = self.axes()
        return points @ np.column_stack([right, up])

    def __str__(self) -> str:
        """The cut in words: "cut yz", "cut xz at y = 3 mm", "cut 30° from xz"."""
        if self.offset is None:
            return "not cut"
        for number, (plane, axis) in enumerate((("yz", "x"), ("xz", "y"), ("xy", "z"))):
            if abs(self.normal[number]) > 1.0 - 1e-9:
                place = f" at {axis} = {self.normal[number] * self.offset:.3g} mm"
                return f"cut {plane}{place if self.offset else ''}"
        across = np.cross(self.normal, [0.0, 0.0, 1.0])
        place = f", {abs(self.offset):.3g} mm off the axis" if self.offset else ""
        return f"cut {np.degrees(np.arctan2(across[1], across[0])):.0f}° from xz{place}"


@dataclass(frozen=True, eq=False)
class Panel:
    """One picture: what, from where, and its extent: left, right, bottom and top (4,) in mm, see `View.flat`.

    `obstacles` are rigid bodies beside it, `coverings` are sheets and fibres on it.
    """

    shape: Shape | Shell
    view: View
    extent: np.ndarray
    obstacles: Sequence[Shell] = ()
    coverings: Sequence[Covering] = ()


@dataclass(frozen=True, eq=False)
class Job:
    """Pictures to draw, with one range of colours and one number of dots per mm."""

    panels: Sequence[Panel]
    range: tuple[float, float]
    dots: float
    colours: Colours = STRETCH


def drawn_name(number: int) -> str:
    """The file with the pictures of a job, in the same folder."""
    return f"{number}.npz"
