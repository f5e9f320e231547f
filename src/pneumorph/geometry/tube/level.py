"""Planes z = height beyond which a body is made of another rubber, and what keeps designs to their sides of them.

A surface crosses such a plane along a ring r = const. The control points that the ring depends on keep their z, with
which z does not depend on q there, so the ring lies in the plane for every design. All other control points keep to
their side of those: along every line q = const z(r) then has a control polygon that crosses the plane once, and so does
z(r) itself, since splines diminish variation.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import root_scalar

from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import TubeSurface
from pneumorph.symmetry.operations import operations

if TYPE_CHECKING:
    from pneumorph.problem import BodySpec, Problem, Region

Array = NDArray[np.float64]

_NOTHING = 1e-9
"""Values of B-splines up to this do not count."""


@dataclass(frozen=True)
class Level:
    """A plane above which a region begins.

    Attributes
    ----------
    region : str
        Its name.
    height : float
        z of the plane, mm.
    rings : {surface: float}
        r of the rings along which "exterior" and chambers cross it; others do not.
    """

    region: str
    height: float
    rings: Mapping[str, float]


def build_levels(spec: BodySpec, regions: Sequence[Region]) -> tuple[Level, ...]:
    """The planes of the regions of a problem, from the lowest to the highest."""
    surfaces = starting_body(spec).surfaces
    planes = [(region.beyond, region.name) for region in regions if region.beyond is not None]
    return tuple(
        Level(name, height, {each.name: _ring(each, height) for each in surfaces if _crosses(each, height)})
        for height, name in sorted(planes)
    )


@dataclass(frozen=True, eq=False)
class Sides:
    """What z the control points (n_r,) of each row of a surface may have: `fixed` ones the z of the start; mm."""

    fixed: NDArray[np.bool_]
    low: Array
    high: Array


def sides_of(problem: Problem) -> tuple[Sides, ...]:
    """What keeps the surfaces of a problem's designs to their sides of all planes, and of the images of these.

    Chambers that do not cross a plane stay as far from it as from each other, by `limits.wall`.
    """
    length = problem.tubes.length
    heights = {level.height for level in build_levels(problem.tubes, problem.region)}
    if any(operation[2, 2] < 0 for operation in operations(problem.tubes.symmetry)):
        heights |= {length - height for height in heights}
    return tuple(_sides(each, heights, problem.limits.wall) for each in starting_body(problem.tubes).surfaces)


def _sides(surface: TubeSurface, heights: Iterable[float], wall: float) -> Sides:
    z = surface.net[:, 0, 2]
    fixed, low, high = np.zeros(len(z), bool), np.full(len(z), -np.inf), np.full(len(z), np.inf)
    for height in heights:
        if not _crosses(surface, height):
            above = z[0] >= height
            low = np.maximum(low, height + wall) if above else low
            high = high if above else np.minimum(high, height - wall)
            continue
        rows = np.flatnonzero(surface.basis_r.matrix(np.array([_ring(surface, height)]))[0] > _NOTHING)
        fixed[rows] = True
        high[: rows[0]] = np.minimum(high[: rows[0]], z[rows[0]])
        low[rows[-1] + 1 :] = np.maximum(low[rows[-1] + 1 :], z[rows[-1]])
    return Sides(fixed, low, high)


def _crosses(surface: TubeSurface, height: float) -> bool:
    return bool(surface.net[0, 0, 2] < height < surface.net[-1, 0, 2])


def _ring(surface: TubeSurface, height: float) -> float:
    """r at which a surface of the starting body, whose rows are level, crosses a plane."""
    z = surface.net[:, 0, 2]

    def above(r: float) -> float:
        return float((surface.basis_r.matrix(np.array([r])) @ z)[0]) - height

    return root_scalar(above, bracket=(0.0, 1.0), xtol=1e-15).root
