"""A design as a pyvista grid of quadratic tetrahedra."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from pneumorph.analysis import Fields, nodal_stress
from pneumorph.mechanics import rubber_of
from pneumorph.problem import Problem


def grid(problem: Problem, fields: Fields) -> pv.UnstructuredGrid:
    """The body at rest (mm), with point data for every task.

    They are "<task> displacement" (mm), "<task> stretch" (largest principal stretch) and "<task> stress" (von Mises,
    MPa).
    """
    mesh, rubber = fields.mesh, rubber_of(problem.material)
    found = pv.UnstructuredGrid({pv.CellType.QUADRATIC_TETRA: mesh.tets}, np.array(mesh.points))
    for task, u in fields.u.items():
        found.point_data[f"{task} displacement"] = u
        found.point_data[f"{task} stretch"] = fields.stretch[task]
        found.point_data[f"{task} stress"] = nodal_stress(mesh, u, rubber)
    return found


def deformed(problem: Problem, fields: Fields, task: str) -> pv.UnstructuredGrid:
    """The body as a task deforms it, with "displacement", "stretch" and "stress"."""
    alone = Fields(fields.mesh, {task: fields.u[task]}, {task: fields.stretch[task]})
    found = grid(problem, alone)
    for name in ("displacement", "stretch", "stress"):
        found.rename_array(f"{task} {name}", name)
    found.points += fields.u[task]
    return found
