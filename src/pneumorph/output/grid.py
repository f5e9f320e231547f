"""A design as a pyvista grid of quadratic tetrahedra."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from pneumorph.mechanics import rubbers_of
from pneumorph.problem import Problem
from pneumorph.problem.regions import REST
from pneumorph.results import Fields, nodal_stress


def grid(problem: Problem, fields: Fields) -> pv.UnstructuredGrid:
    """The body at rest (mm), with point data for every task.

    They are "<task> displacement" (mm), "<task> stretch" (largest principal stretch) and "<task> stress" (von Mises,
    MPa). A body of several rubbers has cell data, the number of the "region": 0 is `REST`, then as in the file.
    """
    mesh = fields.mesh
    rubbers = rubbers_of(problem) if fields.mesh.regions else {REST: rubbers_of(problem)[REST]}
    cells = pv.UnstructuredGrid({pv.CellType.QUADRATIC_TETRA: mesh.tets}, np.array(mesh.points))
    if mesh.regions:
        region = np.zeros(len(mesh.tets), int)
        for number, name in enumerate(rubbers):
            region[mesh.regions[name]] = number
        cells.cell_data["region"] = region
    for task, u in fields.u.items():
        cells.point_data[f"{task} displacement"] = u
        cells.point_data[f"{task} stretch"] = fields.stretch[task]
        cells.point_data[f"{task} stress"] = nodal_stress(mesh, u, rubbers)
    return cells


def deformed(problem: Problem, fields: Fields, task: str) -> pv.UnstructuredGrid:
    """The body as a task deforms it, with "displacement", "stretch" and "stress"."""
    alone = Fields(fields.mesh, {task: fields.u[task]}, {task: fields.stretch[task]})
    cells = grid(problem, alone)
    for name in ("displacement", "stretch", "stress"):
        cells.rename_array(f"{task} {name}", name)
    cells.points += fields.u[task]
    return cells
