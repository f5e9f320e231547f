"""What bodies are measured by: motions of the tip, what it pushes with where it is held, and volumes of chambers."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from pneumorph.problem.components import PUSH, PUSHES, is_turn
from pneumorph.problem.objectives.words import motion_word
from pneumorph.units import ANGLE, FORCE, LENGTH, MOMENT, VOLUME, Kind

VOLUME_OF, FILLED = "volume_", "filled_"
"""Before the name of a chamber: its volume, and what was filled in, by which it is larger than at rest."""


class Shown(NamedTuple):
    """How users read a quantity: how many of its unit one in the code's is, the unit, and the words."""

    size: float
    unit: str
    word: str

    @property
    def after(self) -> str:
        """The unit as it stands after a number."""
        return self.unit if self.unit == "°" else f" {self.unit}"

    def number(self, value: float) -> str:
        """A value in the code's unit as a number in its own."""
        return f"{self.size * value:{'.2f' if self.unit in ('mm', '°') else '.4g'}}"


def kind_of(quantity: str) -> Kind:
    """What the values of a quantity are."""
    if quantity.startswith((VOLUME_OF, FILLED)):
        return VOLUME
    if quantity in PUSHES:
        return MOMENT if is_turn(quantity.removeprefix(PUSH)) else FORCE
    return ANGLE if is_turn(quantity) else LENGTH


def shown(quantity: str, sign: float = 1.0) -> Shown:
    """How users read a quantity, or its opposite.

    Parameters
    ----------
    quantity : one of `MOTIONS` or `PUSHES`, or `VOLUME_OF` or `FILLED` and the name of a chamber.
    sign : ±1.0
    """
    for before, words in ((VOLUME_OF, "volume of"), (FILLED, "what is filled into")):
        if quantity.startswith(before):
            return Shown(1e-3, "ml", f"{words} {quantity.removeprefix(before)}")
    if quantity in PUSHES:
        motion = quantity.removeprefix(PUSH)
        kind, unit = ("moment", "N·mm") if is_turn(motion) else ("force", "N")
        return Shown(sign, unit, f"{kind} against {motion_word(motion, sign)}")
    size, unit = (float(np.degrees(1.0)), "°") if is_turn(quantity) else (1.0, "mm")
    return Shown(sign * size, unit, motion_word(quantity, sign))
