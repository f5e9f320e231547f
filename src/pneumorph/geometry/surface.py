"""What a boundary surface of a body is to everything after it."""

from __future__ import annotations

from typing import Protocol, Self

import numpy as np
from numpy.typing import NDArray


class Surface(Protocol):
    """One boundary surface of a body, all of whose points are linear functions of its control points."""

    @property
    def name(self) -> str:
        """ "exterior" or the chamber's name."""
        ...

    @property
    def cavity(self) -> bool:
        """Whether the surface bounds a chamber (void) rather than the outside of the body."""
        ...

    @property
    def n_points(self) -> int:
        """Number of control points."""
        ...

    def control_points(self) -> NDArray[np.float64]:
        """All control points, (n_points, 3) in mm."""
        ...

    def with_control_points(self, points: NDArray[np.float64]) -> Self:
        """The same surface with other control points, (n_points, 3) in mm."""
        ...
