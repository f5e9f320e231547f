"""Pictures, tables and exports of a run."""

from pneumorph.output.pictures import Pictures, run_pictures

__all__ = ["Pictures", "run_pictures"]
