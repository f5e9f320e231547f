"""The shape of a curve."""

from collections.abc import Mapping, Sequence
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import Field, Strict, model_validator

from pneumorph.problem.objectives.bending import LEAST, farthest
from pneumorph.problem.objectives.table import ObjectiveTable, Position, Weight, unchanged
from pneumorph.problem.objectives.words import Amount, Result
from pneumorph.problem.table import Example, InvalidKey


class MatchCurve(ObjectiveTable):
    """Objective: the body takes the shape of a curve, a clamped B-spline of the given degree.

    Equidistant sections are compared with the curve by the rotation of each relative to the previous one (squared
    angles, rad²) and, with a position_weight (1/mm²), by their positions.
    """

    error_words: ClassVar[Mapping[str, str]] = {
        "position_mm": "distance from the curve",
        "orientation_rad": "error of the sections",
    }

    kind: Literal["match_curve"]
    """The kind of objective."""
    control_points: Annotated[
        tuple[Position, ...], Example('e.g. control_points = [["0 mm", "0 mm", "0 mm"], ["0 mm", "0 mm", "80 mm"]]')
    ] = Field(min_length=2, max_length=1000)
    """Control points of the curve, from the centre of the base."""
    degree: Annotated[int, Strict(), Field(ge=1, le=5)] = 3
    """Degree of the B-spline."""
    sections: Annotated[int, Strict(), Field(ge=2, le=100)] = 10
    """Number of sections that are compared."""
    orientation_weight: Weight = 1.0
    """Weight of the squared angles, 1/rad²."""
    position_weight: Weight = 0.0
    """Weight of the squared distances, 1/mm²."""

    @model_validator(mode="after")
    def _is_a_curve(self) -> "MatchCurve":
        if len(self.control_points) <= self.degree:
            raise InvalidKey(
                "control_points",
                f"are too few for degree {self.degree}; give at least {self.degree + 1} or lower the degree",
            )
        steps = np.diff(np.array(self.control_points), axis=0)
        if not np.linalg.norm(steps[0]) > 0 or not np.linalg.norm(steps, axis=1).sum() > 1e-6:
            raise InvalidKey(
                "control_points", "the first two coincide, so the curve has no direction there; move one of them"
            )
        if steps[0, 2] <= 0.5 * np.linalg.norm(steps[0]):
            raise InvalidKey(
                "control_points",
                "the curve leaves the base at more than 60° to the body's axis z; let it start along +z",
            )
        if self.orientation_weight == 0 and self.position_weight == 0:
            raise InvalidKey("position_weight", "is zero, and so is orientation_weight; make one of them positive")
        return self

    @property
    def section_count(self) -> tuple[str, int]:
        """See `ObjectiveTable.section_count`."""
        return "sections", self.sections

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `ObjectiveTable.keeps`; a curve in the mirror plane is its own image."""
        return unchanged(self.control_points, polar)

    def bends(self, length: float) -> np.ndarray | None:
        """See `ObjectiveTable.bends`."""
        return farthest(np.array(self.control_points)[:, :2] @ np.array([[0.0, 1.0], [-1.0, 0.0]]), LEAST * length)

    def achieved(self, result: Result) -> Amount:
        """Of a shape it is the orientation that counts, unless it has no weight."""
        return self.errors(result.errors)[-1 if self.orientation_weight > 0.0 else 0]
