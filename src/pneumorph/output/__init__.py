"""Pictures, tables, exports and the page of a run."""

from pneumorph.output.pictures import Pictures, run_pictures
from pneumorph.output.report import write_report

__all__ = ["Pictures", "run_pictures", "write_report"]
