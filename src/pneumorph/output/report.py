"""The page of a run: one file that shows its shapes, numbers and problem in any browser, without a network."""

from __future__ import annotations

import html
from collections.abc import Mapping, Sequence
from importlib import resources
from pathlib import Path
from typing import Any

from pneumorph.atomic import write_bytes
from pneumorph.doing import doing
from pneumorph.errors import ProblemError, writing
from pneumorph.geometry import Body
from pneumorph.geometry.starting import body_of
from pneumorph.limits.of_shape import limits_of
from pneumorph.output.packed import as_text, pack
from pneumorph.output.report_data import facts_of
from pneumorph.output.report_limits import Known, packed_usage
from pneumorph.output.report_model import NAME, packed_model
from pneumorph.output.report_shapes import Arrays, packed_obstacles, packed_states, packed_surfaces
from pneumorph.results import HistoryEntry
from pneumorph.run import RunDirectory

PAGE = "page/report.html"
"""The page without a run, as `web/build.js` makes it."""

NO_MODEL = "there are no pressures to set"


def write_report(run: RunDirectory, path: Path | None = None, model: Path | None = None) -> Path:
    """Write the page of a run with at least one design, which may be still running or have failed; see `Run.report`."""
    return write_page(run, path, model)[0]


@doing("writing the page")
def write_page(run: RunDirectory, path: Path | None = None, model: Path | None = None) -> tuple[Path, str]:
    """The same, with a sentence on the fast model on it, or on why that of the run is not; empty without one."""
    path = run.path / "report.html" if path is None else Path(path)
    facts, arrays = _collected(run, finished(run), model=model, driven=True)
    page = page_of([pack(facts, arrays, 9)], run.problem.title or run.path.resolve().name)
    given = run.path / NAME if model is None else model
    words = "; ".join(note for note in facts["notes"] if note.startswith(NO_MODEL))
    if "model" in facts:
        told = facts["model"]
        words = f"the fast model {given} is on it: design {told['design']} follows sliders and a target"
    return save_page(page, path), words


def save_page(page: str, path: Path) -> Path:
    """Write a page; ProblemError if that is impossible."""
    with writing(path, "name another file with --out"):
        path.parent.mkdir(parents=True, exist_ok=True)
        write_bytes(path, page.encode())
    return path


def finished(run: RunDirectory) -> list[HistoryEntry]:
    """The designs that the page shows: what lies beyond the checkpoint is in progress.

    Raises
    ------
    ProblemError
        If there is none.
    """
    latest = run.latest()
    if latest is None:
        raise ProblemError(f"{run.path}: there is no finished design in it yet; run pneumorph design first")
    return [entry for entry in run.history() if entry.iteration <= latest]


def facts_and_shapes(
    run: RunDirectory,
    history: list[HistoryEntry],
    more: Mapping[str, Any] | None = None,
    level: int = 9,
    numbers: int | None = None,
    known: Known | None = None,
    model: Path | None = None,
    driven: bool = False,
) -> bytes:
    """Pack everything that the page shows, and more facts, into one block.

    Parameters
    ----------
    run : RunDirectory
    history : list of HistoryEntry
        The designs that are shown.
    more : mapping, optional
        Other facts for the page.
    level : int
        Of compression, from 0 to 9.
    numbers : int, optional
        Most displacements and stretches in the block.
    known : Known, optional
        For `packed_usage`.
    model : Path, optional
        A fast model of one of the designs.
    driven : bool
        Whether the page has the model in the run directory, if none is given and one is there.

    Raises
    ------
    ProblemError
        If the model that is given cannot be shown.
    """
    return pack(*_collected(run, history, more, numbers, known, model, driven), level)


def _collected(
    run: RunDirectory,
    history: list[HistoryEntry],
    more: Mapping[str, Any] | None = None,
    numbers: int | None = None,
    known: Known | None = None,
    model: Path | None = None,
    driven: bool = False,
) -> tuple[dict[str, Any], Arrays]:
    """The facts and arrays of such a block."""
    start = body_of(run.problem)
    bodies = [run.load_design(entry.iteration).on(start) for entry in history]
    surfaces, drawn = packed_surfaces(bodies)
    words, used = packed_usage(limits_of(run.problem, start), bodies, known)
    told, modes, left_out = _model(run, history, bodies, model, driven)
    taken = sum(array.values.size for array in modes.values())
    states, moved, notes = packed_states(run, history, numbers, taken)
    obstacles, beside = packed_obstacles(run.problem)
    shapes = {"surfaces": surfaces, "obstacles": obstacles, "states": states, "notes": notes + left_out}
    facts = facts_of(run, history) | words | shapes | told | dict(more or {})
    return facts, drawn | used | beside | moved | modes


def _model(
    run: RunDirectory, history: list[HistoryEntry], bodies: Sequence[Body], given: Path | None, driven: bool
) -> tuple[dict[str, Any], Arrays, list[str]]:
    """What the page is told of a model, its arrays, and why that in the run directory is left out."""
    own = run.path / NAME
    if given is not None:
        return *packed_model(given, run.problem, history, bodies), []
    if not driven or not own.exists():
        return {}, {}, []
    try:
        return *packed_model(own, run.problem, history, bodies), []
    except ProblemError as error:
        return {}, {}, [f"{NO_MODEL}, since {error}"]


def page_of(blocks: Sequence[bytes], title: str) -> str:
    """The page with a block for every run. Of what users write, only the title is in the page as text."""
    # The title last: it may hold anything.
    return _empty().replace("{{block}}", "\n".join(map(as_text, blocks)), 1).replace("{{title}}", html.escape(title), 1)


def served_page(title: str) -> str:
    """The page without a block: it asks the server that it comes from, and may contact no other."""
    allowed = _empty().replace("default-src 'none'", "default-src 'none'; connect-src 'self'", 1)
    return allowed.replace("{{block}}", "", 1).replace("{{title}}", html.escape(title), 1)


def _empty() -> str:
    return resources.files("pneumorph.output").joinpath(PAGE).read_text(encoding="utf-8")
