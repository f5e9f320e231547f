"""A design as a pyvista grid of quadratic tetrahedra."""

from __future__ import annotations

import numpy as np
import pyvista as pv

from pneumorph.mechanics import rubbers_of
from pneumorph.mesh import TetMesh
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


def with_faces(body: pv.UnstructuredGrid, mesh: TetMesh) -> pv.UnstructuredGrid:
    """The grid of a mesh and its faces as quadratic triangles after the tetrahedra.

    Cell data, 1 or 0, say which are "base", "tip", "exterior" and "chamber <name>": thresholds by them select these.
    """
    sizes = [len(mesh.tets), *map(len, mesh.faces.values())]
    cells = {pv.CellType.QUADRATIC_TETRA: mesh.tets}
    cells[pv.CellType.QUADRATIC_TRIANGLE] = np.concatenate(list(mesh.faces.values()))
    grid = pv.UnstructuredGrid(cells, np.array(body.points))
    for name, values in body.point_data.items():
        grid.point_data[name] = values
    which = np.repeat(np.arange(len(sizes)), sizes)
    for name, values in body.cell_data.items():
        grid.cell_data[name] = np.concatenate([values, np.full(len(which) - len(values), -1)])
    for number, name in enumerate(mesh.faces, 1):
        grid.cell_data[name] = (which == number).astype(np.int8)
    return grid


def deformed(problem: Problem, fields: Fields, task: str) -> pv.UnstructuredGrid:
    """The body as a task deforms it, with "displacement", "stretch" and "stress"."""
    alone = Fields(fields.mesh, {task: fields.u[task]}, {task: fields.stretch[task]})
    cells = grid(problem, alone)
    for name in ("displacement", "stretch", "stress"):
        cells.rename_array(f"{task} {name}", name)
    cells.points += fields.u[task]
    return cells
