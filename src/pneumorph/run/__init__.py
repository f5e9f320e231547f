"""A run on disk."""

from pneumorph.run.directory import Design, RunDirectory, create, open_run, resume, unlike

__all__ = ["Design", "RunDirectory", "create", "open_run", "resume", "unlike"]
