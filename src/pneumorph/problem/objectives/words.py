"""What a design achieves in a task, as an amount with its unit and a word for it."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import NamedTuple, Protocol

import numpy as np

from pneumorph.problem.components import MOTIONS

MOTION_WORDS: Mapping[str, str] = dict(
    zip(
        MOTIONS,
        ("shift along x", "shift along y", "extension", "bending about x", "bending about y", "twist"),
        strict=True,
    )
)
"""Motions of the tip in words, along and about x, y, z."""

OPPOSITE_WORDS: Mapping[str, str] = dict(
    zip(
        MOTIONS,
        ("shift along −x", "shift along −y", "shortening", "bending about −x", "bending about −y", "twist clockwise"),
        strict=True,
    )
)
"""The same of their opposites."""

UNITS = {"mm": ("mm", 1.0), "rad": ("°", 180.0 / np.pi), "N": ("N", 1.0), "mm2": ("mm²", 1.0)}
"""The unit in which users read a value, and its size in that, by the end of the value's name."""


class Amount(NamedTuple):
    """A value with its unit ("mm", "°", "N", "N/mm", "g", … or ""), the word for it, and its target in that unit, if
    any."""

    value: float
    unit: str
    word: str
    target: float | None = None

    def __str__(self) -> str:
        if not self.unit:
            return f"{self.value:.4g}"
        if self.unit == "N":
            return f"{self.value:.3g} N"
        if self.unit in ("N/mm", "N·mm", "N·mm/rad"):
            return f"{self.value:.4g} {self.unit}" if abs(self.value) < 1e4 else f"{self.value:.0f} {self.unit}"
        # Rounded before it is written, so that no -0.00 is shown.
        return f"{round(self.value, 2) + 0.0:.2f}{'' if self.unit == '°' else ' '}{self.unit}"

    @property
    def beside_target(self) -> str:
        """The value, and its target if it has one: "59.87° (target 60°)"."""
        return str(self) if self.target is None else f"{self} (target {self.target_words})"

    def with_error(self, fine: Amount) -> str:
        """The value and how far it is from that on a fine mesh: "59.87 ± 1.2° (mesh; target 60°)".

        Of a motion that is held it is the value alone.
        """
        if fine.value == self.value:
            return self.beside_target
        number, gap = str(self).removesuffix(self.unit).rstrip(), "" if self.unit in ("°", "") else " "
        told = "mesh" if self.target is None else f"mesh; target {self.target_words}"
        return f"{number} ± {abs(fine.value - self.value):.2g}{gap}{self.unit} ({told})"

    @property
    def target_words(self) -> str:
        """The target with its unit, as a user may have written it."""
        return f"{self.target:.6g}{'' if self.unit in ('°', '') else ' '}{self.unit}"


class Moved(Protocol):
    """A state of the tip: its translation in mm, and its rotation vector."""

    @property
    def translation(self) -> Sequence[float]: ...

    @property
    def rotation(self) -> Sequence[float]: ...


class Result(Moved, Protocol):
    """What words need to know of a task's result; see `TaskResult`."""

    @property
    def objective(self) -> float: ...

    @property
    def errors(self) -> Mapping[str, float]: ...

    @property
    def contact(self) -> Mapping[str, Sequence[float]]: ...

    @property
    def contact_normal(self) -> Mapping[str, float]: ...

    @property
    def contact_area(self) -> Mapping[str, float]: ...


def motion_word(name: str, sign: float) -> str:
    """The words for a motion of the tip, one of `MOTIONS`, or its opposite."""
    return (OPPOSITE_WORDS if sign < 0 else MOTION_WORDS)[name]


def motion_amount(name: str, sign: float, result: Moved) -> Amount:
    """A motion of the tip, one of `MOTIONS`, or its opposite."""
    word, number = motion_word(name, sign), MOTIONS.index(name)
    if number < 3:
        return Amount(sign * result.translation[number], "mm", word)
    return Amount(sign * float(np.degrees(result.rotation[number - 3])), "°", word)
