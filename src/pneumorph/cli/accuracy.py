"""`pneumorph accuracy`: how far results are from those on infinitely fine meshes."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rich.console import Console
from rich.text import Text

from pneumorph.cli.source import design_of
from pneumorph.cli.trust import asking
from pneumorph.interface.design import MeshError
from pneumorph.output.certainty import of_sums, of_the_mesh
from pneumorph.problem import Problem

NEW_MESH = "the mesh of this design is not stored; its error is that of a new mesh, which differs a little"


def accuracy(source: Path, number: int | None, trust: bool) -> None:
    """Print the error of the mesh in the motions of every task.

    Parameters
    ----------
    source : Path
        A run directory or a problem file.
    number : int or None
        Of a run's design, by default the last.
    trust : bool
        Whether code in the problem file is trusted.

    Raises
    ------
    ProblemError
        If an option or the problem has a mistake.
    ComputationError
        If the body cannot be meshed or has no equilibrium.
    """
    design = design_of(source, number, asking(trust))
    console = Console()
    if design.entry is not None and design.stored is None:
        console.print(Text(NEW_MESH), soft_wrap=True)
    for name, sentences in told(design.problem, design.mesh_errors()).items():
        for sentence in sentences:
            console.print(Text(f"{name}: {sentence}"), soft_wrap=True)


def told(problem: Problem, errors: Mapping[str, MeshError]) -> dict[str, list[str]]:
    """What is printed of every task."""
    words = {}
    for task in problem.task:
        if (error := errors.get(task.name)) is None:
            words[task.name] = ["not known: no state was found on the refined mesh; halve mesh.size and compare"]
            continue
        words[task.name] = [*of_the_mesh(task.objective, error.here, error.fine), *of_sums(error.here, error.fine)]
    return words
