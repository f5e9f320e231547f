"""What a kind of limit provides, all of it in one file.

Kinds that ask a body for no more than the protocols here, `SampledBody` and `EnclosedBody` are limits on surfaces of
every kind; others are those of one.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING, Any, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry.regions import Region
from pneumorph.limits.certify.enclosed import EnclosedBody
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.sampled import Near, RowBlock, SampledBody

if TYPE_CHECKING:
    from pneumorph.problem import Limits


class SmoothBody(Protocol):
    """A body at fixed samples, at which c is a smooth function of the control points; arrays are JAX's."""

    @property
    def spec(self) -> Limits: ...

    @property
    def between(self) -> Region: ...

    def positions(self) -> list[tuple[bool, Any]]:
        """Of every surface whether it is a cavity, and the positions (n, 3) of its samples, mm."""
        ...

    def walls(self, bound: float) -> Any:
        """c (n,) of the distances between surfaces, for a bound in mm; -1 where they are far apart."""
        ...

    def folds(self, bound: float) -> Any:
        """The same within surfaces."""
        ...

    def joined(self, parts: list[Any]) -> Any:
        """Concatenate arrays (n,), of which there may be none."""
        ...


Sampled = TypeVar("Sampled", bound=SampledBody, contravariant=True)
Enclosed = TypeVar("Enclosed", bound=EnclosedBody, contravariant=True)
Smooth = TypeVar("Smooth", bound=SmoothBody, contravariant=True)


class Kind(Protocol[Sampled, Enclosed, Smooth]):
    """One limit, or several that are measured together."""

    @property
    def limits(self) -> tuple[Limit, ...]:
        """What they are called, and their bounds."""
        ...

    def rows(self, at: Sampled, near: Near) -> Iterator[RowBlock]:
        """Values and derivatives of c at the worst samples that are near their bounds."""
        ...

    def rows_at(self, at: Sampled, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        """The same at places where a certificate has found one of the limits violated."""
        ...

    def certify(self, body: Enclosed, tallies: Mapping[str, Tally]) -> None:
        """Enclose the values on the whole surfaces, each limit's in its tally."""
        ...

    def shares(self, at: Sampled, number: int) -> Iterator[tuple[str, NDArray[np.float64]]]:
        """Used shares (...) of limits at the samples of the surface with index `number`."""
        ...

    def smooth(self, at: Smooth) -> Mapping[str, Any]:
        """c at fixed samples in JAX, one array for each limit."""
        ...
