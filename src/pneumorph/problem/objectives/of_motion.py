"""What objectives about one motion of the tip have in common, in one direction of it."""

from collections.abc import Sequence
from typing import Annotated, Any, Literal

from pydantic import BeforeValidator

from pneumorph.errors import short
from pneumorph.problem.components import MOTION_OF, MOTIONS
from pneumorph.problem.objectives.table import ObjectiveTable
from pneumorph.problem.table import Example


def _motion(name: Any) -> Any:
    """The name of a motion, which may be given by the name of its spring."""
    if not isinstance(name, str):
        return name
    sign, component = (name[0], name[1:]) if name[:1] in ("+", "-") else ("", name)
    motion = MOTION_OF.get(component, component)
    if motion not in MOTIONS:
        raise ValueError(
            f'"{short(name)}" is not a known value; use {", ".join(MOTIONS[:-1])} or {MOTIONS[-1]}, '
            "with a minus sign for the opposite direction"
        )
    return sign + motion


class OfMotion(ObjectiveTable):
    """An objective about a motion of the tip along or about an axis; a minus sign reverses the direction."""

    kind: str
    """The kind of objective."""
    motion: Annotated[Literal[
        "shift_x", "shift_y", "extension", "bending_x", "bending_y", "twist",
        "+shift_x", "+shift_y", "+extension", "+bending_x", "+bending_y", "+twist",
        "-shift_x", "-shift_y", "-extension", "-bending_x", "-bending_y", "-twist",
    ], BeforeValidator(_motion), Example('e.g. motion = "extension"')]  # fmt: skip
    """The motion of the tip; a minus sign reverses the direction."""

    @property
    def sign(self) -> float:
        """-1.0 for a motion with a minus sign, otherwise 1.0."""
        return -1.0 if self.motion.startswith("-") else 1.0

    @property
    def component(self) -> str:
        """The motion without its sign."""
        return self.motion.lstrip("+-")

    @property
    def aimed(self) -> bool:
        """False: there is no target."""
        return False

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """See `ObjectiveTable.keeps`."""
        return (*polar, *axial)[MOTIONS.index(self.component)] > 0
