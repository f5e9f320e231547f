"""The symmetry group of a body as matrices about its centre, (0, 0, length/2)."""

from __future__ import annotations

from collections.abc import Collection
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


def turned(turns: int) -> NDArray[np.float64]:
    """Rotations (turns, 3, 3) about z by multiples of a `turns`-th of a full one, the identity first."""
    angle = 2.0 * np.pi * np.arange(turns) / turns
    cosine, sine = np.cos(angle), np.sin(angle)
    # Right angles are exact.
    cosine, sine = (np.where(np.abs(part) < 1e-15, 0.0, part) for part in (cosine, sine))
    matrices = np.tile(np.eye(3), (turns, 1, 1))
    matrices[:, :2, :2] = np.moveaxis(np.array([[cosine, -sine], [sine, cosine]]), 2, 0)
    return matrices
