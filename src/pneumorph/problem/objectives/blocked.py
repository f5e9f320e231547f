"""The force of a tip that is held."""

from collections.abc import Iterator
from typing import ClassVar, Literal

from pneumorph.problem.components import PUSH, is_turn
from pneumorph.problem.objectives.of_motion import OfMotion
from pneumorph.problem.objectives.table import Fault, Known
from pneumorph.problem.objectives.words import Amount, Result, motion_word


class Blocked(OfMotion):
    """Objective: the largest force, or moment, with which the tip pushes along a motion in which it is held.

    `hold` of the task, or of [end_effector], has the motion and where it is held: at rest, or at any other value.
    """

    curve: ClassVar[str] = "force"

    kind: Literal["blocked"]  # pyright: ignore[reportIncompatibleVariableOverride]
    """The kind of objective."""

    @property
    def beyond_motion(self) -> bool:
        """True."""
        return True

    @property
    def quantities(self) -> dict[str, float]:
        """See `ObjectiveTable.quantities`."""
        return {PUSH + self.component: self.sign}

    def inconsistencies(self, known: Known) -> Iterator[Fault]:
        """See `ObjectiveTable.inconsistencies`."""
        if self.component not in known.held:
            size = "0 deg" if is_turn(self.component) else "0 mm"
            yield "motion", f'{self.component} is not held; write hold = {{ {self.component} = "{size}" }} in the task'
        if known.enclosed:
            yield "kind", "is not possible with chambers that are sealed or filled to a volume; give pressures"

    def achieved(self, result: Result) -> Amount:
        """The force."""
        turn = is_turn(self.component)
        word = f"{'moment' if turn else 'force'} against {motion_word(self.component, self.sign)}"
        return Amount(-result.objective, "N·mm" if turn else "N", word)
