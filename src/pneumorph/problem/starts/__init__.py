"""Commented problem files to start from, one for each kind of robot."""

from pathlib import Path

KINDS = ("extension", "bending", "twist", "finger", "arm")
"""Tubes."""

SOLIDS = ("pneunet", "dome")
"""Bodies from files, whose text has STEP in place of the name of the file."""


def text_of(kind: str) -> str:
    """The text of the problem file of a kind, one of `KINDS` or `SOLIDS`."""
    return Path(__file__).with_name(f"{kind}.toml").read_text(encoding="utf-8")
