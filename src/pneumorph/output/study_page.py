"""The page of a study: all its members in one file, side by side, to be sorted and filtered."""

from __future__ import annotations

import tomllib
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import tomli_w

from pneumorph.doing import doing
from pneumorph.errors import ProblemError
from pneumorph.output.report import facts_and_shapes, finished, page_of, save_page
from pneumorph.output.report_shapes import MOST_NUMBERS
from pneumorph.run import RunDirectory

MOST_WHOLE = 12
"""Members of which every design is in the page; of more, the first and the last are, which keeps it below 5 MB."""

MOST_KEYS, WORDS = 8, ("title", "source", "code")
"""Most columns for what members change, and keys of which the values are not for a table."""


def member_paths(folder: Path) -> list[Path]:
    """The run directories in the directory of a study; none where it is not one."""
    if (folder / "problem.toml").exists() or not folder.is_dir():
        return []
    return sorted(path.parent for path in folder.glob("*/problem.toml"))


@doing("writing the page")
def write_study_page(folder: Path, members: Sequence[RunDirectory], path: Path | None = None, title: str = "") -> Path:
    """Write the page of a study, by default as ``report.html`` in its directory.

    Parameters
    ----------
    folder : the directory of the study, after which the page is named.
    members : its runs; those without a design are named in the page.
    path : the file.
    title : its heading; by default the name of the folder.

    Raises
    ------
    ProblemError
        If no member has a design yet, or the file cannot be written.
    """
    begun = [run for run in members if run.latest() is not None]
    if not begun:
        raise ProblemError(f"{folder}: no member has a finished design yet; run pneumorph study first")
    title = title or folder.resolve().name
    without = [f"{run.path.name} has no finished design." for run in members if run.latest() is None]
    changes = changed([_flat(run) for run in begun])
    blocks = []
    for run, own in zip(begun, changes, strict=True):
        history = finished(run)
        if len(begun) > MOST_WHOLE and len(history) > 1:
            history = [history[0], history[-1]]
        member = {"name": run.path.name, "title": title, "changes": own, "without": without}
        blocks.append(facts_and_shapes(run, history, {"member": member}, numbers=MOST_NUMBERS // len(begun)))
    return save_page(page_of(blocks, title), folder / "report.html" if path is None else path)


def changed(problems: Sequence[Mapping[str, str]]) -> list[dict[str, str]]:
    """Of every problem, as values by dotted keys, the values in which not all are equal."""
    keys = [
        key
        for key in dict.fromkeys(key for each in problems for key in each)
        if len({each.get(key) for each in problems}) > 1 and key.rpartition(".")[2] not in WORDS
    ]
    return [{key: each[key] for key in keys[:MOST_KEYS] if key in each} for each in problems]


def _flat(run: RunDirectory) -> dict[str, str]:
    text = (run.path / "problem.toml").read_text(encoding="utf-8-sig", errors="replace")
    return dict(_leaves(tomllib.loads(text)))


def _leaves(value: Any, key: str = "") -> Iterator[tuple[str, str]]:
    """The values of a file by their dotted keys, as they are written."""
    if isinstance(value, dict):
        for name, part in value.items():
            yield from _leaves(part, f"{key}.{name}" if key else name)
    elif isinstance(value, list) and any(isinstance(part, dict) for part in value):
        for number, part in enumerate(value):
            yield from _leaves(part, f"{key}[{number}]")
    else:
        yield key, value if isinstance(value, str) else tomli_w.dumps({"value": value}).removeprefix("value = ").strip()
