"""A design as a grid of quadratic tetrahedra with data, for files and for PyVista."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from pneumorph import extras
from pneumorph.mechanics import rubbers_of
from pneumorph.mesh import TetMesh
from pneumorph.problem import Problem
from pneumorph.problem.regions import REST
from pneumorph.results import Fields, nodal_stress

if TYPE_CHECKING:
    import pyvista


@dataclass(frozen=True, eq=False)
class Grid:
    """Points, cells and data.

    Attributes
    ----------
    points : (n, 3) array
        mm.
    cells : tuple of (m, 10) or (m, 6) arrays
        Nodes of quadratic tetrahedra and of quadratic triangles.
    point_data, cell_data : dict of arrays
        A row for each point, and for each cell in the order of `cells`.
    """

    points: np.ndarray
    cells: tuple[np.ndarray, ...]
    point_data: dict[str, np.ndarray]
    cell_data: dict[str, np.ndarray]


def grid(problem: Problem, fields: Fields) -> Grid:
    """The body at rest, with point data for every task.

    They are "<task> displacement" (mm), "<task> stretch" (largest principal stretch) and "<task> stress" (von Mises,
    MPa). A body of several rubbers has cell data, the number of the "region": 0 is `REST`, then as in the file.
    """
    mesh = fields.mesh
    rubbers = rubbers_of(problem) if fields.mesh.regions else {REST: rubbers_of(problem)[REST]}
    points, cells = dict[str, np.ndarray](), dict[str, np.ndarray]()
    if mesh.regions:
        cells["region"] = np.zeros(len(mesh.tets), int)
        for number, name in enumerate(rubbers):
            cells["region"][mesh.regions[name]] = number
    for task, u in fields.u.items():
        points[f"{task} displacement"] = u
        points[f"{task} stretch"] = fields.stretch[task]
        points[f"{task} stress"] = nodal_stress(mesh, u, rubbers)
    return Grid(np.array(mesh.points), (mesh.tets,), points, cells)


def with_faces(body: Grid, mesh: TetMesh) -> Grid:
    """The grid of a mesh and its faces as quadratic triangles after the tetrahedra.

    Cell data, 1 or 0, say which are "base", "tip", "exterior" and "chamber <name>": thresholds by them select these.
    """
    which = np.repeat(np.arange(len(mesh.faces) + 1), [len(mesh.tets), *map(len, mesh.faces.values())])
    triangles = len(which) - len(mesh.tets)
    data = {name: np.append(values, np.full(triangles, -1)) for name, values in body.cell_data.items()}
    data |= {name: (which == number).astype(np.int8) for number, name in enumerate(mesh.faces, 1)}
    return Grid(body.points, (mesh.tets, np.concatenate(list(mesh.faces.values()))), body.point_data, data)


def deformed(problem: Problem, fields: Fields, task: str) -> Grid:
    """The body as a task deforms it, with "displacement", "stretch" and "stress"."""
    alone = grid(problem, Fields(fields.mesh, {task: fields.u[task]}, {task: fields.stretch[task]}))
    data = {name.removeprefix(f"{task} "): values for name, values in alone.point_data.items()}
    return Grid(alone.points + fields.u[task], alone.cells, data, alone.cell_data)


def for_pyvista(grid: Grid) -> pyvista.UnstructuredGrid:
    """The same for PyVista.

    Raises
    ------
    ModuleNotFoundError
        If PyVista is not installed; the message says how to install it.
    """
    if words := extras.missing("pictures", "a grid"):
        raise ModuleNotFoundError(words)
    import pyvista

    kinds = {10: pyvista.CellType.QUADRATIC_TETRA, 6: pyvista.CellType.QUADRATIC_TRIANGLE}
    found = pyvista.UnstructuredGrid({kinds[cells.shape[1]]: cells for cells in grid.cells}, grid.points)
    found.point_data.update(grid.point_data)
    found.cell_data.update(grid.cell_data)
    return found
