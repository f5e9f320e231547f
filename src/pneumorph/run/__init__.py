"""Runs on disk."""

from pneumorph.run.directory import RunDirectory, StoredDesign, create, first_difference, open_run, resume

__all__ = ["RunDirectory", "StoredDesign", "create", "first_difference", "open_run", "resume"]
