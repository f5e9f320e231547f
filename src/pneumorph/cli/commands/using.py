"""Arguments of the commands that use a design: pressures for motions, fast models, where its tip can go."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneumorph.cli.commands.arguments import DesignNumber, Trusted
from pneumorph.doing import doing


@doing("finding pressures")
def reach(
    source: Annotated[Path, typer.Argument(metavar="RUN_OR_PROBLEM", help="A run directory, or a problem file.")],
    motion: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="MOTION=VALUE",
            help="What the tip is to do, one or several of shift_x, shift_y, extension, bending_x, bending_y, twist: "
            "bending_y=30deg extension=2mm. What is not named is free. With push_ before a motion, what the tip pushes "
            "with where this motion is blocked: push_extension=0.5N.",
        ),
    ] = None,
    position: Annotated[
        str | None,
        typer.Option(
            metavar="'X, Y, Z'",
            help="Where the centre of the tip is to be, from that of the base: '0 mm, 20 mm, 70 mm'.",
        ),
    ] = None,
    rotation: Annotated[
        str | None,
        typer.Option(metavar="'X, Y, Z'", help="The rotation vector of the tip there: '0 deg, 30 deg, 0 deg'."),
    ] = None,
    bounds: Annotated[
        list[str] | None,
        typer.Option(
            metavar="A=0:60kPa",
            help="Least and largest pressure of a chamber; by default 0 and the largest of the tasks; repeatable.",
        ),
    ] = None,
    curve: Annotated[
        Path | None,
        typer.Option(help="Table of motions, one a line, with titles such as 'bending_y (deg), extension (mm)'."),
    ] = None,
    csv: Annotated[Path | None, typer.Option(help="Write pressures and motions to this file as a table.")] = None,
    load: Annotated[
        list[str] | None,
        typer.Option(
            metavar="NAME=VALUE",
            help="What acts on the plate in place of the task's, force_x=-0.1N, moment_z=2N*mm, or where gravity "
            "points, gravity=0,0,-1; repeatable.",
        ),
    ] = None,
    block: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MOTION[=VALUE]",
            help="Hold a motion of the plate where it is at rest, or at a value, shift_x=2mm; repeatable.",
        ),
    ] = None,
    task: Annotated[str | None, typer.Option(help="Whose loads act; by default the first.")] = None,
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """Find the pressures with which the tip of a design moves or pushes as wanted; status 3 if it is out of reach."""
    from pneumorph.cli.reach import reach

    pose = position, rotation
    if status := reach(
        source, motion or [], bounds or [], curve, csv, task, design, trust, load or [], block or [], *pose
    ):
        raise typer.Exit(status)


@doing("building a model")
def model(
    source: Annotated[Path, typer.Argument(metavar="RUN_OR_PROBLEM", help="A run directory, or a problem file.")],
    out: Annotated[
        Path | None,
        typer.Option(
            "--out", "-o", help="The file, .npz; by default model.npz in the run, or the name of the problem."
        ),
    ] = None,
    bounds: Annotated[
        list[str] | None,
        typer.Option(
            metavar="A=0:60kPa",
            help="Least and largest pressure of a chamber; by default 0 and the largest of the tasks; repeatable.",
        ),
    ] = None,
    tolerance: Annotated[
        str, typer.Option(metavar="'0.5 %'", help="Largest error at random states, over the range of motions.")
    ] = "0.5 %",
    sections: Annotated[int, typer.Option(help="Sections along the body whose poses are modelled too.")] = 0,
    most: Annotated[int, typer.Option(min=1, help="Most states that are solved.")] = 400,
    check: Annotated[
        Path | None, typer.Option(help="Compare this model with the design at random pressures, in place of a new one.")
    ] = None,
    force: Annotated[
        str | None,
        typer.Option(metavar="0.5N", help="Forces on the tip are inputs too, with components up to this size."),
    ] = None,
    gravity: Annotated[bool, typer.Option("--gravity", help="The direction of gravity is an input too.")] = False,
    workers: Annotated[int, typer.Option(min=1, help="Processes that solve states.")] = 1,
    task: Annotated[str | None, typer.Option(help="Whose loads act; by default the first.")] = None,
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """Build a model of a design that gives poses and pressures in microseconds; status 3 if it is not good enough."""
    from pneumorph.cli.model import model

    status = model(
        source, out, bounds or [], tolerance, sections, most, check, task, design, trust, force, gravity, workers
    )
    if status:
        raise typer.Exit(status)


@doing("finding the workspace")
def workspace(
    model: Annotated[Path, typer.Argument(metavar="MODEL.npz", help="A file that pneumorph model has written.")],
    bounds: Annotated[
        list[str] | None,
        typer.Option(metavar="A=0:60kPa", help="Narrower bounds of a chamber's pressure; repeatable."),
    ] = None,
    points: Annotated[int, typer.Option(min=100, max=200_000, help="Number of poses.")] = 4000,
    csv: Annotated[Path | None, typer.Option(help="Write pressures and poses to this file as a table.")] = None,
    png: Annotated[Path | None, typer.Option(help="Draw where the tip goes, and how stiff it is there.")] = None,
) -> None:
    """Where the tip of a body can go, how it turns there, how finely it can be moved, and how stiff it is."""
    from pneumorph.cli.model import workspace

    workspace(model, bounds or [], points, csv, png)
