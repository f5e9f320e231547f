"""What a kind of limit provides, all of it in one file."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import Any, Protocol

import numpy as np
from numpy.typing import NDArray

from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.limit import Limit
from pneumorph.limits.tube.certify.tally import SpannedBody, Tally
from pneumorph.limits.tube.rows.samples import Near, RowBlock, SampledBody
from pneumorph.limits.tube.rows.smooth import SmoothBody


class Kind(Protocol):
    """One limit, or several that are measured together."""

    @property
    def limits(self) -> tuple[Limit, ...]:
        """What they are called, and their bounds."""
        ...

    def rows(self, at: SampledBody, near: Near) -> Iterator[RowBlock]:
        """Values and derivatives of c at the worst samples that are near their bounds."""
        ...

    def rows_at(self, at: SampledBody, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        """The same at places where a certificate has found one of the limits violated."""
        ...

    def certify(self, body: SpannedBody, tallies: Mapping[str, Tally]) -> None:
        """Enclose the values on the whole surfaces, each limit's in its tally."""
        ...

    def shares(self, at: SampledBody, number: int) -> Iterator[tuple[str, NDArray[np.float64]]]:
        """Used shares (rows, columns) of limits at all samples of the surface with index `number`, fine or coarse."""
        ...

    def smooth(self, at: SmoothBody) -> Mapping[str, Any]:
        """c at fixed samples in JAX, one array for each limit."""
        ...
