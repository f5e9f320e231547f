"""Libraries that only some commands need: which are missing, and how they are installed."""

from __future__ import annotations

import platform
import sys
from importlib.util import find_spec

LIBRARIES = {
    "cad": ("OCP", "manifold3d", "lib3mf"),
    "fast": ("pypardiso",),
    "pictures": ("pyvista",),
}
"""The extras by which they are installed, and what is imported of each."""


def missing(extra: str, what: str) -> str:
    """What something needs that is not installed, and how to install it; empty if everything is there.

    Parameters
    ----------
    extra : one of `LIBRARIES`.
    what : the subject of the sentence.
    """
    absent = [library for library in LIBRARIES[extra] if find_spec(library) is None]
    return f"{what} needs {', '.join(absent)}; install with: pip install 'pneumorph[{extra}]'" if absent else ""


def has_mkl() -> bool:
    """Whether there are packages of MKL for this machine."""
    return platform.machine() == "x86_64" and sys.platform != "darwin"
