"""Arguments of the commands that make and search designs."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

import typer

from pneumorph.cli.commands.arguments import Trusted
from pneumorph.doing import doing


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
    problem: Annotated[Path, typer.Argument(metavar="PROBLEM", help="The problem file (TOML); with --resume, a run.")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="The run directory; by default runs/<name of the file>.")
    ] = None,
    iterations: Annotated[int | None, typer.Option(min=1, help="Maximum number of designs.")] = None,
    resume: Annotated[bool, typer.Option("--resume", help="Resume an interrupted run.")] = False,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the summary and errors.")] = False,
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
    quiet: Annotated[
        bool, typer.Option("--quiet", "-q", help="Print only warnings, violated limits, the verdict and errors.")
    ] = False,
    trust: Trusted = False,
) -> None:
    """Describe a problem, and check limits and gradient on its starting body, or on the last design of a run."""
    from pneumorph.cli.check import check

    check(problem, quick, trust, fewer, insert, quiet)


@doing("running the study")
def study(
    source: Annotated[Path, typer.Argument(metavar="STUDY", help="The study file (TOML).")],
    out: Annotated[
        Path | None, typer.Option("--out", "-o", help="The study's directory; by default runs/<name of the file>.")
    ] = None,
    cluster: Annotated[
        str | None,
        typer.Option(help="Address of a Dask scheduler, tcp://… or tls://…, whose workers share this disk; or slurm."),
    ] = None,
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Number of processes on this machine; by default one for every core and every 2 GB."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the location of the results.")] = False,
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
        Path | None,
        typer.Option("--out", "-o", help="The directory of the search; by default runs/<name of the file>."),
    ] = None,
    minutes: Annotated[float, typer.Option(min=0.1, help="How long it may take, to half a design.")] = 30.0,
    candidates: Annotated[int, typer.Option(min=2, max=1000, help="Number of bodies that are tried.")] = 24,
    seed: Annotated[int, typer.Option(min=0, help="Of the bodies that are drawn: the same seed draws the same.")] = 0,
    workers: Annotated[
        int | None,
        typer.Option(min=1, help="Number of processes; by default one for every core and every 2 GB."),
    ] = None,
    quiet: Annotated[bool, typer.Option("--quiet", "-q", help="Print only the location of the results.")] = False,
) -> None:
    """Propose bodies for a motion: layouts are tried, and the best of them designed."""
    from pneumorph.cli.propose import propose
    from pneumorph.proposals import Plan

    if status := propose(source, out, Plan(candidates, seed, minutes), workers, quiet):
        raise typer.Exit(status)
