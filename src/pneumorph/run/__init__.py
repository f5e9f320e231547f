"""A run on disk, and what happens in it."""

from pneumorph.run.directory import Design, RunDirectory, create, open_run, resume

__all__ = ["Design", "RunDirectory", "create", "open_run", "resume"]
