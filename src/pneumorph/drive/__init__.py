"""One run driven to its end: the design loop with a run directory."""

from pneumorph.drive.single import Outcome, drive

__all__ = ["Outcome", "drive"]
