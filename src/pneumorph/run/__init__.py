"""Runs on disk."""

from pneumorph.run.differences import differences, in_words
from pneumorph.run.directory import RunDirectory, StoredDesign, create, open_run, resume
from pneumorph.run.lock import held

__all__ = [
    "RunDirectory",
    "StoredDesign",
    "create",
    "differences",
    "held",
    "in_words",
    "open_run",
    "resume",
]
