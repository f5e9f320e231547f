"""`pneumorph draw`: draw pictures of a run, during it or afterwards."""

from __future__ import annotations

from pathlib import Path
from typing import cast

from pneumorph.cli.source import design_of
from pneumorph.cli.trust import asking
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.interface.pictures import TAKES
from pneumorph.interface.runs import Run, open_run
from pneumorph.output.cuts import Cut
from pneumorph.output.pictures import picture_names, run_pictures


def draw(
    source: Path,
    picture: str,
    design: int | None,
    cut: str | None,
    at: str | None,
    task: str | None,
    format: str | None,
    out: Path | None,
    trust: bool,
) -> None:
    """Draw a picture of a run, or all of them.

    Parameters
    ----------
    source : Path
        The run directory, or a problem file, of which "body" and "inflation" show the starting body.
    picture : str
        One of those of `Run.draw`, or "all".
    design, cut, at, task, format, out
        As in `Run.draw`, of a single picture.
    trust : bool
        Whether code in the problem file is trusted.

    Raises
    ------
    ProblemError
        If an option does not fit the picture or the run.
    """
    if not source.is_dir():
        start = design_of(source, design, asking(trust))
        if picture not in ("body", "inflation"):
            others = ", ".join(each for each in TAKES if each not in ("body", "inflation"))
            raise ProblemError(
                f'{source}: of a problem file, body or inflation can be drawn, not "{picture}"; of its run also '
                f"{others}, or all"
            )
        suffix = format or ("png" if picture == "body" else "gif")
        path = source.with_name(f"{source.stem}_{picture}.{suffix}") if out is None else out
        if picture == "body":
            start.plot(path, cast(Cut | None, cut), at, task)
        else:
            start.animate(path, task, cast(Cut | None, cut), at)
        print(f"written to {path}")
        return
    run = open_run(source, asking(trust))
    if picture not in (*TAKES, "all"):
        any_design = "" if run.latest is None else f"; designs are 0 to {run.latest}"
        raise ProblemError(f'"{picture}" is not a picture; draw one of {", ".join(TAKES)}, or all{any_design}')
    if picture != "all":
        print(f"written to {run.draw(picture, out, design, cast(Cut | None, cut), at, task, format)}")
        return
    options = {"--design": design, "--cut": cut, "--at": at, "--task": task, "--format": format, "--out": out}
    for option, value in options.items():
        if value is not None:
            raise ProblemError(f"{option}: means nothing for all pictures; name one of them or leave it out")
    _draw_all(run)


def _draw_all(run: Run) -> None:
    # Says what is wrong with a run without designs.
    run.design()
    drawn = run_pictures(run.directory)
    print(f"pictures in {run.path / 'pictures'}: {picture_names(drawn.paths)}")
    if drawn.missing:
        raise ComputationError("; ".join(drawn.missing))
