"""A run on disk."""

from pneumorph.run.directory import Design, RunDirectory, create, open_run, resume

__all__ = ["Design", "RunDirectory", "create", "open_run", "resume"]
