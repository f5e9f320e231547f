"""The limits on the shape of the bodies of a run, as the optimiser asks about them."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.limits.certify.places import Places, Points
from pneumorph.limits.linearised import Rows, linearised
from pneumorph.limits.report import LimitReport, certify
from pneumorph.limits.tube.rows.samples import LimitSamples, sample_limits
from pneumorph.problem.solid import require_tube
from pneumorph.symmetry.operations import operations

if TYPE_CHECKING:
    from pneumorph.problem import Limits, Problem


class ShapeLimits(Protocol):
    """Limits on the shapes of bodies that differ in their control points alone."""

    @property
    def cells(self) -> int:
        """Number of cells of all surfaces: the rows of a limit in a cell share its multiplier."""
        ...

    @property
    def wall(self) -> float:
        """The least distance between surfaces, mm: the length that distances are compared with."""
        ...

    def rows(
        self,
        body: Body,
        reach: float,
        least: float,
        places: Mapping[str, Points] | None = None,
        broken: Places | None = None,
    ) -> Rows:
        """The limits linearised at a body.

        Parameters
        ----------
        body : Body
            mm.
        reach, least, places, broken
            See `limits.linearised`.
        """
        ...

    def certify(self, body: Body) -> LimitReport:
        """The certified worst values of all limits."""
        ...


@dataclass(frozen=True, eq=False)
class TubeLimits:
    """The limits of a problem on bodies of tubes."""

    samples: LimitSamples

    @property
    def cells(self) -> int:
        return int(self.samples.first[-1])

    @property
    def wall(self) -> float:
        return self.samples.spec.wall

    def rows(
        self,
        body: Body,
        reach: float,
        least: float,
        places: Mapping[str, Points] | None = None,
        broken: Places | None = None,
    ) -> Rows:
        """See `ShapeLimits.rows`.

        Parameters
        ----------
        body, reach, least, places, broken
            See `ShapeLimits.rows`.
        """
        return linearised(self.samples, body, reach, least, places, broken)

    def certify(self, body: Body) -> LimitReport:
        return certify(body, self.samples.spec, own=self.samples.own_spans)


def tube_limits(body: Body, spec: Limits, group: Sequence[NDArray[np.float64]] = ()) -> TubeLimits:
    """The limits on all bodies of a run, see `sample_limits`."""
    return TubeLimits(sample_limits(body, spec, group))


def limits_of(problem: Problem, body: Body) -> ShapeLimits:
    """The limits of a problem on the shapes of bodies like this one, which has its symmetry."""
    return tube_limits(body, problem.limits, operations(require_tube(problem.body, "designed").symmetry))
