"""The table [design] of a body from a file: how finely it is designed, and what of it stays as it is."""

from __future__ import annotations

from typing import Annotated

from pydantic import Field

from pneumorph.problem.models import MOST_CHAMBERS, PositiveLength
from pneumorph.problem.names import Name
from pneumorph.problem.solid import Selection
from pneumorph.problem.table import Table

DIVISIONS = 15.0
"""Default spacings of control points along the diagonal of a body."""

MOST_KEPT = 100
"""Selections of faces that stay."""


class DesignSpec(Table):
    """How finely the surfaces of a body from a file are designed, and which of its faces stay as they are.

    Every surface is displaced smoothly by control points on a lattice of its own; base and tip stay as they are.
    """

    spacing: PositiveLength | None = None
    """Distance of control points along x, y and z; by default a fifteenth of the diagonal of the body."""
    spacings: Annotated[dict[Name, PositiveLength], Field(max_length=MOST_CHAMBERS + 1)] | None = None
    """The same for single surfaces: "exterior", or the names of chambers."""
    keep: Annotated[tuple[Selection, ...], Field(max_length=MOST_KEPT)] = ()
    """Faces that stay as they are, such as those of connectors and screw holes; what is beside them moves smoothly."""
    plane: Annotated[tuple[Selection, ...], Field(max_length=MOST_KEPT)] = ()
    """Faces that stay plane, such as those that touch what is gripped: they move within their plane, and along its
    normal as a whole, if they are apart from what stays."""

    def spacing_of(self, surface: str, diagonal: float) -> float:
        """Distance of the control points of a surface of a body with this diagonal, mm."""
        return (self.spacings or {}).get(surface, self.spacing or diagonal / DIVISIONS)
