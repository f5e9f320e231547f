"""What the tables of all kinds of objectives have in common."""

from collections.abc import Iterator, Mapping, Sequence
from typing import Annotated, Any, ClassVar, NamedTuple

import numpy as np
from pydantic import Field, Strict

from pneumorph import units
from pneumorph.problem.components import MOTIONS
from pneumorph.problem.objectives.words import UNITS, Amount, Result
from pneumorph.problem.table import InvalidKey, Quantity, Table

Length = Annotated[float, Quantity(units.LENGTH)]
Angle = Annotated[float, Quantity(units.ANGLE)]
Weight = Annotated[float, Strict(), Field(ge=0)]
Position = tuple[Length, Length, Length]
RotationVector = tuple[Angle, Angle, Angle]
Fault = tuple[str, str]


class Asked(NamedTuple):
    """A motion that an objective asks for: the key, and how far in mm or rad, ±1 for as far as possible."""

    key: str
    value: float


class Known(NamedTuple):
    """What a task has that objectives are about: names of chambers, obstacles and free ones, whether a plate, the
    chambers whose pressures are designed, motions that are held, and whether pressures are found with the state."""

    chambers: Sequence[str]
    obstacles: Sequence[str]
    free: Sequence[str]
    plate: bool
    designed: Sequence[str] = ()
    held: Sequence[str] = ()
    enclosed: bool = False


class ObjectiveTable(Table):
    """What an objective says beside its keys; each kind overrides what is not as here."""

    curve: ClassVar[str] = "error"
    """What its curve over the designs shows, in a word."""

    error_words: ClassVar[Mapping[str, str]] = {
        "position_mm": "distance from the target",
        "orientation_rad": "angle from the target",
    }
    """Words for the errors that it reports, in the order in which they are shown."""

    @property
    def aimed(self) -> bool:
        """Whether there is a target, the distance from which is reported."""
        return True

    @property
    def tip_motions(self) -> dict[str, float]:
        """Which of `MOTIONS` it is about, with the sign in which each is reported; none if it is about others too."""
        return {}

    @property
    def quantities(self) -> dict[str, float]:
        """Which motions of the tip, and forces where it is held, it is about, with their signs; see `tip_motions`."""
        return self.tip_motions

    def motions_of(self, kind: str) -> dict[str, float]:
        """Those of `tip_motions` that are of a kind, "length" or "angle"."""
        chosen = MOTIONS[:3] if kind == "length" else MOTIONS[3:]
        return {name: sign for name, sign in self.tip_motions.items() if name in chosen}

    @property
    def section_count(self) -> tuple[str, int]:
        """The key that sets how many sections of the body it needs, and their number."""
        return "kind", 0

    @property
    def beyond_motion(self) -> bool:
        """Whether it is about something other than motions and what is touched, or leaves the motion to limits."""
        return False

    @property
    def asked_motions(self) -> dict[str, Asked]:
        """Those of `MOTIONS` that must not be zero."""
        return {}

    @property
    def touched(self) -> str | None:
        """The obstacle that the starting design has to touch, or nothing says which way to go."""
        return None

    def keeps(self, polar: Sequence[float], axial: Sequence[float]) -> bool:
        """Whether a symmetry keeps the objective, which is solved on the whole body otherwise.

        The signs (3,) are those that the symmetry gives the components of vectors, and of rotation vectors.
        """
        return False

    def bends(self, length: float) -> np.ndarray | None:
        """The axis (2,) across z about which it bends a body of some length (mm).

        None if it does not say, zero if it is a motion that bends nothing.
        """
        return None

    def achieved(self, result: Result) -> Amount:
        """The amount that it is about, from a result; the first of its errors, if it is no other."""
        return self.errors(result.errors)[0]

    def errors(self, values: Mapping[str, float]) -> list[Amount]:
        """Its distances from the target."""
        units = {name: UNITS[name.rpartition("_")[2]] for name in values}
        return [
            Amount(units[name][1] * values[name], units[name][0], word)
            for name, word in self.error_words.items()
            if name in values
        ]

    def inconsistencies(self, known: Known) -> Iterator[Fault]:
        """Key and reason of what does not fit a problem that has these things."""
        return iter(())


def unchanged(vectors: Any, signs: Sequence[float]) -> bool:
    """Whether vectors (…, 3) are unchanged by these changes of their components' signs."""
    return np.allclose(np.asarray(vectors)[..., np.asarray(signs) < 0], 0.0, atol=1e-12)


def given_motions(asked: ObjectiveTable, motions: Sequence[str]) -> dict[str, float]:
    """The motions that a table gives, in their order."""
    values = {motion: getattr(asked, motion) for motion in motions}
    return {motion: value for motion, value in values.items() if value is not None}


def require_motion(
    targets: dict[str, float], weights: tuple[float, float], lengths: Sequence[str], example: str
) -> None:
    """Refuse a table without a motion, or without one that has a weight.

    Parameters
    ----------
    targets : dict of float
        The motions that are given.
    weights : (2,)
        `position_weight` of the motions in `lengths`, and `rotation_weight` of the others.
    lengths : sequence of str
        The motions that are lengths.
    example : str
        A motion as it could be given, such as `z = "5 mm"`.

    Raises
    ------
    InvalidKey
        If there is none.
    """
    if not targets:
        raise InvalidKey(
            example.split()[0], f"is missing, and so is every other motion; give at least one, e.g. {example}"
        )
    if not any(weights[0 if motion in lengths else 1] > 0 for motion in targets):
        weight = "rotation_weight" if weights[1] == 0 else "position_weight"
        raise InvalidKey(weight, "leaves no motion with a weight; make it positive")


def unknown_obstacle(name: str, obstacles: Sequence[str]) -> Iterator[Fault]:
    """The fault of an objective whose obstacle is not there."""
    if name not in obstacles:
        known = f"the obstacles are {', '.join(obstacles)}" if obstacles else "add a table [[obstacle]]"
        yield "obstacle", f'there is no obstacle "{name}"; {known}'
