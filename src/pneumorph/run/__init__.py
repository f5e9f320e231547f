"""Runs on disk."""

from pneumorph.run.differences import differences, in_words
from pneumorph.run.directory import RunDirectory
from pneumorph.run.lock import locked
from pneumorph.run.opening import create, open_run, resume
from pneumorph.run.stored import StoredDesign

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
