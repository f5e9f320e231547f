"""Arguments of the commands on elastomers."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneumorph.cli.help import WholeSentences
from pneumorph.doing import doing

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
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="Folder for the results; by default <name of the file>-fit.")
    ] = None,
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
