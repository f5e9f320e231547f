"""Many designs at once: a study file's members, run on Dask, and what they came to."""

from pneumorph.study.file import Member, Study, load_study
from pneumorph.study.members import run_member
from pneumorph.study.summary import write_sheet, write_summary

__all__ = ["Member", "Study", "load_study", "run_member", "write_sheet", "write_summary"]
