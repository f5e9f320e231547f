"""Studies: many designs at once on Dask, and a summary of their results."""

from pneumorph.study.file import Member, Study, load_study
from pneumorph.study.front import write_front
from pneumorph.study.members import run_member
from pneumorph.study.summary import write_sheet, write_summary

__all__ = ["Member", "Study", "load_study", "run_member", "write_front", "write_sheet", "write_summary"]
