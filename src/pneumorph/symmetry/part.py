"""What part of a symmetric body is meshed and solved, and the operations that map it to the rest."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from pneumorph.symmetry.operations import MIRRORS, turned

Part = tuple[str, ...]
"""What of a body is solved: between the mirror planes "xz" and "yz", in this order, or a sector, see `sector`; nothing
for the whole body."""

MOST_TURNS = 24
"""The largest order of a rotation, and number of sectors."""


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
