"""Orientations of sections."""

from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field

from pneumorph.problem.objectives.bending import LEAST, farthest
from pneumorph.problem.objectives.table import ObjectiveTable, RotationVector, unchanged
from pneumorph.problem.table import Example


class MatchSections(ObjectiveTable):
    """Objective: equidistant sections take these orientations, given as rotation vectors from the base upwards."""

    error_words: ClassVar[Mapping[str, str]] = {"orientation_rad": "error of the sections"}

    kind: Literal["match_sections"]
    """The kind of objective."""
    rotations: Annotated[tuple[RotationVector, ...], Example('e.g. rotations = [["0 deg", "10 deg", "0 deg"], …]')] = (
        Field(min_length=2, max_length=100)
    )
    """Rotation vector of each section relative to the base."""

    @property
    def section_count(self) -> tuple[str, int]:
        """See `ObjectiveTable.section_count`."""
        return "rotations", len(self.rotations)

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `ObjectiveTable.keeps`."""
        return unchanged(self.rotations, axial)

    def bends(self, length: float) -> np.ndarray | None:
        """See `ObjectiveTable.bends`."""
        return farthest(np.array(self.rotations)[:, :2], LEAST)
