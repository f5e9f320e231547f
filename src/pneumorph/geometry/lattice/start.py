"""The body in a file in lattices of control points: their boxes, and the faces in them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.cad.faces import Faces
from pneumorph.cad.parts import parts_of
from pneumorph.geometry.body import Body
from pneumorph.geometry.lattice.surface import Lattice, LatticeSurface
from pneumorph.problem.design import DesignSpec
from pneumorph.symmetry.operations import operations

if TYPE_CHECKING:
    from pneumorph.problem import Problem, SolidSpec

Array = NDArray[np.float64]

MARGIN = 0.02
"""How far the box of a lattice reaches beyond the surface in it where that is curved, relative to its diagonal: nodes
of finer triangles are a little outside the box of coarse ones."""

FLAT = 1e-6
"""Distance from a side of the box up to which a plane face lies in it, relative to the diagonal of the body."""

PER_SPACING = 2.0
"""Edges of the triangles in which faces are kept, per distance of control points: between these all is smooth."""


def lattice_body(problem: Problem) -> Body[LatticeSurface]:
    """The body in the file of a problem, each of its surfaces in a lattice of its own."""
    faces, design = faces_of(problem), design_of(problem)
    parts = surface_parts(problem, faces)
    group = operations(problem.body.symmetry)
    boxes = _alike([_box(faces, triangles) for triangles in parts.values()], group)
    found = []
    for (name, triangles), (lower, upper) in zip(parts.items(), boxes, strict=True):
        spans = np.maximum(np.rint((upper - lower) / design.spacing_of(name, faces.diagonal)).astype(int), 1)
        lattice = Lattice(lower, upper, tuple(spans.tolist()))
        nodes, corners = np.unique(faces.triangles[triangles], return_inverse=True)
        patches = corners.reshape(-1, 6)
        found.append(LatticeSurface(name, name != "exterior", lattice, lattice.points(), faces.points[nodes], patches))
    return Body(found[0], tuple(found[1:]))


def solid_of(problem: Problem) -> SolidSpec:
    """The table of the body in a file of a problem that has one."""
    assert problem.solid is not None, "the body is none of a file"
    return problem.solid


def design_of(problem: Problem) -> DesignSpec:
    """The table [design] of a problem, by default an empty one."""
    return problem.design or DesignSpec()


def faces_of(problem: Problem) -> Faces:
    """The faces in the file of a problem, in triangles that suit its lattices."""
    return solid_of(problem).faces(_size(problem))


def deviations_of(problem: Problem) -> list[Array]:
    """Of every surface, the exterior first: bounds (m,) of the distance of its triangles from the file's faces, mm."""
    found = solid_of(problem).deviations(_size(problem))
    return [found[own] for own in surface_parts(problem, faces_of(problem)).values()]


def _size(problem: Problem) -> float:
    """Length of the edges of triangles that suit the lattices of a problem, mm."""
    design, diagonal = design_of(problem), solid_of(problem).outline.diagonal
    names = ("exterior", *(chamber.name for chamber in problem.body.chamber))
    return min(design.spacing_of(name, diagonal) for name in names) / PER_SPACING


def surface_parts(problem: Problem, faces: Faces) -> dict[str, NDArray[np.int64]]:
    """The triangles of the exterior and of every chamber, by its name, in this order."""
    solid = solid_of(problem)
    parts = parts_of(faces, *solid.ends_at, solid.chambers_at).triangles
    outside = np.concatenate([parts[name] for name in ("base", "tip", "exterior")])
    return {"exterior": outside} | {each.name: parts[f"chamber {each.name}"] for each in problem.body.chamber}


def _box(faces: Faces, triangles: NDArray[np.int64]) -> tuple[Array, Array]:
    """Corners of the box of a surface: plane faces are on its sides, curved ones a little inside."""
    points, face = faces.points[faces.triangles[triangles]], faces.face[triangles]
    lower, upper = points.min(axis=(0, 1)), points.max(axis=(0, 1))
    margin, near = MARGIN * float(np.linalg.norm(upper - lower)), FLAT * faces.diagonal
    ends = []
    for end, sign in ((lower, -1.0), (upper, 1.0)):
        away = np.abs(points - end).max(axis=1)
        flat = [min(away[face == each, axis].max() for each in np.unique(face)) < near for axis in range(3)]
        ends.append(np.where(flat, end, end + sign * margin))
    return ends[0], ends[1]


def _alike(boxes: Sequence[tuple[Array, Array]], group: Sequence[Array]) -> list[tuple[Array, Array]]:
    """Boxes of which images under the symmetry are the same: each the union of all images of boxes near it."""
    found = []
    for lower, upper in boxes:
        near = MARGIN * float(np.linalg.norm(upper - lower))
        same = []
        for operation in group:
            images = [np.sort([low @ operation.T, up @ operation.T], axis=0) for low, up in boxes]
            same += [each for each in images if np.abs(each - [lower, upper]).max() < near]
        found.append((np.min([low for low, _ in same], axis=0), np.max([up for _, up in same], axis=0)))
    return found
