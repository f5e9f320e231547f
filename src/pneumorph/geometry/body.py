"""The body, made of one exterior and any number of chambers."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.surface import Surface

Array = NDArray[np.float64]
Kind = TypeVar("Kind", bound=Surface)


@dataclass(frozen=True, eq=False)
class Body(Generic[Kind]):
    """All boundary surfaces of a soft body.

    All points of a body are linear functions of its control points.

    Attributes
    ----------
    exterior : Surface
    chambers : tuple of Surface
    """

    exterior: Kind
    chambers: tuple[Kind, ...]

    @property
    def surfaces(self) -> tuple[Kind, ...]:
        """Every surface, the exterior first."""
        return (self.exterior, *self.chambers)

    @cached_property
    def slices(self) -> tuple[slice, ...]:
        """Rows of `control_points()` that belong to each surface."""
        stops = np.cumsum([surface.n_points for surface in self.surfaces])
        return tuple(slice(int(start), int(stop)) for start, stop in zip([0, *stops[:-1]], stops, strict=True))

    @property
    def n_points(self) -> int:
        """Number of control points."""
        return self.slices[-1].stop

    def control_points(self) -> Array:
        """All control points, (n_points, 3) in mm: exterior first."""
        return np.concatenate([surface.control_points() for surface in self.surfaces])

    def nets(self) -> list[Array]:
        """The control points of each surface in mm, arranged as `Surface.shape` says: (..., 3)."""
        return [surface.control_points().reshape(*surface.shape, 3) for surface in self.surfaces]

    def with_control_points(self, points: Array) -> Body[Kind]:
        """The same body with other control points, (n_points, 3) in mm."""
        points = np.asarray(points, dtype=float).reshape(self.n_points, 3)
        surfaces = [
            surface.with_control_points(points[where])
            for surface, where in zip(self.surfaces, self.slices, strict=True)
        ]
        return Body(surfaces[0], tuple(surfaces[1:]))
