"""The stiffness of the tip against a motion."""

from collections.abc import Iterator, Sequence
from typing import Annotated, ClassVar, Literal

from pydantic import BeforeValidator

from pneumorph.problem.components import MOTION_OF, MOTIONS, is_turn
from pneumorph.problem.objectives.table import Fault, Known, ObjectiveTable
from pneumorph.problem.objectives.words import MOTION_WORDS, Amount, Result
from pneumorph.problem.table import Example

TipMotion = Annotated[
    Literal["shift_x", "shift_y", "extension", "bending_x", "bending_y", "twist"],
    BeforeValidator(lambda name: MOTION_OF.get(name, name) if isinstance(name, str) else name),
]
"""A motion of the tip, which may be given by the name of its spring."""


class StiffnessOfTip(ObjectiveTable):
    """Objective: the stiffest or the softest tip against a motion, in the state of the task.

    The stiffness is the force per motion, or the moment per rotation, of a small further load that does work on this
    motion alone; all other motions of the tip are free.
    """

    curve: ClassVar[str] = "stiffness"

    kind: Literal["stiffness"]
    """The kind of objective."""
    motion: Annotated[TipMotion, Example('e.g. motion = "shift_x"')]
    """The motion of the tip: along x, y or z, or a component of its rotation vector."""
    tip: Literal["stiff", "soft"] = "stiff"
    """Whether the tip is to be as stiff or as soft as possible."""

    @property
    def sign(self) -> float:
        """Of the stiffness in what is minimised."""
        return 1.0 if self.tip == "soft" else -1.0

    @property
    def aimed(self) -> bool:
        """False: there is no target."""
        return False

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `ObjectiveTable.keeps`."""
        return (*polar, *axial)[MOTIONS.index(self.motion)] > 0

    @property
    def beyond_motion(self) -> bool:
        """True."""
        return True

    def inconsistencies(self, known: Known) -> Iterator[Fault]:
        """See `ObjectiveTable.inconsistencies`."""
        if self.motion in known.held:
            yield "motion", f"{self.motion} is held, so nothing moves; choose another motion, or leave hold out"
        if known.enclosed:
            yield "kind", "is not possible with chambers that are sealed or filled to a volume; give pressures"

    def achieved(self, result: Result) -> Amount:
        """The stiffness."""
        unit = "N·mm/rad" if is_turn(self.motion) else "N/mm"
        return Amount(self.sign * result.objective, unit, f"stiffness against {MOTION_WORDS[self.motion]}")
