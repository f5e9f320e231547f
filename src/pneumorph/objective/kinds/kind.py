"""What there is to know of a kind of objective, and where it aims in plain points."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, NamedTuple

import numpy as np

from pneumorph.objective.objective import Objective


class Scope(NamedTuple):
    """What of a problem objectives depend on.

    Attributes
    ----------
    key : str
        Their key in the file.
    length : float
        Of the body, mm.
    tip : (3,) array
        From the centre of the base to that of the tip, mm.
    chambers, obstacles : tuple of str
        Names.
    designed : {chamber: float}
        Of the pressures that are designed in the task, 1.0, or -1.0 for a vacuum.
    """

    key: str
    length: float
    tip: np.ndarray
    chambers: tuple[str, ...] = ()
    obstacles: tuple[str, ...] = ()
    designed: Mapping[str, float] = {}


@dataclass(frozen=True, eq=False)
class Target:
    """Where the body should be, in mm from the centre of the base.

    Attributes
    ----------
    line, sections : (n, 3), (S, 3)
        A centre line, and the centres of sections on it; empty without.
    place : (3,) or None
        Of the tip's centre.
    axis : (3,) or None
        The unit vector along which the plate should face.
    """

    line: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    sections: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    place: np.ndarray | None = None
    axis: np.ndarray | None = None


def nowhere(asked: Any, length: float, motion: np.ndarray | None) -> None:
    """The target of objectives that have none in space."""
    return None


class Kind(NamedTuple):
    """The functions of a kind: the objective that its table asks for, and its target on a body of some length (mm).

    The target of what leaves something free is filled up with the motion (6,) of the tip, if that is known.
    """

    build: Callable[[Any, Scope], Objective]
    target: Callable[[Any, float, np.ndarray | None], Target | None] = nowhere
