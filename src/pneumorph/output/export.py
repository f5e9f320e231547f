"""Export a design for other programs."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from pneumorph.analysis import Fields
from pneumorph.errors import ProblemError
from pneumorph.mechanics import configure, guided_of, loads_of, model_of
from pneumorph.output.abaqus import abaqus_input
from pneumorph.output.grid import grid
from pneumorph.problem import Problem

FORMATS = ("vtu", "inp")
"""ParaView and VTK; CalculiX and Abaqus."""


def export(path: Path, format: str, problem: Problem, fields: Fields, pressures: Mapping[str, float]) -> None:
    """Write a design to a file.

    Parameters
    ----------
    path : the file.
    format : one of `FORMATS`.
    problem, fields : problem and fields of the design; for half a body the whole is written.
    pressures : {chamber: MPa}
        Pressures of the load case in an input file ("inp").

    Raises
    ------
    ProblemError
        If the format does not support the rubber, or the file cannot be written.
    """
    whole = fields.whole()
    try:
        path.parent.mkdir(parents=True, exist_ok=True)
        if format == "vtu":
            # VTK chooses the format by the suffix, and does not report a file that it cannot open.
            path.touch()
            named = path if path.suffix == ".vtu" else path.with_name(f"{path.name}.vtu")
            grid(problem, whole).save(named)
            named.replace(path)
            return
        model = model_of(problem, whole.mesh)
        at = configure(model, whole.mesh.points, loads_of(problem, model, dict(pressures)), guided_of(problem))
        path.write_text(abaqus_input(whole.mesh, at), encoding="ascii")
    except OSError as error:
        raise ProblemError(f"{path}: cannot be written ({error.strerror}); name another file") from None
