"""Whether a mirror plane maps all that a problem says of a body from a file to itself."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pneumorph.cad.faces import Faces
from pneumorph.cad.parts import FLAT, InPlane, triangles_where
from pneumorph.cad.ports import Open, opens_around
from pneumorph.cad.shells import SYMMETRIC, Shell, asymmetry, encloses
from pneumorph.cad.solids import solids_at
from pneumorph.errors import MeshError
from pneumorph.problem.designed import reinforcements
from pneumorph.problem.reinforcement import FibresSpec
from pneumorph.problem.solid import SolidSpec
from pneumorph.problem.whole import Problem
from pneumorph.symmetry.operations import MIRRORS

CUT = ("step", "brep")
"""Formats of files whose bodies can be cut in mirror planes."""


def keeps_solid(problem: Problem, body: SolidSpec, plane: str) -> bool:
    """Whether half of a body, on one side of the mirror plane "xz" or "yz", can be meshed and stands for all of it.

    Base, tip, regions, sheets and fibres have to be their own images, and ports those of chambers' images.
    """
    if body.format not in CUT:
        return False
    matrix = np.diag(np.array(MIRRORS[plane], float))
    faces, parts = body.outline, body.parts.triangles
    covers = [_covered(body, each.surfaces, each.on) for each in reinforcements(problem)]
    return (
        chamber_images(body, plane) is not None
        and all(
            _keeps(body, some, matrix) for some in (*(faces.triangles[parts[end]] for end in ("base", "tip")), *covers)
        )
        and _keeps_regions(problem, body, matrix)
        and not any(isinstance(each, FibresSpec) and _turns(each, matrix) for each in reinforcements(problem))
    )


def chamber_images(body: SolidSpec, plane: str) -> dict[str, str] | None:
    """The image of each chamber in a mirror plane, by their names; None if one has none."""
    faces, found, ports = body.outline, body.parts.chambers, {name: at.port for name, at in body.chambers_at.items()}
    images = {}
    for chamber in body.chamber:
        point = np.array(chamber.inside) * MIRRORS[plane]
        names = [name for name, void in found.items() if _around(faces, void, point)]
        if not names or not _is_image(faces, ports[chamber.name], ports[names[0]], plane):
            return None
        images[chamber.name] = names[0]
    return images


def cut_twice(body: SolidSpec) -> bool:
    """Whether both mirror planes cut a port: parts of a quarter's cap would have to meet on the axis, off the body."""
    images = [chamber_images(body, plane) or {} for plane in ("xz", "yz")]
    own = [each.name for each in body.chamber if each.port is not None]
    return any(all(other.get(name) == name for other in images) for name in own)


def _around(faces: Faces, void: Shell | Open, point: NDArray[np.float64]) -> bool:
    return encloses(faces, void, point) if isinstance(void, Shell) else opens_around(faces, void, point)


def _is_image(faces: Faces, one: InPlane | None, other: InPlane | None, plane: str) -> bool:
    """Whether the plane of one port is the image of another's, or neither is there."""
    if one is None or other is None:
        return one is other
    return one.axis == other.axis and abs(one.at * MIRRORS[plane][one.axis] - other.at) <= FLAT * faces.diagonal


def _keeps_regions(problem: Problem, body: SolidSpec, matrix: NDArray[np.float64]) -> bool:
    """Whether each region's solid is its own image: then it holds the image of the region's point."""
    inside = {each.name: np.array(each.inside) for each in problem.region}
    try:
        images = solids_at(body.outline, {name: matrix @ point for name, point in inside.items()})
    except MeshError:
        return False
    return images == solids_at(body.outline, inside)


def _covered(body: SolidSpec, surfaces: tuple[str, ...], on: tuple | None) -> NDArray[np.int64]:
    """The six-node triangles (k, 6) under a reinforcement."""
    faces, parts = body.outline, body.parts.triangles
    if on is not None:
        return np.concatenate([triangles_where(faces, each.where) for each in on])
    return np.concatenate([faces.triangles[parts.get(f"chamber {name}", parts["exterior"])] for name in surfaces])


def _keeps(body: SolidSpec, triangles: NDArray[np.int64], matrix: NDArray[np.float64]) -> bool:
    faces = body.outline
    return asymmetry(faces.points, triangles, matrix)[0] <= SYMMETRIC * faces.diagonal


def _turns(fibres: FibresSpec, matrix: NDArray[np.float64]) -> bool:
    """Whether the image of fibres is another winding."""
    along = None if fibres.along is None else np.array(fibres.along)
    turned = along is not None and min(np.abs(matrix @ along - sign * along).max() for sign in (1, -1)) > 1e-9
    return fibres.handed or turned
