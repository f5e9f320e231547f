"""Faces that stay plane: all that moves them along their normal moves together."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.cad.faces import Faces
from pneumorph.cad.parts import FLAT, faces_where
from pneumorph.errors import ProblemError
from pneumorph.geometry.body import Body
from pneumorph.geometry.lattice.start import design_of
from pneumorph.geometry.lattice.surface import LatticeSurface

if TYPE_CHECKING:
    from pneumorph.problem import Problem

Array = NDArray[np.float64]
Ints = NDArray[np.int64]

ROUNDING = 1e-9
"""Weights below this are zero."""


def tied_in_planes(
    problem: Problem, body: Body[LatticeSurface], faces: Faces, parts: Sequence[Ints], group: Sequence[Array]
) -> Ints:
    """A number (3 n_points,) for every coordinate of control points: those move together that have the same.

    Parameters
    ----------
    problem : whose `design.plane` says which faces stay plane.
    body : in its lattices.
    faces : of the file.
    parts : the triangles of every surface, the exterior first.
    group : operations of its symmetry.

    Raises
    ------
    ProblemError
        If a face is not in a plane across x, y or z, or its images under the symmetry are not among those that stay
        plane.
    """
    number = np.arange(3 * body.n_points)
    for place, selection in enumerate(design_of(problem).plane):
        key = f"design.plane[{place}]"
        chosen = faces_where(faces, selection.where)
        if not chosen.any():
            raise ProblemError(f"{key}: there is no face {selection.where}; give another place")
        if len(group) > 1:
            _require_images(key, faces.points[np.unique(faces.triangles[chosen])], group, faces.diagonal)
        for surface, where, own in zip(body.surfaces, body.slices, parts, strict=True):
            for face in np.unique(faces.face[own[chosen[own]]]):
                triangles = own[chosen[own] & (faces.face[own] == face)]
                nodes = faces.points[np.unique(faces.triangles[triangles])]
                axis = _across(key, nodes, faces.diagonal)
                near = abs(surface.lattice.weights(nodes)).max(axis=0).toarray().ravel() > ROUNDING
                together = 3 * (where.start + np.flatnonzero(near)) + axis
                number[np.isin(number, number[together])] = number[together[0]]
    return number


def _across(key: str, nodes: Array, diagonal: float) -> int:
    """The axis along which nodes (n, 3) of a face have the same coordinate."""
    axis = int(np.ptp(nodes, axis=0).argmin())
    if np.ptp(nodes[:, axis]) > FLAT * diagonal:
        raise ProblemError(f"{key}: a face is not in a plane across x, y or z; turn the body in CAD, or use keep")
    return axis


def _require_images(key: str, nodes: Array, group: Sequence[Array], diagonal: float) -> None:
    """Every operation has to map the planes to themselves: then what moves a face is symmetric by itself."""
    axis = _across(key, nodes, diagonal)
    normal = np.eye(3)[axis]
    at = nodes[0, axis]
    for operation in group:
        image = operation @ normal
        if abs(image[axis]) < 0.5 or (image[axis] < 0.0 and abs(at) > FLAT * diagonal):
            raise ProblemError(
                f"{key}: the symmetry of the body maps the plane to another one; use keep, or ask for less symmetry"
            )
