"""The symmetry group of a body as matrices about its centre, (0, 0, length/2)."""

from __future__ import annotations

from collections.abc import Collection
from fractions import Fraction
from math import lcm
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

MIRRORS = {"xz": (1.0, -1.0, 1.0), "yz": (-1.0, 1.0, 1.0), "xy": (1.0, 1.0, -1.0)}
"""Signs that reflection in each plane gives the components of a vector."""

NORMALS = {"xz": 1, "yz": 0, "xy": 2}
"""Index of the component normal to each plane."""

HALF_TURNS = {"x": (1.0, -1.0, -1.0), "y": (-1.0, 1.0, -1.0)}


class Symmetry(Protocol):
    """What generates the operations of a body: mirror planes of `MIRRORS`, the order of a rotation about z, whether a
    point reflection and about which axis ("x", "y", or None) half a turn maps it to itself."""

    @property
    def mirror(self) -> Collection[str]: ...
    @property
    def rotation(self) -> int: ...
    @property
    def point(self) -> bool: ...
    @property
    def half_turn(self) -> str | None: ...


def operations(symmetry: Symmetry) -> list[NDArray[np.float64]]:
    """All orthogonal matrices (3, 3) that the symmetries generate, the identity first."""
    generators = [np.diag(MIRRORS[plane]) for plane in symmetry.mirror]
    if symmetry.rotation > 1:
        angle = 2.0 * np.pi / symmetry.rotation
        cosine, sine = np.cos(angle), np.sin(angle)
        generators.append(np.array([[cosine, -sine, 0.0], [sine, cosine, 0.0], [0.0, 0.0, 1.0]]))
    if symmetry.point:
        generators.append(-np.eye(3))
    if symmetry.half_turn:
        generators.append(np.diag(HALF_TURNS[symmetry.half_turn]))
    group = [np.eye(3)]
    for known in group:
        for generator in generators:
            product = generator @ known
            if not any(np.allclose(product, other, atol=1e-9) for other in group):
                group.append(product)
    return group


def columns_multiple(symmetry: Symmetry) -> int:
    """The number of control points around a tube must be a multiple of this for their images to be control points."""
    turns = [np.arctan2(matrix[1, 0], matrix[0, 0]) / (2.0 * np.pi) for matrix in operations(symmetry)]
    return lcm(*(Fraction(turn).limit_denominator(100).denominator for turn in turns))


def columns(radius: float, density: float, multiple: int = 1) -> int:
    """Number of control points around a tube: the multiple of `multiple` nearest to the density (1/mm), at least 8."""
    least = -(-8 // multiple)
    return multiple * max(least, round(density * 2.0 * np.pi * radius / multiple))


def turned(turns: int) -> NDArray[np.float64]:
    """Rotations (turns, 3, 3) about z by multiples of a `turns`-th of a full one, the identity first."""
    angle = 2.0 * np.pi * np.arange(turns) / turns
    cosine, sine = np.cos(angle), np.sin(angle)
    # Right angles are exact.
    cosine, sine = (np.where(np.abs(part) < 1e-15, 0.0, part) for part in (cosine, sine))
    matrices = np.tile(np.eye(3), (turns, 1, 1))
    matrices[:, :2, :2] = np.moveaxis(np.array([[cosine, -sine], [sine, cosine]]), 2, 0)
    return matrices
