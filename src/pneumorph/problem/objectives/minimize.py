"""As little as possible of something that a robot needs for its motion."""

from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Literal

from pneumorph.problem.objectives.table import Fault, Known, ObjectiveTable
from pneumorph.problem.objectives.words import Amount, Result
from pneumorph.problem.table import Example

UNIT = {"mass": "g", "air": "ml", "pressure": "kPa", "stretch": ""}
WORDS = {
    "mass": "mass of the rubber",
    "air": "air in the chambers",
    "pressure": "pressure",
    "stretch": "largest stretch",
}


class Minimize(ObjectiveTable):
    """Objective: the least mass, air, pressure or stretch with the least motions of the tasks (`limits.at_least`)."""

    curve: ClassVar[str] = "amount"

    kind: Literal["minimize"]
    """The kind of objective."""
    of: Annotated[Literal["mass", "air", "pressure", "stretch"], Example('e.g. of = "mass"')]
    """The mass of the rubber; the volume of the inflated chambers; the sum of the pressures that are designed in this
    task, of each its amount above or below zero as it is at the start; or the largest stretch of the rubber anywhere,
    by an upper bound that is at most 0.03 above it."""

    @property
    def aimed(self) -> bool:
        """False: there is no target."""
        return False

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `ObjectiveTable.keeps`."""
        return True

    @property
    def beyond_motion(self) -> bool:
        """True: the motion that it needs is a limit."""
        return True

    def inconsistencies(self, known: Known) -> Iterator[Fault]:
        """See `ObjectiveTable.inconsistencies`."""
        if self.of == "pressure" and not known.designed:
            yield "of", 'needs a pressure that is designed, as in pressure = { A = { min = "0 kPa", max = "60 kPa" } }'

    def achieved(self, result: Result) -> Amount:
        """The amount."""
        return Amount(result.objective, UNIT[self.of], WORDS[self.of])
