"""All pictures of a run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from pneumorph.run import RunDirectory


@dataclass(frozen=True)
class Pictures:
    """The pictures that were made, and a sentence for each that could not be."""

    paths: tuple[Path, ...]
    missing: tuple[str, ...]


def run_pictures(run: RunDirectory) -> Pictures:
    return Pictures((), ())
