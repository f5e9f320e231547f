"""The symmetry group of a body as matrices about its centre, (0, 0, length/2)."""

from __future__ import annotations

from fractions import Fraction
from math import lcm
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from pneumorph.problem.models import Symmetry

MIRRORS = {"xz": (1.0, -1.0, 1.0), "yz": (-1.0, 1.0, 1.0), "xy": (1.0, 1.0, -1.0)}
"""Signs that reflection in each plane gives the components of a vector."""

NORMALS = {"xz": 1, "yz": 0, "xy": 2}
"""Index of the component normal to each plane."""

Part = tuple[str, ...]
"""What of a body is solved: between the mirror planes "xz" and "yz", in this order, or a sector, see `sector`; nothing
for the whole body."""

MOST_TURNS = 24
"""The largest order of a rotation, and number of sectors."""

HALF_TURNS = {"x": (1.0, -1.0, -1.0), "y": (-1.0, 1.0, -1.0)}


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


def sector(turns: int) -> str:
    """The name of a sector, one of a number of `turns`: between two cuts, the second the image of the first."""
    return f"sector {turns}"


def turns_of(part: Part) -> int:
    """The number of sectors in the whole body; 1 where the part is none."""
    return next((int(name.removeprefix("sector ")) for name in part if name.startswith("sector ")), 1)


def beginning_of(middles: NDArray[np.float64], turns: int) -> float:
    """Where a sector begins, in turns about z: far from the middles (n, 2) of all chambers beside the axis."""
    if not len(middles):
        return 0.0
    angles = np.sort(np.arctan2(middles[:, 1], middles[:, 0]) / (2.0 * np.pi) % (1.0 / turns))
    gaps = np.diff(angles, append=angles[0] + 1.0 / turns)
    return float((angles + gaps / 2.0)[gaps.argmax()] % (1.0 / turns))


def turned(turns: int) -> NDArray[np.float64]:
    """Rotations (turns, 3, 3) about z by multiples of a `turns`-th of a full one, the identity first."""
    angle = 2.0 * np.pi * np.arange(turns) / turns
    cosine, sine = np.cos(angle), np.sin(angle)
    # Right angles are exact.
    cosine, sine = (np.where(np.abs(part) < 1e-15, 0.0, part) for part in (cosine, sine))
    matrices = np.tile(np.eye(3), (turns, 1, 1))
    matrices[:, :2, :2] = np.moveaxis(np.array([[cosine, -sine], [sine, cosine]]), 2, 0)
    return matrices


def onwards(turns: int) -> NDArray[np.float64]:
    """The rotation (3, 3) about z from a sector to the next; the identity where there is only one."""
    return turned(turns)[1 % turns]


def images_of(part: Part) -> NDArray[np.float64]:
    """The operations (k, 3, 3) that map a part to all of the whole body, the identity first."""
    images = turned(turns_of(part))
    for plane in part:
        if plane in MIRRORS:
            images = np.concatenate([images, np.diag(MIRRORS[plane]) @ images])
    return images


def even_of(part: Part) -> NDArray[np.float64]:
    """Ones (3,), with 0 for components of vectors that cancel over the whole body."""
    return np.where(np.diagonal(images_of(part).mean(axis=0)) > 0.5, 1.0, 0.0)


def odd_of(part: Part) -> NDArray[np.bool_]:
    """Which components (6,) of a motion of the plate, translation and rotation vector, the symmetry forbids."""
    images = images_of(part)
    # A rotation vector is axial: an improper operation reverses the components that it keeps of ordinary vectors.
    axial = np.linalg.det(images)[:, None, None] * images
    kept = [np.diagonal(each.mean(axis=0)) for each in (images, axial)]
    return np.concatenate(kept) < 0.5
