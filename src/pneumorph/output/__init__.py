"""What a person looks at: pictures of a run."""

from pneumorph.output.pictures import Pictures, run_pictures

__all__ = ["Pictures", "run_pictures"]
