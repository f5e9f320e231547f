"""Images of tubes along z under the symmetry of a body: where they are, and which tube each is."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pneumorph.symmetry.operations import Symmetry, operations

WITHIN = 0.01
"""Chambers nearer than this (mm) to the image of another are moved to it: files have rounded numbers."""

_EXACT = 1e-9  # mm; nearer ones stay as they are


class Chamber(Protocol):
    """A tube along z: the centre of its cross-section, from where to where it reaches, its radius.

    `is_image_of` says whether its shape is that of another one's image under an operation, wherever that is.
    """

    @property
    def center(self) -> tuple[float, float]: ...
    @property
    def span(self) -> tuple[float, float]: ...
    @property
    def radius(self) -> float: ...
    def is_image_of(self, other: Any, matrix: NDArray[np.float64]) -> bool: ...


def place(chamber: Chamber) -> NDArray[np.float64]:
    """Centre, span and radius (5,) of a chamber, mm."""
    return np.array([*chamber.center, *chamber.span, chamber.radius])


def placed(at: NDArray[np.float64], matrix: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    """Centre, span and radius (5,) of the image of such a place under an operation about the body's centre."""
    x, y, _ = matrix @ [*at[:2], 0.0]
    span = sorted(length / 2.0 + matrix[2, 2] * (at[2:4] - length / 2.0))
    return np.array([x, y, *span, at[4]])


def image(
    chambers: Sequence[Chamber], index: int, matrix: NDArray[np.float64], length: float, within: float = 1e-6
) -> int | None:
    """Index of the chamber that is the image of the given one; None if there is no such chamber.

    Parameters
    ----------
    chambers : sequence of Chamber
    index : int
        Of the given one.
    matrix : (3, 3) array
        The operation.
    length : float
        Of the body, mm.
    within : float
        Largest difference of place and radius, mm.
    """
    wanted = placed(place(chambers[index]), matrix, length)
    places = np.array([(*other.center, *other.span, other.radius) for other in chambers])
    near = np.flatnonzero(np.abs(places - wanted).max(axis=1) <= within)
    return next((int(number) for number in near if chambers[int(number)].is_image_of(chambers[index], matrix)), None)


def snapped(chambers: Sequence[Chamber], symmetry: Symmetry, length: float) -> list[NDArray[np.float64]]:
    """Places (5,) of all chambers, each the mean of what its images within `WITHIN` ask for; others have their own."""
    group = operations(symmetry)
    places = []
    for index, chamber in enumerate(chambers):
        own = place(chamber)
        to = [image(chambers, index, matrix, length, WITHIN) for matrix in group]
        # The inverse of an operation is its transpose.
        asked = [
            placed(place(chambers[number]), matrix.T, length)
            for matrix, number in zip(group, to, strict=True)
            if number is not None
        ]
        moves = len(asked) == len(group) and np.abs(asked - own).max() > _EXACT
        places.append(np.mean(asked, axis=0) if moves else own)
    return places
