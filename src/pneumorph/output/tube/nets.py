"""Tubes on a page: it draws their splines from control nets, which are a hundredth of the triangles."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

from pneumorph.geometry import Body, Surface
from pneumorph.geometry.tube.surface import UPWARDS, TubeSurface


def of_straight_tubes(body: Body) -> bool:
    """Whether all surfaces of a body are tubes about z."""
    return all(
        isinstance(surface, TubeSurface) and surface.directions == (UPWARDS, UPWARDS) for surface in body.surfaces
    )


def told_as_tube(surfaces: Sequence[Surface]) -> dict[str, Any] | None:
    """What a page is told of a tube in several designs beside its control nets; None for surfaces of another kind."""
    first = surfaces[0]
    return {"kind": "tube", "ends": list(first.ends)} if isinstance(first, TubeSurface) else None
