"""Arguments of the commands. Their implementations are loaded when they are called, so that --help is fast."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneumorph.cli.help import WholeSentences
from pneumorph.doing import doing

RunDirectory = Annotated[Path, typer.Argument(metavar="RUN", help="A run directory.")]
Trusted = Annotated[bool, typer.Option("--trust", help="Run the Python code in the file without asking.")]
DesignNumber = Annotated[int | None, typer.Option(min=0, help="Number of the design; by default the last.")]


@doing("making the problem file")
def new(
    name: Annotated[Path, typer.Argument(metavar="NAME", help="Name of the file; .toml is added.")],
    kind: Annotated[
        str,
        typer.Option(
            metavar="KIND",
            help="Kind of robot: extension, bending, twist, finger, arm; or, with sizes, pneunet, fast-pneunet, "
            "dome, cup, bellows, hand, half-round (all but the last with a CAD file).",
        ),
    ] = "extension",
    size: Annotated[
        list[str] | None,
        typer.Option(metavar="KEY=VALUE", help="A size of a kind that has some, e.g. wall=1.5mm; repeatable."),
    ] = None,
) -> None:
    """Write a commented problem file to start from, and the CAD file (STEP) of its body where it has one."""
    from pneumorph.cli.new import new

    new(name, kind, size or [])


@doing("designing")
def design(
    problem: Annotated[Path, typer.Argument(metavar="PROBLEM", help="The problem file (TOML).")],
    out: Annotated[Path | None, typer.Option(help="The run directory; by default runs/<name of the file>.")] = None,
    iterations: Annotated[int | None, typer.Option(min=1, help="Maximum number of designs.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Resume an interrupted run.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print only the summary and errors.")] = False,
    verbose: Annotated[
        bool,
        typer.Option(
            "--verbose", help="Print more of every design: step, gain over predicted gain, gradient left, cost."
        ),
    ] = False,
    trust: Trusted = False,
    begin: Annotated[
        Path | None,
        typer.Option(
            metavar="RUN",
            help="Begin with the last design of a run of the same body: tasks may ask for something else there, and "
            "limits on motions may be others.",
        ),
    ] = None,
) -> None:
    """Design a body for a problem."""
    from pneumorph.cli.design import design

    design(problem, out, iterations, resume, quiet, verbose, trust, begin)


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
    quiet: Annotated[bool, typer.Option("--quiet", help="Print no steps, for --json, --csv or --png.")] = False,
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


@doing("checking")
def check(
    problem: Annotated[
        Path, typer.Argument(metavar="PROBLEM_OR_RUN", help="A problem file (TOML), or a run directory.")
    ],
    quick: Annotated[bool, typer.Option("--quick", help="Leave out the test of the gradient.")] = False,
    fewer: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="Of a run: write its problem without chambers that no task uses, and with one supply for those with "
            "the same pressures.",
        ),
    ] = None,
    insert: Annotated[
        Path | None,
        typer.Option(
            metavar="FILE.toml",
            help="Of a run: tell where a further chamber would help most, and write its problem with one there.",
        ),
    ] = None,
    trust: Trusted = False,
) -> None:
    """Describe a problem, and check limits and gradient on its starting body, or on the last design of a run."""
    from pneumorph.cli.check import check

    check(problem, quick, trust, fewer, insert)


@doing("estimating the error of the mesh")
def accuracy(
    source: Annotated[Path, typer.Argument(metavar="RUN_OR_PROBLEM", help="A run directory, or a problem file.")],
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """How far the motions of a design are from those on infinitely fine meshes."""
    from pneumorph.cli.accuracy import accuracy

    accuracy(source, design, trust)


@doing("finding how the motion scatters")
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
    json: Annotated[Path | None, typer.Option(help="Write all figures to this file as JSON.")] = None,
    picture: Annotated[
        Path | None, typer.Option(help="Draw what 0.1 mm more rubber at each place does (png, pdf or svg).")
    ] = None,
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """How far the motion of a design scatters when it is made: a table of what each tolerance contributes."""
    from pneumorph.cli.tolerance import tolerance

    given = {"rubber": rubber, "pressure": pressure, "wall": wall, "shift": shift, "tilt": tilt, "scale": scale}
    tolerance(source, {**given, "load": load}, design, task, json, picture, trust)


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
        Path | None, typer.Option(help="The file, .npz; by default model.npz in the run, or the name of the problem.")
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


@doing("calibrating")
def calibrate(
    source: Annotated[Path, typer.Argument(metavar="RUN_OR_PROBLEM", help="A run directory, or a problem file.")],
    measured: Annotated[
        Path,
        typer.Option(help="Text file with titles such as 'pressure A (kPa), extension (mm)' and one point a line."),
    ],
    fit: Annotated[
        str, typer.Option(metavar="modulus,wall,pressure", help="What is fitted, separated by commas.")
    ] = "modulus",
    task: Annotated[str | None, typer.Option(help="The task whose loads act; by default the first.")] = None,
    out: Annotated[Path | None, typer.Option(help="Write the problem with the rubber found to this file.")] = None,
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """Find the rubber, the walls and the pressure error of a casting from a measured curve."""
    from pneumorph.cli.calibrate import calibrate

    calibrate(source, measured, fit, design, task, out, trust)


@doing("comparing with what was measured")
def validate(
    source: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[beam|disc]... or RUN_OR_PROBLEM",
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
    out: Annotated[Path | None, typer.Option(help="Folder for the table, all points, and a picture of each.")] = None,
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


@doing("exporting")
def export(
    source: Annotated[
        Path, typer.Argument(metavar="RUN_OR_PROBLEM", help="A run directory, or a problem file (TOML).")
    ],
    out: Annotated[Path, typer.Option(help="The file to write.")],
    format: Annotated[
        str | None,
        typer.Option(
            metavar="vtu|inp|msh|feb|py|xml",
            help="vtu for ParaView and VTK, inp for CalculiX and Abaqus, msh for Gmsh, feb for FEBio, py for SOFA, xml "
            "for a chain of rigid links in MuJoCo; by default the suffix of the file.",
        ),
    ] = None,
    task: Annotated[
        str | None, typer.Option(help="Task whose loads are written to an input file; by default the first.")
    ] = None,
    design: DesignNumber = None,
    trust: Trusted = False,
) -> None:
    """Export a design of a run, or the starting body of a problem, for other programs, always as a whole body."""
    from pneumorph.cli.source import design_of
    from pneumorph.cli.trust import asking

    chosen = design_of(source, design, asking(trust))
    if (format or out.suffix.removeprefix(".")) == "xml":
        from pneumorph.interface.chain import chain_words

        print(chain_words(chosen.export_chain(out, task=task)))
    else:
        chosen.export(out, format, task)
    print(f"written to {out}")
    if chosen.has_found_pressures(task) and (format or out.suffix.removeprefix(".")) in ("inp", "feb", "py"):
        print("chambers that are filled or sealed have the pressures found in the file, which stay as they are there")


@doing("writing the page")
def report(
    run: Annotated[Path, typer.Argument(metavar="RUN|STUDY", help="A run directory, or the directory of a study.")],
    out: Annotated[Path | None, typer.Option(help="The file; by default report.html in the directory.")] = None,
    model: Annotated[
        Path | None,
        typer.Option(
            help="A fast model of a design of the run; by default model.npz in the directory, if it is there."
        ),
    ] = None,
    trust: Trusted = False,
) -> None:
    """Write the page of a run, or of all members of a study: one file for any browser, with shapes and numbers."""
    from pneumorph.cli.trust import asking
    from pneumorph.interface.runs import open_run
    from pneumorph.output.report import write_page
    from pneumorph.output.study_page import member_paths, write_study_page

    if members := member_paths(run):
        print(f"written to {write_study_page(run, [open_run(each, asking(trust)).directory for each in members], out)}")
    else:
        path, words = write_page(open_run(run, asking(trust)).directory, out, model)
        print(f"written to {path}")
        if words:
            print(words)


@doing("drawing")
def draw(
    source: Annotated[
        Path,
        typer.Argument(
            metavar="RUN_OR_PROBLEM",
            help="A run directory; the run may be in progress or stopped. Or a problem file, for body and inflation.",
        ),
    ],
    picture: Annotated[
        str,
        typer.Argument(
            metavar="PICTURE",
            help="body, history, profile, shape, pressures, evolution or inflation; or all, as at the end of a run.",
        ),
    ] = "body",
    design: DesignNumber = None,
    cut: Annotated[
        str | None,
        typer.Option(metavar="yz|xz|xy|none", help="Plane of the cut; by default the plane of bending of each task."),
    ] = None,
    at: Annotated[
        str | None, typer.Option(metavar="LENGTH", help='Position of the cut along its normal axis, e.g. "3 mm".')
    ] = None,
    task: Annotated[str | None, typer.Option(help="Show only this task.")] = None,
    format: Annotated[
        str | None,
        typer.Option(
            metavar="png|pdf|svg|gif", help="gif for evolution and inflation; by default the suffix of --out."
        ),
    ] = None,
    out: Annotated[
        Path | None, typer.Option(help="The file to write; by default in the folder pictures of the run.")
    ] = None,
    trust: Trusted = False,
) -> None:
    """Draw a picture of a run: a design cut open, its history, or how it changes and inflates."""
    from pneumorph.cli.draw import draw

    draw(source, picture, design, cut, at, task, format, out, trust)


def view(
    runs: Annotated[list[Path], typer.Argument(metavar="RUN...", help="Run directories; several are compared.")],
    port: Annotated[int, typer.Option(min=0, help="The port on this machine; 0 for a free one.")] = 0,
    browser: Annotated[bool, typer.Option("--browser/--no-browser", help="Open the page in a browser.")] = True,
    trust: Trusted = False,
) -> None:
    """Show runs in a browser, live while they go on, and let their pressures be set; only on this machine."""
    from pneumorph.cli.view import view

    view(runs, port, browser, trust)


@doing("making the files")
def make(
    run: RunDirectory,
    design: DesignNumber = None,
    out: Annotated[Path | None, typer.Option(help="Folder for files; by default make in the run directory.")] = None,
    chord: Annotated[str, typer.Option(help="Largest distance of the triangles in 3MF and STL from the body.")] = (
        "0.02 mm"
    ),
    trust: Trusted = False,
) -> None:
    """Write a design as exact CAD (STEP) and as triangles (3MF, STL), make its mould, and check the files."""
    from pneumorph.cli.make import make

    make(run, design, out, chord, trust)


@doing("running the study")
def study(
    source: Annotated[Path, typer.Argument(metavar="STUDY", help="The study file (TOML).")],
    out: Annotated[Path | None, typer.Option(help="The study's directory; by default runs/<name of the file>.")] = None,
    cluster: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler, tcp://… or tls://…, whose workers share this disk; or slurm."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Number of processes on this machine; by default one for every core and every 2 GB."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print only the location of the results.")] = False,
    tls_ca: Annotated[
        Path | None,
        typer.Option(metavar="FILE.pem", help="For tls://…: certificate of the authority that signed the others."),
    ] = None,
    tls_cert: Annotated[
        Path | None, typer.Option(metavar="FILE.pem", help="For tls://…: certificate of this machine.")
    ] = None,
    tls_key: Annotated[
        Path | None, typer.Option(metavar="FILE.pem", help="For tls://…: key of that certificate.")
    ] = None,
    trust: Trusted = False,
) -> None:
    """Run every design of a study; finished members are not run again."""
    from pneumorph.cli.study import study

    tls = {"--tls-ca": tls_ca, "--tls-cert": tls_cert, "--tls-key": tls_key}
    study(source, out, cluster, workers, quiet, tls, trust)


def propose(
    source: Annotated[Path, typer.Argument(metavar="TARGET", help="The target file (TOML): tasks, and no body.")],
    out: Annotated[
        Path | None, typer.Option(help="The directory of the search; by default runs/<name of the file>.")
    ] = None,
    minutes: Annotated[float, typer.Option(min=0.1, help="How long it may take.")] = 30.0,
    candidates: Annotated[int, typer.Option(min=2, max=1000, help="Number of bodies that are tried.")] = 24,
    seed: Annotated[int, typer.Option(min=0, help="Of the bodies that are drawn: the same seed draws the same.")] = 0,
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Number of processes; by default one for every core and every 2 GB."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", help="Print only the location of the results.")] = False,
) -> None:
    """Propose bodies for a motion: layouts are tried, and the best of them designed."""
    from pneumorph.cli.propose import propose
    from pneumorph.proposals import Plan

    if status := propose(source, out, Plan(candidates, seed, minutes), workers, quiet):
        raise typer.Exit(status)


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


material = typer.Typer(
    cls=WholeSentences,
    no_args_is_help=True,
    rich_markup_mode=None,
    help="Elastomers: show the library, fit models to tension tests.",
)


@material.command("list")
def list_materials(json: Annotated[bool, typer.Option("--json", help="As JSON, for scripts.")] = False) -> None:
    """List the elastomers of the library: model, parameters, stiffness, range and source."""
    from pneumorph.cli.material import list_

    list_(json)


@material.command("show")
def show_material(name: Annotated[str, typer.Argument(metavar="NAME", help="An elastomer of the library.")]) -> None:
    """Show an elastomer of the library."""
    from pneumorph.cli.material import show

    show(name)


@material.command("fit")
@doing("fitting")
def fit_material(
    data: Annotated[
        list[str] | None,
        typer.Argument(
            metavar="[MODE=]FILE...",
            help="CSV or text files of tests, as machines write them; MODE is uniaxial (by default), equibiaxial or "
            "planar (pure shear). With --beam, one file with points of a centre line.",
        ),
    ] = None,
    model: Annotated[
        str, typer.Option(help="One of neo-hookean, mooney-rivlin, yeoh, gent, arruda-boyce, ogden, or all.")
    ] = "all",
    stress: Annotated[
        str | None,
        typer.Option(metavar="nominal|true", help="Kind of stress, if the title does not state it."),
    ] = None,
    strain: Annotated[
        str | None,
        typer.Option(metavar="stretch|strain|percent|true", help="Kind of strain, if the title does not state it."),
    ] = None,
    strain_column: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="Title or number (from 1) of the column of strain.")
    ] = None,
    stress_column: Annotated[
        str | None, typer.Option(metavar="COLUMN", help="Title or number (from 1) of the column of stress or force.")
    ] = None,
    stress_unit: Annotated[str | None, typer.Option(metavar="UNIT", help="Unit of stress, e.g. kPa or psi.")] = None,
    skip: Annotated[int, typer.Option(min=0, help="Number of lines to skip at the start of the files.")] = 0,
    gauge_length: Annotated[
        str | None, typer.Option(metavar="LENGTH", help='Undeformed length for displacements, e.g. "25 mm".')
    ] = None,
    section: Annotated[
        str | None, typer.Option(metavar="SIZE", help='Undeformed section for forces, "4 mm x 2 mm" or "8 mm^2".')
    ] = None,
    max_stretch: Annotated[
        float | None, typer.Option(help="Largest stretch in use; points beyond are left out.")
    ] = None,
    least_r2: Annotated[
        float, typer.Option(min=0.0, max=1.0, help="R² below which no table [material] is written.")
    ] = 0.9,
    weight: Annotated[
        list[str] | None,
        typer.Option(metavar="MODE=NUMBER", help="Weight of the tests of a mode, by default 1; repeatable."),
    ] = None,
    strain_from: Annotated[
        str | None,
        typer.Option(metavar="extensometer|crosshead", help="Whether strain was measured on the specimen itself."),
    ] = None,
    out: Annotated[Path | None, typer.Option(help="Folder for the results; by default <name of the file>-fit.")] = None,
    density: Annotated[
        str | None,
        typer.Option(help="Density for the table [material], by default 1.1 g/cm^3; tests do not determine it."),
    ] = None,
    beam: Annotated[
        bool,
        typer.Option("--beam", help="A strip, clamped at one end, that bends under its own weight, in place of tests."),
    ] = False,
    length: Annotated[str | None, typer.Option(metavar="LENGTH", help="With --beam: free length at rest.")] = None,
    deflection: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="With --beam: of the tip, in place of a file.")
    ] = None,
    error: Annotated[
        str | None, typer.Option(metavar="LENGTH", help="With --beam: standard deviation of it, by default 0.5 mm.")
    ] = None,
    tip_mass: Annotated[str | None, typer.Option(metavar="MASS", help="With --beam: of a body at the tip.")] = None,
    like: Annotated[
        str | None,
        typer.Option(metavar="NAME", help="With --beam: elastomer of the library whose stiffening is kept."),
    ] = None,
) -> None:
    """Fit models to tension tests, judge them in all modes, and write the simplest good one as a table [material]."""
    from pneumorph.cli.material import beam as beam_
    from pneumorph.cli.material import fit_

    of_beams = {"deflection": deflection, "error": error, "tip_mass": tip_mass, "like": like}
    if beam:
        beam_(data or [], of_beams, {"length": length, "section": section}, density, out)
        return
    options = {
        "max_stretch": max_stretch,
        "stress": stress,
        "strain": strain,
        "strain_column": strain_column,
        "stress_column": stress_column,
        "stress_unit": stress_unit,
        "skip": skip,
        "gauge_length": gauge_length,
        "section": section,
        "least_r2": least_r2,
        "strain_from": strain_from,
    }
    fit_(data or [], model, out, density or "1.1 g/cm^3", weight or [], options, {**of_beams, "length": length})
