"""What the parts of a body's surface are: clamped base, tip, chambers, and the rest."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from pneumorph.cad.faces import Faces
from pneumorph.cad.ports import Open, open_chamber
from pneumorph.cad.shells import Shell, encloses, place, shells_of
from pneumorph.errors import MeshError


@dataclass(frozen=True)
class Extreme:
    """Faces in the lowest plane along z, for −1, or the highest, for 1."""

    sign: float

    def holds(self, faces: Faces, tolerance: float) -> np.ndarray:
        """Which nodes (n,) are there."""
        z = self.sign * faces.points[:, 2]
        return z >= z.max() - tolerance

    def __str__(self) -> str:
        return f"in the {'highest' if self.sign > 0 else 'lowest'} plane along z"


@dataclass(frozen=True)
class InPlane:
    """Faces in the plane where the coordinate of an axis, 0 to 2, is `at`, mm."""

    axis: int
    at: float

    def holds(self, faces: Faces, tolerance: float) -> np.ndarray:
        """Which nodes (n,) are there."""
        return np.abs(faces.points[:, self.axis] - self.at) <= tolerance

    def __str__(self) -> str:
        return f"in the plane {'xyz'[self.axis]} = {self.at:g} mm"


@dataclass(frozen=True)
class InBox:
    """Faces that lie wholly in a box between two corners, mm."""

    lower: tuple[float, float, float]
    upper: tuple[float, float, float]

    def holds(self, faces: Faces, tolerance: float) -> np.ndarray:
        """Which nodes (n,) are there."""
        low, high = np.array(self.lower) - tolerance, np.array(self.upper) + tolerance
        return np.all((faces.points >= low) & (faces.points <= high), axis=1)

    def __str__(self) -> str:
        return f"wholly within the box from {place(np.array(self.lower))} to {place(np.array(self.upper))}"


@dataclass(frozen=True)
class Named:
    """Faces with this name in the file."""

    name: str

    def holds(self, faces: Faces, tolerance: float) -> np.ndarray:
        """Which nodes (n,) are there."""
        named = np.array([name == self.name for name in faces.names])
        found = np.zeros(len(faces.points), bool)
        found[faces.triangles[named[faces.face]]] = True
        return found

    def __str__(self) -> str:
        return f'named "{self.name}"'


Where = Extreme | InPlane | InBox | Named

FLAT = 1e-5
"""How far from a plane nodes in it may be, relative to the diagonal of the body."""


def faces_where(faces: Faces, where: Where) -> np.ndarray:
    """The triangles (m,) bool of all faces that lie wholly somewhere, or have a name."""
    away = ~where.holds(faces, FLAT * faces.diagonal)[faces.triangles].all(axis=1)
    wrong = np.zeros(int(faces.face.max()) + 1, bool)
    wrong[faces.face[away]] = True
    if isinstance(where, Named):
        # All nodes of a face may be on its neighbours.
        wrong |= np.array([name != where.name for name in faces.names[: len(wrong)]])
    return ~wrong[faces.face]


def triangles_where(faces: Faces, where: Where) -> np.ndarray:
    """Six-node triangles (k, 6) somewhere: of the faces there, and of where solids meet in a plane or a box."""
    return np.concatenate([faces.triangles[faces_where(faces, where)], faces.between[meeting_where(faces, where)]])


def meeting_where(faces: Faces, where: Where) -> np.ndarray:
    """The triangles (k,) bool where solids meet that are in a plane or a box; they have no names."""
    if isinstance(where, Named):
        return np.zeros(len(faces.between), bool)
    return np.all(where.holds(faces, FLAT * faces.diagonal)[faces.between], axis=1)


@dataclass(frozen=True)
class Place:
    """Where a chamber is: around a point, mm, and open in the plane of a port, if it has one."""

    point: tuple[float, float, float]
    port: InPlane | None = None


@dataclass(frozen=True, eq=False)
class Parts:
    """The parts of a body's surface.

    Attributes
    ----------
    triangles : dict of (k,) int
        Of "base", "tip", "exterior", and "chamber <name>" of every chamber, in `Faces.triangles`.
    chambers : dict of Shell or Open
        By their names.
    """

    triangles: dict[str, np.ndarray]
    chambers: dict[str, Shell | Open]

    @property
    def caps(self) -> dict[str, np.ndarray]:
        """The caps (c, 4) of chambers that open through ports, see `Open.cap`, by the names of chambers."""
        return {name: found.cap for name, found in self.chambers.items() if isinstance(found, Open)}


def parts_of(faces: Faces, base: Where, tip: Where, places: Mapping[str, Place]) -> Parts:
    """The parts of a body's surface.

    Parameters
    ----------
    faces : Faces
    base, tip : where they are.
    places : where chambers are, by their names.

    Raises
    ------
    MeshError
        If there is no such face, void or opening, or a void that has no name; a sentence whose subject is the file.
    """
    shells = shells_of(faces)
    chambers = chambers_at(faces, shells.voids, places)
    closed = [id(void) for void in chambers.values()]
    for void in shells.voids:
        if id(void) not in closed:
            raise MeshError(
                f"has a void of {-void.volume:.3g} mm³ at {place(void.centre)} that is no chamber; add a table "
                "[[body.chamber]] for it, or fill it in CAD"
            )
    parts: dict[str, np.ndarray] = {}
    own = np.zeros(len(faces.triangles), bool)
    own[shells.outside.triangles] = True
    for found in chambers.values():
        own[found.triangles] = False
    for name, where in (("base", base), ("tip", tip)):
        chosen = own & faces_where(faces, where)
        if not chosen.any():
            known = ", ".join(sorted({each for each in faces.names if each})[:8])
            others = f"; its faces have the names {known}" if known and isinstance(where, Named) else ""
            raise MeshError(f"has no face {where} for the {name}{others}; give body.{name} another place")
        parts[name] = np.flatnonzero(chosen)
    both = np.intersect1d(parts["base"], parts["tip"])
    if len(both):
        where = place(faces.points[faces.triangles[both[0], 0]])
        raise MeshError(f"has a face at {where} that is base and tip at once; give body.base and body.tip apart")
    parts["exterior"] = np.setdiff1d(np.flatnonzero(own), np.concatenate(list(parts.values())))
    return Parts(parts | {f"chamber {name}": found.triangles for name, found in chambers.items()}, chambers)


def chambers_at(faces: Faces, voids: tuple[Shell, ...], places: Mapping[str, Place]) -> dict[str, Shell | Open]:
    """The chamber at each place, by their names.

    Raises
    ------
    MeshError
        If there is none, or two places are in one.
    """
    found: dict[str, Shell | Open] = {}
    for name, where in places.items():
        point = np.array(where.point)
        if where.port is not None:
            opened = open_chamber(faces, point, where.port.holds(faces, FLAT * faces.diagonal))
            shared = [other for other, each in found.items() if np.isin(each.triangles, opened.triangles).any()]
            if shared:
                raise MeshError(f'has the points of "{shared[0]}" and "{name}" in one chamber; leave one of them out')
            found[name] = opened
            continue
        around = next((void for void in voids if encloses(faces, void, point)), None)
        if around is None:
            centres = ", ".join(place(void.centre) for void in voids[:8])
            there = f"its closed voids are at {centres}" if voids else "give the plane of its port"
            raise MeshError(f'has no closed void around {place(point)}, chamber "{name}"; {there}')
        if any(around is other for other in found.values()):
            raise MeshError(f'has the points of two chambers in one void at {place(around.centre)}; leave "{name}" out')
        found[name] = around
    return found


def point_inside(faces: Faces, void: Shell) -> np.ndarray:
    """A point (3,) in a void, mm: its centroid or, where that is not in it, half way to the far side of it.

    Raises
    ------
    MeshError
        If the void has no volume.
    """
    if encloses(faces, void, void.centre):
        return void.centre
    corners = faces.points[faces.triangles[void.triangles, :3]]
    normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    largest = np.linalg.norm(normals, axis=1).argsort()[::-1]
    # From the middle of a triangle along its normal, which points into the void.
    for number in largest:
        middle, normal = corners[number].mean(axis=0), normals[number] / np.linalg.norm(normals[number])
        for step in np.linalg.norm(void.upper - void.lower) * 0.5 ** np.arange(1, 12):
            if encloses(faces, void, middle + step * normal):
                return middle + step * normal
    raise MeshError(f"has a void without any volume at {place(void.centre)}; fill it in CAD")
