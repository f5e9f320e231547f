"""The surfaces of a design in parts around one rubber each, with where these meet."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.cad.solids import grouped, groups_of
from pneumorph.geometry import Body
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.geometry.lattice.between import Interface
from pneumorph.geometry.lattice.start import faces_of, surface_parts
from pneumorph.problem import Problem
from pneumorph.problem.regions import REST


@dataclass(frozen=True, eq=False)
class Sheet:
    """A part of a surface, or of where rubbers meet.

    Attributes
    ----------
    part : LatticeSurface or Interface
        With the triangles of this part alone.
    surface : str
        "exterior" or the name of the chamber; "" where rubbers meet.
    inner, outer : str
        The rubber that normals point from, and the one they point to, "" for none.
    """

    part: LatticeSurface | Interface
    surface: str
    inner: str
    outer: str = ""


def sheets_of(problem: Problem, body: Body[LatticeSurface]) -> list[Sheet]:
    """The sheets of a design, which is a body of one rubber or of several."""
    faces = faces_of(problem)
    names = np.array([REST, *(region.name for region in problem.region)])
    known = grouped(faces, groups_of(faces, {region.name: np.array(region.inside) for region in problem.region}))
    found = []
    for surface, own in zip(body.surfaces, surface_parts(problem, faces).values(), strict=True):
        # The triangles of surfaces are in the order of the file's, grouped or not.
        for number in np.unique(known.solid[own]):
            part = replace(surface, patches=surface.patches[known.solid[own] == number])
            found.append(Sheet(part, surface.name, str(names[number])))
    for sides in np.unique(known.sides, axis=0):
        nodes, patches = np.unique(known.between[(known.sides == sides).all(axis=1)], return_inverse=True)
        meeting = Interface(body, known.points[nodes], patches.reshape(-1, 6))
        found.append(Sheet(meeting, "", *names[sides].tolist()))
    return found


def around(sheets: Sequence[Sheet], rubber: str) -> list[tuple[int, bool]]:
    """The numbers of the sheets around a rubber, and whether their normals point out of it."""
    out = [(number, True) for number, sheet in enumerate(sheets) if sheet.inner == rubber]
    return out + [(number, False) for number, sheet in enumerate(sheets) if sheet.outer == rubber]
