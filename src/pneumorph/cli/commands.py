"""The commands' arguments. What a command does is loaded when it is called, so that --help comes at once."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer


def design(
    problem: Annotated[Path, typer.Argument(help="The problem file (TOML).")],
    out: Annotated[Path | None, typer.Option(help="The run directory; by default runs/<name of the file>.")] = None,
    iterations: Annotated[int | None, typer.Option(min=1, help="Most designs, instead of the file's number.")] = None,
    going_on: Annotated[bool, typer.Option("--resume", help="Go on with a run that was stopped.")] = False,
) -> None:
    """Design a body for a problem."""
    from pneumorph.cli.design import design

    design(problem, out, iterations, going_on)


def simulate(
    source: Annotated[Path, typer.Argument(metavar="PROBLEM_OR_RUN", help="A problem file, or a run directory.")],
    pressure: Annotated[
        list[str] | None,
        typer.Option(
            metavar="A=0:60:5kPa",
            help="Sweep a chamber's pressure from start to stop by step, or hold it (A=60kPa); repeatable. "
            "Chambers swept step together. A chamber without has the pressure of the task.",
        ),
    ] = None,
    one_by_one: Annotated[
        bool,
        typer.Option("--one-by-one", help="Sweep one chamber after the other; the others wait at the start of theirs."),
    ] = False,
    block: Annotated[
        list[str] | None,
        typer.Option(
            metavar="shift_x|shift_y|axial|bending_x|bending_y|torsion|extension|twist|all",
            help="Block a motion of the plate, and report the force or torque on the block; repeatable.",
        ),
    ] = None,
    json: Annotated[Path | None, typer.Option(help="Write the steps to this file.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write them as a table to this file.")] = None,
    png: Annotated[Path | None, typer.Option(help="Draw the curves of a sweep into this file.")] = None,
    design: Annotated[int | None, typer.Option(min=0, help="Of a run: this design instead of the last.")] = None,
) -> None:
    """Simulate the starting body of a problem, or a design of a run: at the tasks' pressures or along sweeps."""
    from pneumorph.cli.simulate import simulate

    simulate(source, pressure or [], one_by_one, block or [], {"--json": json, "--csv": csv, "--png": png}, design)


def check(problem: Annotated[Path, typer.Argument(help="A problem file (TOML), or a run directory.")]) -> None:
    """Validate a problem, describe it, and test the gradient of its objective on its start or a run's last design."""
    from pneumorph.cli.check import check

    check(problem)


def export(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run directory.")],
    out: Annotated[Path, typer.Option(help="The file to write.")],
    format: Annotated[
        str | None,
        typer.Option(
            metavar="vtu|inp",
            help="vtu for ParaView and VTK, inp for CalculiX and Abaqus; by default what the file's name ends with.",
        ),
    ] = None,
    task: Annotated[str | None, typer.Option(help="Of an input file: the task whose loads it has.")] = None,
    design: Annotated[int | None, typer.Option(min=0, help="This design instead of the last.")] = None,
) -> None:
    """Write a design of a run for other programs, half bodies as whole ones."""
    from pneumorph.interface.runs import open_run
    from pneumorph.mesh import keep_netgen_quiet

    keep_netgen_quiet()
    open_run(run).design(design).export(out, format, task)
    print(f"in {out}")


def report(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run directory.")],
    out: Annotated[Path | None, typer.Option(help="The file; by default report.html in the run directory.")] = None,
) -> None:
    """Write the page of a run: one file for any browser, with its shapes, history, limits and problem."""
    from pneumorph.interface.runs import open_run

    print(f"in {open_run(run).report(out)}")


def make(
    run: Annotated[Path, typer.Argument(metavar="RUN", help="A run directory.")],
    design: Annotated[int | None, typer.Option(min=0, help="This design instead of the last.")] = None,
    out: Annotated[Path | None, typer.Option(help="Where the files go; by default make in the run directory.")] = None,
    chord: Annotated[str, typer.Option(help="Most distance of the triangles in 3MF and STL from the body.")] = (
        "0.02 mm"
    ),
) -> None:
    """Write a design as exact CAD (STEP) and as triangles (3MF, STL), and check the files."""
    from pneumorph.cli.make import make

    make(run, design, out, chord)


def study(
    source: Annotated[Path, typer.Argument(metavar="STUDY", help="The study file (TOML).")],
    out: Annotated[Path | None, typer.Option(help="The study's directory; by default runs/<name of the file>.")] = None,
    cluster: Annotated[
        str | None, typer.Option(help="A Dask scheduler, tcp://…, whose workers share this disk; or slurm.")
    ] = None,
    workers: Annotated[
        int | None, typer.Option(min=1, help="Processes on this machine; by default one to a core.")
    ] = None,
) -> None:
    """Run every design of a study; members that have come to their end are not run again."""
    from pneumorph.cli.study import study

    study(source, out, cluster, workers)


def verify(
    only: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Run the cases with this in their name; repeatable.")
    ] = None,
    write: Annotated[Path | None, typer.Option(metavar="FILE.md", help="Write the table to this file.")] = None,
) -> None:
    """Verify the mechanics: what each case should give, what it gives, the error, and the verdict."""
    from pneumorph.cli.verify import verify

    verify(only or [], write)


material = typer.Typer(no_args_is_help=True, help="Elastomers: list the library, fit a model to a test.")


@material.command("list")
def list_materials() -> None:
    """List the elastomers of the library: model, parameters, stiffness, range and source."""
    from pneumorph.cli.material import list_

    list_()


@material.command("show")
def show_material(name: Annotated[str, typer.Argument(help="An elastomer of the library.")]) -> None:
    """Show an elastomer of the library."""
    from pneumorph.cli.material import show

    show(name)


@material.command("fit")
def fit_material(
    data: Annotated[Path, typer.Argument(help="CSV of stretch (or strain) and nominal stress, units in the header.")],
    model: Annotated[
        str, typer.Option(help="One of neo-hookean, mooney-rivlin, yeoh, gent, arruda-boyce, ogden, or all.")
    ] = "all",
    out: Annotated[Path | None, typer.Option(help="Where results go; by default <name of the file>-fit.")] = None,
    density: Annotated[str, typer.Option(help="For the table [material]; a tension test does not tell it.")] = (
        "1.1 g/cm^3"
    ),
) -> None:
    """Fit models to a uniaxial tension test, check their stability, and write the best as a table [material]."""
    from pneumorph.cli.material import fit_

    fit_(data, model, out, density)
