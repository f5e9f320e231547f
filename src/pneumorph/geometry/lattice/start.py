"""The body in a file, and what of it moves."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from pneumorph.cad.faces import Faces
from pneumorph.cad.shells import quarters
from pneumorph.geometry.body import Body
from pneumorph.geometry.design_space import DesignSpace, build_space, tied_coordinates
from pneumorph.geometry.lattice.surface import Lattice, LatticeSurface

if TYPE_CHECKING:
    from pneumorph.problem import Problem, SolidSpec

_MARGIN = 0.02
"""How far the box of a lattice reaches beyond the surface in it, relative to its diagonal: nodes of finer triangles are
a little outside the box of coarse ones."""


def lattice_body(spec: SolidSpec) -> Body[LatticeSurface]:
    """The body in a file, each of its surfaces in a lattice of its own."""
    faces = spec.outline
    parts = spec.parts.triangles
    outside = np.concatenate([parts[name] for name in ("base", "tip", "exterior")])
    chambers = [_surface(faces, each.name, parts[f"chamber {each.name}"]) for each in spec.chamber]
    return Body(_surface(faces, "exterior", outside), tuple(chambers))


def _surface(faces: Faces, name: str, triangles: np.ndarray) -> LatticeSurface:
    nodes, corners = np.unique(faces.triangles[triangles], return_inverse=True)
    points = faces.points[nodes]
    lower, upper = points.min(axis=0), points.max(axis=0)
    margin = _MARGIN * float(np.linalg.norm(upper - lower))
    lattice = Lattice(lower - margin, upper + margin, (1, 1, 1))
    flat = quarters(corners.reshape(-1, 6))
    return LatticeSurface(name, name != "exterior", lattice, lattice.points(), points, flat)


def lattice_space(problem: Problem, body: Body) -> DesignSpace:
    """The design variables of a body from a file, whose shape stays: pressures alone."""
    points = body.control_points()
    return build_space(problem, body, tied_coordinates(points.ravel(), np.full(points.size, -1)))
