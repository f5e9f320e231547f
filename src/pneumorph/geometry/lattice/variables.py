"""The design variables of a body from a file: which coordinates of its control points move, and which move together."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse
from scipy.spatial import KDTree

from pneumorph.cad.faces import Faces
from pneumorph.cad.parts import faces_where
from pneumorph.errors import ProblemError
from pneumorph.geometry.body import Body
from pneumorph.geometry.design_space import DesignSpace, ShapeVariables, build_space, tied_coordinates
from pneumorph.geometry.lattice.planes import ROUNDING, tied_in_planes
from pneumorph.geometry.lattice.start import design_of, faces_of, solid_of, surface_parts
from pneumorph.geometry.lattice.surface import LatticeSurface
from pneumorph.symmetry.basis import column_squares, symmetric_basis
from pneumorph.symmetry.operations import operations

if TYPE_CHECKING:
    from pneumorph.problem import Problem

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

LEAST = 1e-3
"""Control points that move no point of their surface by more than this share of their motion stay where they are."""

_SAME = 1e-6
"""Control points nearer than this are the same, mm."""


def lattice_space(problem: Problem, body: Body[LatticeSurface]) -> DesignSpace:
    """The design variables of a problem whose body is from a file.

    Control points stay where they would move a face that is kept, or change its slope; these are base, tip, and those
    of `design.keep`. What is beside them moves as smoothly as splines do. Those of faces that stay plane move along
    their normals together, or not at all where one of them is held.
    """
    faces = faces_of(problem)
    parts = surface_parts(problem, faces)
    kept = _kept_nodes(problem, faces, list(parts.values()))
    held, idle = [], []
    for surface, own in zip(body.surfaces, parts.values(), strict=True):
        nodes = np.unique(faces.triangles[own])
        held.append(_held(surface, faces.points[nodes[kept[nodes]]]))
        idle.append(abs(surface.lattice.weights(faces.points[nodes])).max(axis=0).toarray().ravel() < LEAST)
    held, idle = np.concatenate(held), np.concatenate(idle)
    group = operations(problem.body.symmetry)
    images = [images_of(body, operation) for operation in group]
    held, idle = (np.any([each[to] for to in images], axis=0) for each in (held, idle))
    together = tied_in_planes(problem, body, faces, list(parts.values()), group)
    alone = np.bincount(together, minlength=len(together))[together] == 1
    moving = ~np.isin(together, together[np.repeat(held, 3)]) & ~(np.repeat(idle, 3) & alone)
    variable = np.full(len(moving), -1)
    variable[moving] = np.unique(together[moving], return_inverse=True)[1]
    points = body.control_points().ravel()
    own = tied_coordinates(points, variable)
    # Control points that move together are in different places.
    own = replace(own, offset=points - own.L @ own.start)
    if len(group) > 1 and len(own.start):
        own = _symmetric(own, group, images)
    return build_space(problem, body, own)


def _kept_nodes(problem: Problem, faces: Faces, surfaces: Sequence[NDArray[np.int64]]) -> Mask:
    """Which nodes (n,) stay: of base, tip and other faces that are kept, and of the rims of ports on two surfaces."""
    on = np.zeros(len(faces.points), int)
    for triangles in surfaces:
        on[np.unique(faces.triangles[triangles])] += 1
    kept = on > 1
    for where in (*solid_of(problem).ends_at, *(each.where for each in design_of(problem).keep)):
        kept[faces.triangles[faces_where(faces, where)]] = True
    return kept


def _held(surface: LatticeSurface, kept: Array) -> Mask:
    """Which control points (n,) stay, since they would move kept nodes (m, 3) or what is beside them."""
    held = np.zeros(surface.n_points, bool)
    if len(kept):
        spacing = (surface.lattice.upper - surface.lattice.lower) / surface.lattice.spans
        for order in ((0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)):
            weights = abs(surface.lattice.weights(kept, order)).max(axis=0).toarray().ravel()
            held |= weights * np.prod(spacing**order) > ROUNDING
    return held


def _symmetric(own: ShapeVariables, group: Sequence[Array], images: Sequence[NDArray[np.int64]]) -> ShapeVariables:
    """The independent variables of symmetric shapes; all operations leave the origin where it is."""
    basis, projector = symmetric_basis(own.L, group, images)
    L = sparse.csr_matrix(own.L @ basis)
    shape = projector @ own.start
    start = (basis.T @ shape) / column_squares(basis)
    free = np.full(len(start), np.inf)
    return ShapeVariables(L, own.offset + own.L @ (shape - basis @ start), start, -free, free)


def images_of(body: Body[LatticeSurface], operation: Array) -> NDArray[np.int64]:
    """For each control point, the index (n_points,) of the one to which an operation about the origin maps it.

    Raises
    ------
    ProblemError
        If the lattices of the body are not symmetric under the operation.
    """
    answer = np.empty(body.n_points, dtype=np.int64)
    for surface, where in zip(body.surfaces, body.slices, strict=True):
        moved = surface.lattice.points() @ operation.T
        for other, there in zip(body.surfaces, body.slices, strict=True):
            if other.cavity == surface.cavity and other.n_points == surface.n_points:
                distance, near = KDTree(other.lattice.points()).query(moved)
                if distance.max() < _SAME:
                    answer[where] = there.start + near
                    break
        else:
            raise ProblemError(
                f"body.symmetry: {surface.name} has no image under it; correct the body in CAD, or ask for less "
                "symmetry"
            )
    return answer
