"""Export a design for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pneumorph.atomic import write_bytes
from pneumorph.errors import writing
from pneumorph.mechanics import configure, enclosed_of, guided_of, loads_of, model_of
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.mesh import TetMesh
from pneumorph.output.formats.abaqus import abaqus_input
from pneumorph.output.formats.abaqus_rubber import can_hold
from pneumorph.output.formats.febio import febio_input
from pneumorph.output.formats.gmsh import gmsh_mesh
from pneumorph.output.formats.sofa import sofa_scene
from pneumorph.output.formats.vtu import vtu_file
from pneumorph.output.grid import grid, with_faces
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting
from pneumorph.results import Fields

FORMATS = ("vtu", "inp", "msh", "feb", "py")
"""ParaView and VTK; CalculiX and Abaqus; Gmsh; FEBio; a scene of SOFA."""

CHAIN = "xml"
"""A chain of rigid links for MuJoCo: it is fitted to states, which `interface/chain.py` finds."""


def formats_of(rubber: Rubber) -> tuple[str, ...]:
    """Those of `FORMATS` in which a body of this rubber can be written."""
    return tuple(format for format in FORMATS if format != "inp" or can_hold(rubber))


def export(
    path: Path, format: str, problem: Problem, fields: Fields, pressures: Mapping[str, float], task: str | None = None
) -> None:
    """Write a design to a file.

    Parameters
    ----------
    path : the file.
    format : one of `FORMATS`.
    problem, fields : problem and fields of the design; for part of a body the whole is written.
    pressures : {chamber: MPa}
        Pressures of the load case in a file of another solver ("inp", "feb", "py").
    task : str, optional
        The task that has the other loads of that case; by default those that tasks have without loads of their own.

    Raises
    ------
    ProblemError
        If the format does not support the rubber, reinforcements or springs, or the file cannot be written.
    """
    whole = fields.whole()
    with writing(path):
        path.parent.mkdir(parents=True, exist_ok=True)
        if format == "vtu":
            write_bytes(path, vtu_file(with_faces(grid(problem, whole), whole.mesh)))
        else:
            write_bytes(path, _text(format, problem, whole.mesh, pressures, task))


def _text(format: str, problem: Problem, mesh: TetMesh, pressures: Mapping[str, float], task: str | None) -> bytes:
    """What is in a file of any format but vtu."""
    if format == "msh":
        return gmsh_mesh(mesh).encode()
    model = model_of(problem, mesh)
    under = acting(problem, next((each for each in problem.task if each.name == task), None))
    given = loads_of(problem, model, dict(pressures), under=under)
    volumes = next((each.volumes for each in problem.task if each.name == task), {})
    at = configure(model, mesh.points, given, guided_of(problem, under), enclosed_of(problem, volumes))
    match format:
        case "feb":
            return febio_input(mesh, at)
        case "py":
            return sofa_scene(mesh, at).encode()
        case _:
            return abaqus_input(mesh, at).encode("ascii")
