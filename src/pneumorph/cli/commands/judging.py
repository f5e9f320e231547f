"""Arguments of the commands that tell how far predictions are right, and how castings differ."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneumorph.cli.commands.arguments import DesignNumber, Trusted
from pneumorph.doing import doing


@doing("estimating the error of the mesh")
def accuracy(
    source: Annotated[Path, typer.Argument(metavar="RUN_OR_PROBLEM", help="A run directory, or a problem file.")],
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """How far the motions of a design are from those on infinitely fine meshes."""
    from pneumorph.cli.accuracy import accuracy

    accuracy(source, design, trust)


@doing("finding how motions, forces and volumes scatter")
def tolerance(
    source: Annotated[Path, typer.Argument(metavar="RUN_OR_PROBLEM", help="A run directory, or a problem file.")],
    rubber: Annotated[
        str | None, typer.Option(metavar="'10 %'", help="Standard deviation of the moduli of every rubber.")
    ] = None,
    pressure: Annotated[
        str | None, typer.Option(metavar="'1 kPa'", help="Standard deviation of every pressure.")
    ] = None,
    wall: Annotated[
        str | None, typer.Option(metavar="'0.1 mm'", help="Of the rubber's thickness at every surface.")
    ] = None,
    shift: Annotated[
        str | None, typer.Option(metavar="'0.2 mm'", help="Of the place of every chamber's core along each axis.")
    ] = None,
    tilt: Annotated[
        str | None, typer.Option(metavar="'0.2 deg'", help="Of the turn of every core about x and y.")
    ] = None,
    scale: Annotated[str | None, typer.Option(metavar="'0.3 %'", help="Of the size of the whole body.")] = None,
    load: Annotated[
        str | None, typer.Option(metavar="'5 %'", help="Of weight, loads, springs, and stiffness of sheets and fibres.")
    ] = None,
    task: Annotated[str | None, typer.Option(help="Only this task.")] = None,
    json: Annotated[
        Path | None,
        typer.Option(help="Write all figures to this file as JSON, in mm, rad, N, N·mm and mm³."),
    ] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw what 0.1 mm more rubber at each place does (png, pdf or svg).")
    ] = None,
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """How far motions, forces and volumes of a design scatter when it is made: what each tolerance contributes."""
    from pneumorph.cli.tolerance import tolerance

    given = {"rubber": rubber, "pressure": pressure, "wall": wall, "shift": shift, "tilt": tilt, "scale": scale}
    tolerance(source, {**given, "load": load}, design, task, json, picture, trust)


@doing("calibrating")
def calibrate(
    source: Annotated[Path, typer.Argument(metavar="RUN_OR_PROBLEM", help="A run directory, or a problem file.")],
    measured: Annotated[
        Path,
        typer.Option(
            help="Text file with titles such as 'pressure A (kPa), extension (mm)' and one point a line. In place of a "
            "motion also 'push_extension (N)', what the tip pushes with where this motion is held, 'volume A (ml)', or "
            "'filled A (ml)', what was filled into the chamber."
        ),
    ],
    fit: Annotated[
        str,
        typer.Option(
            metavar="modulus,wall,pressure",
            help="What is fitted, separated by commas; also constants of the rubber, such as c10, c1 or mu1,alpha1.",
        ),
    ] = "modulus",
    task: Annotated[str | None, typer.Option(help="The task whose loads act; by default the first.")] = None,
    block: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MOTION[=VALUE]",
            help="A motion of the plate that was held, where it is at rest or at a value, shift_x=2mm; repeatable. "
            "That of push_ is held anyway.",
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Write the problem with the rubber found to this file.")
    ] = None,
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """Find the rubber, the walls and the pressure error of a casting from a measured curve."""
    from pneumorph.cli.calibrate import calibrate

    calibrate(source, measured, fit, design, task, block or [], out, trust)


@doing("comparing with what was measured")
def validate(
    source: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[balloon|beam|disc]... or RUN_OR_PROBLEM",
            help="Measured bodies that come with the package, by default all; with --measured a run directory or a "
            "problem file.",
        ),
    ] = None,
    measured: Annotated[
        Path | None,
        typer.Option(
            help="A curve of your own: text file with titles such as 'pressure A (kPa), extension (mm)' and one point "
            "a line."
        ),
    ] = None,
    tolerance: Annotated[
        list[str] | None,
        typer.Option(
            metavar="'rubber=5 %'",
            help="With --measured: a standard deviation other than the usual one, as of pneumorph tolerance; "
            "repeatable.",
        ),
    ] = None,
    quick: Annotated[bool, typer.Option("--quick", help="With large elements and steps.")] = False,
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for the table, all points, and a picture of each.")
    ] = None,
    task: Annotated[str | None, typer.Option(help="The task whose loads act; by default the first.")] = None,
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """Lay predictions beside measurements: published ones, or a curve of your own casting, with error bars."""
    from pneumorph.cli.validate import validate

    validate(
        source or [],
        measured=measured,
        tolerances=tolerance or [],
        quick=quick,
        out=out,
        number=design,
        task=task,
        trust=trust,
    )
