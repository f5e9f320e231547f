"""How far silicone negatives sag under their weight: the space that is simulated, and what it means for the parts.

The closed mould stands upright and is still empty. Once it is full, the rubber carries most of the weight of silicone
that is about as dense: the sag of the empty mould is an upper bound. Boxes and covers hold a negative, which slides on
them; on the other negative it rests.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import KDTree

from pneumorph.make.checks import Check
from pneumorph.make.silicone.frame import frame_of
from pneumorph.make.silicone.plan import SiliconePlan, Slab, formed, size_of

Array = NDArray[np.float64]
Bools = NDArray[np.bool_]

_CELL = 3.0
"""Edge in mm of a cell across; along z, where everything varies slowly, cells are three times as long."""


@dataclass(frozen=True, eq=False)
class Grid:
    """A negative as cells of a grid, in the coordinates of its mould's frame: across, up and along z.

    Attributes
    ----------
    name : str
        Number of the part and side, as "1-a".
    low, high : (3,) array
        Corners of the grid, mm.
    filled : (n, m, k) bool array
        Cells of silicone.
    fixed : callable
        Which displacement components (n, 3) are zero at points (n, 3).
    """

    name: str
    low: Array
    high: Array
    filled: Bools
    fixed: Callable[[Array], Bools]


@dataclass(frozen=True)
class Sag:
    """What sagging negatives change in a part.

    Attributes
    ----------
    part : int
    largest : float
        Largest displacement of a point of its surface, mm.
    length, wall : float
        Change of its length, and largest change of the thickness of its walls, mm.
    """

    part: int
    largest: float
    length: float
    wall: float

    @property
    def sentence(self) -> str:
        """The sag in words, for the assembly sheet."""
        return (
            f"Under their weight the negatives of part {self.part} move by up to {self.largest:.2g} mm while they are "
            f"empty: the part's length changes by {self.length:+.2g} mm, the thickness of its walls by up to "
            f"{self.wall:.2g} mm."
        )

    def check(self, most: float) -> Check:
        """Whether the displacement is small enough."""
        return Check(f"part-{self.part}", "displacement of its surface by the negatives' sag", self.largest, most, "mm")


def grids(plan: SiliconePlan, slab: Slab) -> dict[str, Grid]:
    """The negatives a and b of a part."""
    frame, size = frame_of(slab, plan), size_of(plan)
    inner = np.stack([frame.across, frame.up, [0.0, 0.0, 1.0]])

    def world(points: Array) -> Array:
        return frame.origin + points @ inner

    def rubber(points: Array) -> Bools:
        """Points of the part, with its chambers."""
        at = world(points)
        z, away = at[:, 2], np.hypot(at[:, 0], at[:, 1])
        body = (z > 0.0) & (z < plan.length) & (plan.samples[0].outside(at) < 0.0)
        along = at @ plan.normal
        flange = (z > plan.bottom) & (z < 0.0) & (away < plan.flange)
        return (body | flange) & (along > slab.low) & (along < slab.high)

    def ridge(points: Array, side: str) -> Bools:
        """Points of the chambers that a negative forms."""
        at = world(points)
        chosen = np.zeros(len(points), bool)
        for number, _ in _surfaces(plan, slab, side):
            if number:
                surface = plan.samples[number]
                low, high = surface.points[:, 2].min(), surface.points[:, 2].max()
                chosen |= (at[:, 2] > low) & (at[:, 2] < high) & (surface.outside(at) > 0.0)
        return chosen

    def grid(side: str) -> Grid:
        sign = 1.0 if side == "a" else -1.0
        deep = plan.deep[0 if side == "a" else 1]
        tall = 0.0
        if side == "b" and not slab.inner:
            tall = max(
                float(frame.of(plan.samples[n].points[own])[:, 1].max()) for n, own in _surfaces(plan, slab, "b")
            )
        ends = sorted((sign * deep, tall))
        low, high = np.array([-size.half, ends[0], size.low]), np.array([size.half, ends[1], size.high])
        counts = np.maximum(np.round((high - low) / [_CELL, _CELL, 3.0 * _CELL]), 2).astype(int)
        if tall:  # a layer of cells begins at the parting plane
            below = max(round(deep / _CELL), 1)
            step = deep / below
            counts[1] = below + max(int(np.ceil(tall / step)), 1)
            high[1] = -deep + step * counts[1]
        axes = [a + (np.arange(n) + 0.5) * (b - a) / n for a, b, n in zip(low, high, counts, strict=True)]
        middles = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
        own = sign * middles[:, 1] > 0.0
        filled = own & ~rubber(middles)
        if slab.inner:
            filled |= own & ridge(middles, side)
        elif side == "b":
            filled = own | ridge(middles, side)

        def fixed(points: Array) -> Bools:
            near = 1e-4
            chosen = np.zeros(points.shape, bool)
            chosen[:, 0] = np.abs(np.abs(points[:, 0]) - size.half) < near
            chosen[:, 1] = np.abs(points[:, 1] - sign * deep) < near
            # It rests on the other negative where there is no rubber between them.
            beside = points + np.array([0.0, -near if side == "b" and slab.inner else near, 0.0])
            chosen[:, 1] |= (np.abs(points[:, 1]) < near) & ~rubber(beside)
            chosen[:, 2] = np.abs(points[:, 2] - size.low) < near
            return chosen

        return Grid(f"{slab.number}-{side}", low, high, filled.reshape(counts), fixed)

    return {side: grid(side) for side in ("a", "b")}


def sag_of(plan: SiliconePlan, slab: Slab, settled: dict[str, tuple[Array, Array]]) -> Sag:
    """What the sag of its negatives changes in a part.

    Parameters
    ----------
    settled : {side: (points, displacements)}
        Of the silicone of negatives a and b, (n, 3) each, in the coordinates of the mould's frame, mm.
    """
    frame = frame_of(slab, plan)
    moves: dict[bool, list[Array]] = {True: [], False: []}
    for side, (nodes, moved) in settled.items():
        for number, own in _surfaces(plan, slab, side):
            points = frame.of(plan.samples[number].points[own])
            near = KDTree(nodes).query(points)[1]
            moves[number == 0].append(np.concatenate([points, moved[near]], axis=1))
    outside, inside = (np.concatenate(moves[key]) for key in (True, False))
    near = KDTree(outside[:, :3]).query(inside[:, :3])[1]
    gap = outside[near] - inside
    away = gap[:, :3] / np.maximum(np.linalg.norm(gap[:, :3], axis=1, keepdims=True), 1e-9)
    return Sag(
        part=slab.number,
        largest=float(np.linalg.norm(np.concatenate([outside, inside])[:, 3:], axis=1).max()),
        length=float(np.polyfit(outside[:, 2], outside[:, 5], 1)[0] * plan.length),
        wall=float(np.abs(np.einsum("nc,nc->n", gap[:, 3:], away)).max()),
    )


def _surfaces(plan: SiliconePlan, slab: Slab, side: str) -> list[tuple[int, NDArray[np.int64]]]:
    planes = [plan.opened[chamber.name] for chamber in plan.body.chambers]
    return formed(slab, side, plan.samples, plan.normal, plan.offsets, planes)
