"""Arguments of the commands that show a design and write its files."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneumorph.cli.commands.arguments import DesignNumber, RunDirectory, Trusted
from pneumorph.doing import doing


@doing("exporting")
def export(
    source: Annotated[
        Path, typer.Argument(metavar="RUN_OR_PROBLEM", help="A run directory, or a problem file (TOML).")
    ],
    out: Annotated[Path, typer.Option("--out", "-o", help="The file to write.")],
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
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="The file; by default report.html in the directory.")
    ] = None,
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
        Path | None,
        typer.Option("--out", "-o", help="The file to write; by default in the folder pictures of the run."),
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
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for files; by default make in the run directory.")
    ] = None,
    chord: Annotated[str, typer.Option(help="Largest distance of the triangles in 3MF and STL from the body.")] = (
        "0.02 mm"
    ),
    trust: Trusted = False,
) -> None:
    """Write a design as exact CAD (STEP) and as triangles (3MF, STL), make its mould, and check the files."""
    from pneumorph.cli.make import make

    make(run, design, out, chord, trust)
