"""The largest workspace of several tasks."""

from collections.abc import Sequence
from typing import Annotated, ClassVar, Literal

from pydantic import Field, model_validator

from pneumorph.problem.objectives.table import ObjectiveTable
from pneumorph.problem.objectives.words import Amount, Result
from pneumorph.problem.table import Example, InvalidKey

_SIZES = ("length", "area", "volume")


class LargestWorkspace(ObjectiveTable):
    """Objective: the largest length, area or volume that the tip spans with other tasks of the same objective.

    It is the convex hull of the places of the tip in these tasks, seen along the given axes: give every corner that the
    tip is to reach a task with its pressures.
    """

    curve: ClassVar[str] = "workspace"

    kind: Literal["workspace"]
    """The kind of objective."""
    axes: Annotated[
        tuple[Literal["x", "y", "z"], ...],
        Field(min_length=1, max_length=3),
        Example('e.g. axes = ["x", "z"]'),
    ]
    """One axis for the length along it, two for the area in their plane, three for the volume."""

    @model_validator(mode="after")
    def _different(self) -> "LargestWorkspace":
        if len(set(self.axes)) < len(self.axes):
            raise InvalidKey("axes", 'has an axis twice; write e.g. axes = ["x", "z"]')
        return self

    @property
    def aimed(self) -> bool:
        """False: there is no target."""
        return False

    @property
    def beyond_motion(self) -> bool:
        """True."""
        return True

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `ObjectiveTable.keeps`."""
        return all(polar["xyz".index(axis)] > 0 for axis in self.axes)

    def achieved(self, result: Result) -> Amount:
        """Its size."""
        size = len(self.axes) - 1
        return Amount(-result.objective, ("mm", "mm²", "mm³")[size], f"workspace {_SIZES[size]}")
