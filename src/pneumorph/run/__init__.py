"""Runs on disk."""

from pneumorph.run.differences import differences, in_words
from pneumorph.run.directory import RunDirectory, StoredDesign, create, open_run, resume
from pneumorph.run.lock import locked

__all__ = [
    "RunDirectory",
    "StoredDesign",
    "create",
    "differences",
    "in_words",
    "locked",
    "open_run",
    "resume",
]
