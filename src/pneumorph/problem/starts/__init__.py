"""Commented problem files to start from, one for each kind of robot that is made of tubes."""

from pathlib import Path

KINDS = ("extension", "bending", "twist", "finger", "arm")


def text_of(kind: str) -> str:
    """The text of the problem file of a kind, one of `KINDS`."""
    return Path(__file__).with_name(f"{kind}.toml").read_text(encoding="utf-8")
