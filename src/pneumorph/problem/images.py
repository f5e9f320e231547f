"""Images of chambers under the symmetry of a body: where they are, which chamber each is, copies around the axis."""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.problem.symmetry import operations

if TYPE_CHECKING:
    from collections.abc import Sequence

    from pneumorph.problem.models import ChamberSpec, Symmetry

WITHIN = 0.01
"""Chambers nearer than this (mm) to the image of another are moved to it: files have rounded numbers."""

_EXACT = 1e-9  # mm; nearer ones stay as they are


def place(chamber: ChamberSpec) -> NDArray[np.float64]:
    """Centre, span and radius (5,) of a chamber, mm."""
    return np.array([*chamber.center, *chamber.span, chamber.radius])


def placed(at: NDArray[np.float64], matrix: NDArray[np.float64], length: float) -> NDArray[np.float64]:
    """Centre, span and radius (5,) of the image of such a place under an operation about the body's centre."""
    x, y, _ = matrix @ [*at[:2], 0.0]
    span = sorted(length / 2.0 + matrix[2, 2] * (at[2:4] - length / 2.0))
    return np.array([x, y, *span, at[4]])


def image(
    chambers: Sequence[ChamberSpec], index: int, matrix: NDArray[np.float64], length: float, within: float = 1e-6
) -> int | None:
    """Index of the chamber that is the image of the given one; None if there is no such chamber."""
    wanted = placed(place(chambers[index]), matrix, length)
    places = np.array([(*other.center, *other.span, other.radius) for other in chambers])
    near = np.flatnonzero(np.abs(places - wanted).max(axis=1) <= within)
    return next((int(number) for number in near if chambers[int(number)].ends == chambers[index].ends), None)


def snapped(chambers: tuple[ChamberSpec, ...], symmetry: Symmetry, length: float) -> tuple[ChamberSpec, ...]:
    """Chambers moved to the mean of all places that their images within `WITHIN` ask for; others are left alone."""
    group = operations(symmetry)
    moved = list(chambers)
    for index, chamber in enumerate(chambers):
        to = [image(chambers, index, matrix, length, WITHIN) for matrix in group]
        near = [(matrix, number) for matrix, number in zip(group, to, strict=True) if number is not None]
        if len(near) < len(group):
            continue
        # The inverse of an operation is its transpose.
        asked = [placed(place(chambers[number]), matrix.T, length) for matrix, number in near]
        if np.abs(asked - place(chamber)).max() > _EXACT:
            x, y, start, end, radius = (float(part) for part in np.mean(asked, axis=0))
            moved[index] = chamber.model_copy(update={"center": (x, y), "span": (start, end), "radius": radius})
    return tuple(moved)


def copies(chamber: ChamberSpec) -> list[ChamberSpec]:
    """A chamber and its copies around the axis, numbered from 1; the chamber itself if it is alone."""
    if chamber.copies == 1:
        return [chamber]
    (x, y), angles = chamber.center, 2.0 * math.pi * np.arange(chamber.copies) / chamber.copies
    return [
        chamber.model_copy(
            update={
                "name": f"{chamber.name}{number}",
                "center": (float(x * math.cos(a) - y * math.sin(a)), float(x * math.sin(a) + y * math.cos(a))),
                "copies": 1,
            }
        )
        for number, a in enumerate(angles, 1)
    ]
