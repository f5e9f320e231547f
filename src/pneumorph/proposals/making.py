"""How hard a design is to make: its rubber, and the split mould that it would be cast in."""

from __future__ import annotations

import numpy as np

from pneumorph import extras
from pneumorph.errors import ComputationError
from pneumorph.geometry import Body
from pneumorph.problem import Problem


def rubber_volume(body: Body) -> float:
    """Volume of the rubber in mm³, of the triangles that pictures show."""
    return sum(_enclosed(*surface.shell()) for surface in body.surfaces)


def _enclosed(points: np.ndarray, triangles: np.ndarray) -> float:
    """Volume inside closed triangles by the divergence theorem; below zero where their normals point inwards."""
    one, two, three = (points[triangles[:, corner]] for corner in range(3))
    return float(np.einsum("nc,nc->", one, np.cross(two, three))) / 6.0


def difficulty(problem: Problem, body: Body) -> str:
    """The split mould of a design in words, from its plan alone, which no solid is built for.

    It tells the pieces of the outer mould, how many cores leave the rubber in pieces, and how far undercuts stretch it
    where a piece is pulled off.
    """
    if problem.solid:
        return "from a CAD file: cast in two parts that are bonded"
    if words := extras.missing("cad", "planning moulds"):
        return words
    from pneumorph.make.mould.plan import plan

    try:
        planned = plan(body, problem.make, problem.limits.wall, problem.material.density)
    except ComputationError as error:
        return f"no split mould: {error}"
    stretch = max(each.stretch for each in planned.releases)
    allowed = problem.make.release_stretch
    broken = sum(not core.leaves_whole(allowed) for core in planned.cores)
    words = f"{len(planned.angles)} mould pieces, {len(planned.cores)} core{'s' * (len(planned.cores) > 1)}"
    words += f" ({broken} leave{'s' * (broken == 1)} in pieces)" if broken else ""
    return words + (f", undercuts stretch the rubber by {100.0 * (stretch - 1.0):.0f} %" if stretch > 1.02 else "")
