"""Run the design loop to its end and store its designs in a run directory."""

from pneumorph.drive.single import Outcome, drive

__all__ = ["Outcome", "drive"]
