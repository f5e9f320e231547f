"""`pneumorph accuracy`: how far motions are from those on infinitely fine meshes."""

from __future__ import annotations

from pathlib import Path

from rich.console import Console
from rich.text import Text

from pneumorph.cli.source import design_of
from pneumorph.cli.trust import asking
from pneumorph.output.certainty import of_the_mesh


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
        If the design has sheets or fibres, or an option or the problem has a mistake.
    ComputationError
        If the body cannot be meshed or has no equilibrium.
    """
    design = design_of(source, number, asking(trust))
    errors = design.mesh_errors()
    console = Console()
    for task in design.problem.task:
        error = errors[task.name]
        for sentence in of_the_mesh(task.objective, error.motion.tolist(), error.corrected.tolist()):
            console.print(Text(f"{task.name}: {sentence}"), soft_wrap=True)
