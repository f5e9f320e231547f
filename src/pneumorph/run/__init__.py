"""A run on disk."""

from pneumorph.run.directory import RunDirectory, StoredDesign, create, open_run, resume, unlike

__all__ = ["RunDirectory", "StoredDesign", "create", "open_run", "resume", "unlike"]
