"""Arguments of the commands that compute states, and of those that prepare or verify this."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneumorph.cli.commands.arguments import Trusted
from pneumorph.doing import doing


@doing("simulating")
def simulate(
    source: Annotated[Path, typer.Argument(metavar="PROBLEM_OR_RUN", help="A problem file, or a run directory.")],
    pressure: Annotated[
        list[str] | None,
        typer.Option(
            metavar="A=0:60:5kPa",
            help="Sweep a chamber's pressure from start to stop by step, or set a constant one (A=60kPa); repeatable. "
            "Swept chambers change together. Other chambers have the pressure of the task.",
        ),
    ] = None,
    volume: Annotated[
        list[str] | None,
        typer.Option(
            metavar="A=0:12:1ml",
            help="Fill a chamber with a volume of liquid beyond that at rest, constant or as a sweep, in place of a "
            "pressure, which is found; repeatable.",
        ),
    ] = None,
    move: Annotated[
        list[str] | None,
        typer.Option(
            metavar="plate.z=0:-3:-0.5mm",
            help="Move an obstacle along an axis, as a sweep or by a constant displacement (plate.z=-3mm), or turn it "
            "about one (plate.turn_z=0:90:5deg); repeatable. "
            "All sweeps change together. Other obstacles have the pose of the task.",
        ),
    ] = None,
    friction: Annotated[
        float | None,
        typer.Option(help="Coefficient of friction on obstacles; by default that of the problem. Use small steps."),
    ] = None,
    rate: Annotated[
        str | None,
        typer.Option(
            metavar="2kPa/s",
            help="How fast the first that is swept changes: rubber with a relaxation relaxes on the way.",
        ),
    ] = None,
    cycles: Annotated[
        int | None,
        typer.Option(
            min=1,
            max=1000,
            help="Sweep there and back so many times, and tell the energy lost: rubber with a softening softens.",
        ),
    ] = None,
    hold: Annotated[
        str | None,
        typer.Option(
            metavar="10s",
            help="With --rate: keep the loads for so long at the end of the sweep, or at both ends of every cycle.",
        ),
    ] = None,
    one_by_one: Annotated[
        bool,
        typer.Option("--one-by-one", help="Sweep one chamber after another; others stay at the start of their sweep."),
    ] = False,
    block: Annotated[
        list[str] | None,
        typer.Option(
            metavar="MOTION[=VALUE]",
            help="Block a motion of the plate and report the force or torque on the block: shift_x, shift_y, axial (or "
            "extension), bending_x, bending_y, torsion (or twist), all; held at a value, bending_y=30deg, or along a "
            "sweep, axial=0:4:1mm; repeatable.",
        ),
    ] = None,
    stiffness: Annotated[
        bool, typer.Option("--stiffness", help="Print the stiffness of the tip, the energy and the air of every step.")
    ] = False,
    blocked_along: Annotated[
        str | None,
        typer.Option(
            metavar="x|-z|1,0,1",
            help="The same, and the force with which the tip presses where it is kept from moving in this direction.",
        ),
    ] = None,
    supply: Annotated[
        list[str] | None,
        typer.Option(
            metavar="A=100kPa",
            help="Fill a chamber with air from a supply of this pressure, or of one that changes with time "
            "('A=0kPa@0s,100kPa@0.5s'); repeatable. Needs --tube and --times.",
        ),
    ] = None,
    tube: Annotated[
        list[str] | None,
        typer.Option(metavar="'2mm x 1m'", help="Inner diameter and length of the tubes, or of one, 'A=2mm x 1m'."),
    ] = None,
    times: Annotated[
        str | None, typer.Option(metavar="0:2:0.05s", help="Moments at which a body with a supply is shown.")
    ] = None,
    json: Annotated[Path | None, typer.Option(help="Write the steps to this file as JSON.")] = None,
    csv: Annotated[Path | None, typer.Option(help="Write the steps to this file as a table.")] = None,
    png: Annotated[Path | None, typer.Option(help="Draw the curves of a sweep to this file.")] = None,
    design: Annotated[int | None, typer.Option(min=0, help="Number of a run's design; by default the last.")] = None,
    task: Annotated[
        str | None, typer.Option(help="Simulate only this task; by default all tasks with different loads.")
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print no steps, for --json, --csv or --png.")] = False,
    trust: Trusted = False,
) -> None:
    """Simulate the starting body of a problem, or a design of a run: at the tasks' pressures or along sweeps."""
    files = {"--json": json, "--csv": csv, "--png": png}
    if supply or tube or times is not None:
        from pneumorph.cli.over_time import over_time

        others = {
            "--volume": volume,
            "--move": move,
            "--friction": friction,
            "--rate": rate,
            "--cycles": cycles,
            "--one-by-one": one_by_one,
            "--block": block,
            "--stiffness": stiffness,
            "--blocked-along": blocked_along,
        }
        over_time(source, supply or [], tube or [], times, pressure or [], others, files, design, task, quiet, trust)
        return
    from pneumorph.cli.simulate import simulate

    simulate(
        source,
        pressures=pressure or [],
        volumes=volume or [],
        moves=move or [],
        friction=friction,
        rate=rate,
        cycles=cycles,
        hold=hold,
        one_by_one=one_by_one,
        block=block or [],
        stiffness=stiffness,
        along=blocked_along,
        files=files,
        number=design,
        task=task,
        quiet=quiet,
        trust=trust,
    )


@doing("verifying")
def verify(
    only: Annotated[
        list[str] | None, typer.Option(metavar="NAME", help="Run only cases whose name contains this; repeatable.")
    ] = None,
    write: Annotated[Path | None, typer.Option(metavar="FILE.md", help="Write the table to this file.")] = None,
) -> None:
    """Verify the mechanics: reference, computed value, error and verdict of every case."""
    from pneumorph.cli.verify import verify

    verify(only or [], write)


@doing("warming up")
def warm_up() -> None:
    """Compile now what would be compiled when bodies are first checked and designed; once after the installation."""
    from pneumorph.cli.warm_up import warm_up

    warm_up()
