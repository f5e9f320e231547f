"""Layers of another rubber along the surfaces of a body, bounded inside by copies of them that move along."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.tube.bent import bent
from pneumorph.geometry.tube.start import starting_body
from pneumorph.geometry.tube.surface import TubeSurface

if TYPE_CHECKING:
    from pneumorph.problem import BodySpec, ChamberSpec, Region


@dataclass(frozen=True, eq=False)
class Lining:
    """What lies between a part of a surface and its copy, the surface of the moved control points P + offset.

    The offset is constant, so that the copy is affine in P: it moves exactly as the surface does.

    Attributes
    ----------
    region : str
        Name of the region to which it belongs.
    surface : str
        "exterior" or the chamber's name.
    thickness : float
        At the start, mm.
    offset : (n_r, n_q, 3) float
        From the control points of the surface to those of the copy, mm.
    r : (float, float)
        The part along the surface.
    q : (float, float) or None
        The part around it, which may pass q = 1; None for all of it.
    ends : bool
        Whether it lies along the ends of the surface too.
    """

    region: str
    surface: str
    thickness: float
    offset: NDArray[np.float64]
    r: tuple[float, float] = (0.0, 1.0)
    q: tuple[float, float] | None = None
    ends: bool = False

    def covers(self, q: NDArray[np.float64], r: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Whether points of the surface are in the part."""
        along = (self.r[0] <= r) & (r <= self.r[1])
        return along if self.q is None else along & ((q - self.q[0]) % 1.0 <= self.q[1] - self.q[0])


def build_linings(spec: BodySpec, regions: Sequence[Region]) -> tuple[Lining, ...]:
    """The linings of the regions of a problem.

    Offsets are normal to the starting surfaces without their waves, so that waves and their copies are in parallel.
    """
    chambers = {chamber.name: chamber.model_copy(update={"ripple": None}) for chamber in spec.chamber}
    plain = starting_body(spec.straight.model_copy(update={"ripple": None, "chamber": tuple(chambers.values())}))
    surfaces = {surface.name: surface for surface in plain.surfaces}
    axis, linings = spec.bent, []

    def placed(surface: TubeSurface, offset: NDArray[np.float64]) -> NDArray[np.float64]:
        if axis is None:
            return offset
        return bent(replace(surface, net=surface.net + offset), axis).net - bent(surface, axis).net

    for region in regions:
        if region.layer is not None:
            layer, inwards = region.layer, -region.thickness / spec.radius
            offset = inwards * plain.exterior.net * [1.0, 1.0, 0.0]
            start, end = layer.span or (0.0, spec.length)
            q = None if layer.angles is None else (layer.angles[0] / (2 * math.pi), layer.angles[1] / (2 * math.pi))
            r = (max(start / spec.length, 0.0), min(end / spec.length, 1.0))
            offset = placed(plain.exterior, offset)
            linings.append(Lining(region.name, "exterior", region.thickness, offset, r, q))
        for name in region.sleeve.chambers if region.sleeve else ():
            offset = placed(surfaces[name], _around(chambers[name], surfaces[name], region.thickness))
            linings.append(Lining(region.name, name, region.thickness, offset, ends=True))
    return tuple(linings)


def _around(chamber: ChamberSpec, surface: TubeSurface, thickness: float) -> NDArray[np.float64]:
    """Offsets of a chamber's control points by which its tube and both ends move outwards by the thickness."""
    offset = np.empty_like(surface.net)
    offset[..., :2] = (surface.net[..., :2] - chamber.center) * thickness / chamber.radius
    # Ends, or domes on both sides of a straight part, are scaled along z.
    start, end = chamber.span
    height = (end - start) / 2.0 if chamber.ends == "flat" else min(chamber.radius, (end - start) / 2.0)
    z = surface.net[..., 2]
    offset[..., 2] = (np.minimum(z - start - height, 0.0) + np.maximum(z - end + height, 0.0)) * thickness / height
    return offset
