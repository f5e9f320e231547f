"""Where the tip of a body can go: poses all over the domain of its fast model, and what can be said of them."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from pneumorph.surrogate.reader import Model

FLAT = 1e-3
"""Extent of a reachable set, over its largest one, below which it has no volume."""


@dataclass(frozen=True, eq=False)
class Workspace:
    """Poses of the tip at n pressures, uniform in the domain.

    Attributes
    ----------
    chambers : names.
    pressures : (n, C) MPa.
    motions : (n, 6) mm, rad.
    finest : (n,) mm/MPa
        Dexterity: by how much the tip moves for 1 MPa in the direction in which it moves least, of those in which it
        can be moved; the smallest singular value of the derivatives of its translation.
    evenness : (n,)
        That over the largest one: 1 where the tip moves as readily all ways that it can.
    soft : (n, 3, 3) mm/N
        Compliance of the tip against forces.
    stiffness : (n, 3) N/mm
        Against forces along its principal axes, softest first.
    swept : float or None
        Length (mm), area (mm²) or volume (mm³) of the set of places, with one, two or three chambers; places that are
        reached twice count twice. None with more.
    hull : float
        Volume of the convex hull of the places, mm³; 0 where they lie in a plane.
    """

    chambers: tuple[str, ...]
    pressures: np.ndarray
    motions: np.ndarray
    finest: np.ndarray
    evenness: np.ndarray
    soft: np.ndarray
    stiffness: np.ndarray
    swept: float | None
    hull: float


def workspace(model: Model, bounds: np.ndarray, count: int) -> Workspace | None:
    """The workspace within bounds (C, 2) in MPa; None where none of them is in the domain.

    Parameters
    ----------
    model : Model
    bounds : (C, 2)
        Within those of the model.
    count : int
        Number of pressures, of which those outside the domain are left out.
    """
    rng, chambers = np.random.default_rng(0), len(model.chambers)
    pressures = bounds[:, 0] + rng.random((count, chambers)) * np.ptp(bounds, axis=1)
    inputs = np.hstack([pressures, np.tile([*model.usual.values()], (count, 1))])
    held = model.all_inside(inputs)
    pressures, inputs = pressures[held], inputs[held]
    if not len(pressures):
        return None
    motions = model.values(inputs)[:, :6]
    slopes = model.jacobians(inputs)[:, :3, :chambers]
    sizes = np.linalg.svd(slopes, compute_uv=False)
    # Of n uniform pressures each stands for this part of the domain.
    part = float(np.prod(np.ptp(bounds, axis=1))) / count
    swept = None if chambers > 3 else part * float(np.prod(sizes, axis=1).sum())
    soft = model.compliances(inputs)[:, :3, :3]
    with np.errstate(divide="ignore"):
        stiffness = 1.0 / np.maximum(np.linalg.eigvalsh(soft), 0.0)[:, ::-1]
    evenness = sizes[:, -1] / np.maximum(sizes[:, 0], 1e-300)
    hull = _hull(motions[:, :3])
    return Workspace(model.chambers, pressures, motions, sizes[:, -1], evenness, soft, stiffness, swept, hull)


def _hull(points: np.ndarray) -> float:
    """The volume of the convex hull of points (n, 3), mm³; 0 where they are almost in a plane."""
    extents = np.linalg.svd(points - points.mean(axis=0), compute_uv=False)
    if len(points) < 5 or extents[-1] < FLAT * extents[0]:
        return 0.0
    try:
        return float(ConvexHull(points).volume)
    except QhullError:
        return 0.0
