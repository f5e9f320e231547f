"""An area of contact with an obstacle."""

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

from pneumorph import units
from pneumorph.problem.names import Name
from pneumorph.problem.objectives.table import Fault, Known, ObjectiveTable, unknown_obstacle
from pneumorph.problem.objectives.words import Amount, Result
from pneumorph.problem.table import Example, Quantity


class ContactArea(ObjectiveTable):
    """Objective: the largest contact area with an obstacle or, with `area`, an area as near as possible to that.

    The area is that of the deformed surface. The start must touch the obstacle.
    """

    curve: ClassVar[str] = "contact"
    error_words: ClassVar[Mapping[str, str]] = {"area_mm2": "from the target area"}

    kind: Literal["contact_area"]
    """The kind of objective."""
    obstacle: Annotated[Name, Example('the name of an obstacle, e.g. obstacle = "cylinder"')]
    """Name of the obstacle."""
    area: Annotated[float, Quantity(units.AREA, "positive")] | None = None
    """Target for the area; by default as large as possible."""

    @property
    def aimed(self) -> bool:
        """See `ObjectiveTable.aimed`."""
        return self.area is not None

    @property
    def touched(self) -> str:
        """See `ObjectiveTable.touched`."""
        return self.obstacle

    def inconsistencies(self, known: Known) -> Iterator[Fault]:
        """See `ObjectiveTable.inconsistencies`."""
        return unknown_obstacle(self.obstacle, known.obstacles)

    def achieved(self, result: Result) -> Amount:
        """The area."""
        return Amount(result.contact_area[self.obstacle], "mm²", f"contact with {self.obstacle}", self.area)
