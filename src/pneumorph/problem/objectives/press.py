"""A force on an obstacle."""

from collections.abc import Iterator, Mapping
from typing import Annotated, ClassVar, Literal

import numpy as np
from pydantic import model_validator

from pneumorph import units
from pneumorph.problem.directions import Direction
from pneumorph.problem.names import Name
from pneumorph.problem.objectives.table import Fault, Known, ObjectiveTable, unknown_obstacle
from pneumorph.problem.objectives.words import Amount, Result
from pneumorph.problem.table import Example, InvalidKey, Quantity


class Press(ObjectiveTable):
    """Objective: the largest contact force on an obstacle or, with `force`, a force as near as possible to that.

    Without a direction it is the sum of all normal forces, the force of a grip: opposite sides add up. The start must
    touch the obstacle, because the gradient is zero otherwise.
    """

    curve: ClassVar[str] = "contact"
    error_words: ClassVar[Mapping[str, str]] = {"force_N": "from the target force"}

    kind: Literal["press"]
    """The kind of objective."""
    obstacle: Annotated[Name, Example('the name of an obstacle, e.g. obstacle = "cylinder"')]
    """Name of the obstacle."""
    direction: Annotated[Direction, Example("e.g. direction = [1, 0, 0]")] | None = None
    """Direction of the component of the force, of any length; by default all normal forces count."""
    force: Annotated[float, Quantity(units.FORCE)] | None = None
    """Target for the force; by default as large as possible."""

    @model_validator(mode="after")
    def _pushes(self) -> "Press":
        if self.direction is None and self.force is not None and self.force <= 0:
            raise InvalidKey("force", 'is not above zero, as normal forces are; write e.g. force = "2 N"')
        return self

    @property
    def aimed(self) -> bool:
        """See `ObjectiveTable.aimed`."""
        return self.force is not None

    @property
    def touched(self) -> str:
        """See `ObjectiveTable.touched`."""
        return self.obstacle

    def inconsistencies(self, known: Known) -> Iterator[Fault]:
        """See `ObjectiveTable.inconsistencies`."""
        return unknown_obstacle(self.obstacle, known.obstacles)

    def achieved(self, result: Result) -> Amount:
        """The force."""
        if self.direction is None:
            done = Amount(result.contact_normal[self.obstacle], "N", f"normal force on {self.obstacle}")
        else:
            value = float(np.dot(result.contact[self.obstacle], self.direction))
            done = Amount(value, "N", f"force on {self.obstacle}")
        return done._replace(target=self.force)
