"""Export a design for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pneumorph.atomic import replaced, write_bytes
from pneumorph.errors import ProblemError
from pneumorph.mechanics import configure, guided_of, loads_of, model_of, rubbers_of
from pneumorph.mechanics.material.energies import neo_hookean
from pneumorph.mechanics.material.rubber import Rubber
from pneumorph.output.formats.abaqus import abaqus_input
from pneumorph.output.grid import grid
from pneumorph.problem import Problem
from pneumorph.problem.acting import acting
from pneumorph.problem.materials import materials
from pneumorph.results import Fields

FORMATS = ("vtu", "inp")
"""ParaView and VTK; CalculiX and Abaqus."""


def formats_of(rubber: Rubber) -> tuple[str, ...]:
    """Those of `FORMATS` in which a body of this rubber can be written."""
    return tuple(format for format in FORMATS if format != "inp" or rubber.isochoric is neo_hookean)


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
        Pressures of the load case in an input file ("inp").
    task : str, optional
        The task that has the other loads of that case; by default those that tasks have without loads of their own.

    Raises
    ------
    ProblemError
        If the format does not support the rubber or reinforcements, or the file cannot be written.
    """
    rubbers = rubbers_of(problem)
    if wrong := [name for name, rubber in rubbers.items() if format not in formats_of(rubber)]:
        had, model = formats_of(rubbers[wrong[0]]), materials(problem)[wrong[0]].model
        raise ProblemError(
            f'format: "{format}" cannot hold the rubber of {wrong[0]} (its model is "{model}"): input files '
            f"can be written for neo-Hookean rubbers only; export {', '.join(had)} instead, or step, 3mf and stl by "
            "pneumorph make"
        )
    whole = fields.whole()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if format == "vtu":
            with replaced(path) as place:
                # VTK chooses the format by the suffix.
                named = place.with_name(f"{place.name}.vtu")
                grid(problem, whole).save(named)
                named.replace(place)
            return
        model = model_of(problem, whole.mesh)
        under = acting(problem, next((each for each in problem.task if each.name == task), None))
        given = loads_of(problem, model, dict(pressures), under=under)
        at = configure(model, whole.mesh.points, given, guided_of(problem, under))
        write_bytes(path, abaqus_input(whole.mesh, at).encode("ascii"))
    except OSError as error:
        raise ProblemError(f"{path}: cannot be written ({error.strerror}); name another file") from None
