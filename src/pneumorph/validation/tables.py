"""The published measurements that come with the package, and the problems that predict them."""

from __future__ import annotations

from importlib.resources import files
from pathlib import Path

import numpy as np

from pneumorph.problem import Problem, load

PUBLISHED = Path(str(files("pneumorph.validation") / "published"))
"""The folder with problem files, bodies, curves, and a list of the sources."""


def problem_of(body: str, rubber: str, size: float) -> Problem:
    """The frozen problem of a body with a rubber, with elements of a size in mm."""
    return load(PUBLISHED / f"{body}_{rubber}.toml").with_changes({"mesh.size": f"{size} mm"})


def table_of(body: str) -> np.ndarray:
    """The measured values of a body, by the titles of their columns."""
    return np.genfromtxt(
        PUBLISHED / f"{body}.csv", delimiter=",", names=True, dtype=None, encoding="utf-8", deletechars=""
    )
