"""The limits on the shape of the bodies of a run, as the optimiser asks about them."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from pneumorph.geometry import Body
from pneumorph.geometry.lattice import LatticeSurface, deviations_of
from pneumorph.geometry.lattice.pieces import patches_of
from pneumorph.geometry.regions import box
from pneumorph.geometry.starting import body_of
from pneumorph.geometry.tube.surface import between_ends
from pneumorph.limits.certify.enclosed import EnclosedBody
from pneumorph.limits.certify.places import Places, Points
from pneumorph.limits.kinds.kind import Kind
from pneumorph.limits.lattice.enclosed import EnclosedLattices
from pneumorph.limits.lattice.neighbours import linked
from pneumorph.limits.lattice.parts import kept_pairs, parts_of
from pneumorph.limits.lattice.rims import rims_of
from pneumorph.limits.lattice.sampled import SampledLattices
from pneumorph.limits.linearised import Rows, linearised
from pneumorph.limits.obstacles import obstacles_of
from pneumorph.limits.report import LimitReport, certify
from pneumorph.limits.rows.sampled import SampledBody
from pneumorph.limits.shares import Usage, usage
from pneumorph.limits.table import LATTICE_KINDS, TUBE_KINDS
from pneumorph.limits.tube.enclosed import enclosed_tubes
from pneumorph.limits.tube.measures.grid import grid
from pneumorph.limits.tube.sampled import SampledTubes
from pneumorph.limits.tube.samples import LimitSamples, sample_limits
from pneumorph.limits.tube.smooth import LimitFunctions
from pneumorph.symmetry.operations import operations

if TYPE_CHECKING:
    from pneumorph.problem import Limits, Problem


@dataclass(frozen=True, eq=False)
class ShapeLimits:
    """Limits on the shapes of bodies that differ in their control points alone.

    Attributes
    ----------
    spec : problem.Limits
    kinds : tuple of Kind
    cells : int
        Number of cells of all surfaces: the rows of a limit in a cell share its multiplier.
    sampled, enclosed : functions
        Return a body at its samples, and by what encloses its surfaces.
    """

    spec: Limits
    kinds: tuple[Kind[Any, Any, Any], ...]
    cells: int
    sampled: Callable[[Body], SampledBody]
    enclosed: Callable[[Body], EnclosedBody]

    def rows(
        self,
        body: Body,
        reach: float,
        least: float,
        places: Mapping[str, Points] | None = None,
        violated: Places | None = None,
    ) -> Rows:
        """The limits linearised at a body.

        Parameters
        ----------
        body : Body
        reach, least, places, violated
            See `limits.linearised`.
        """
        return linearised(self.kinds, self.sampled(body), reach, least, places, violated)

    @property
    def of_distances(self) -> tuple[ShapeLimits, ShapeLimits]:
        """The limits on distances alone, and all others."""
        groups: tuple[list[Kind[Any, Any, Any]], ...] = ([], [])
        for kind in self.kinds:
            groups[any(limit.per is None for limit in kind.limits)].append(kind)
        distances, others = (replace(self, kinds=tuple(group)) for group in groups)
        return distances, others

    def certify(self, body: Body) -> LimitReport:
        """The certified worst values of all limits."""
        return certify(self.kinds, self.enclosed(body))

    def shares(self, body: Body) -> list[Usage]:
        """The share of the nearest limit that is used everywhere on each surface, the exterior first."""
        return usage(self.kinds, self.sampled(body))


def limits_at(samples: LimitSamples) -> ShapeLimits:
    """The limits on bodies of tubes with these samples."""
    return ShapeLimits(
        samples.spec,
        TUBE_KINDS,
        int(samples.first[-1]),
        lambda body: SampledTubes(samples, body),
        lambda body: enclosed_tubes(body, samples.spec, samples.own_spans),
    )


def tube_limits(body: Body, spec: Limits, group: Sequence[NDArray[np.float64]] = ()) -> ShapeLimits:
    """The limits on all bodies of a run, see `sample_limits`."""
    return limits_at(sample_limits(body, spec, group))


def lattice_limits(
    body: Body[LatticeSurface],
    spec: Limits,
    length: float,
    deviations: Sequence[NDArray[np.float64]],
    group: Sequence[NDArray[np.float64]] = (),
) -> ShapeLimits:
    """The limits on all bodies of a run that are displaced by the lattices of a body.

    Parameters
    ----------
    body : Body
    spec : problem.Limits
    length : float
        Of the body, mm.
    deviations : sequence of (m,) array
        Of every surface, bounds of the distance of its triangles from the faces in the file, mm. Displaced, they are
        apart by no more than that times the largest scaling, so that distances between triangles count as less by that.
    group : sequence of (3, 3) array
        The symmetries of the bodies.
    """
    assert spec.scaling is not None, "bodies from files have limits on scaling"
    patches = tuple(map(patches_of, body.surfaces))
    links = tuple(linked(each, spec.fold.neighbourhood) for each in patches)
    margins = tuple(spec.scaling.largest * each for each in deviations)
    between = box((-np.inf, -np.inf, 0.0), (np.inf, np.inf, length))
    rims = rims_of(body.surfaces, patches, spec.wall)
    known = between, patches, links, rims, margins
    parts = tuple(parts_of(*each) for each in zip(body.surfaces, patches, margins, strict=True))
    kept = kept_pairs(parts, links, spec.fold.neighbourhood, rims, group)
    return ShapeLimits(
        spec,
        LATTICE_KINDS,
        sum(len(each.nodes) for each in patches),
        lambda body: SampledLattices(body, spec, *known, parts, kept, group),
        lambda body: EnclosedLattices(body, spec, *known),
    )


def limits_of(problem: Problem, body: Body) -> ShapeLimits:
    """The limits of a problem on the shapes of bodies like this one, which has its symmetry."""
    group = operations(problem.body.symmetry)
    if problem.solid is not None:
        limits = lattice_limits(body, problem.limits, problem.body.length, deviations_of(problem), group)
    else:
        limits = tube_limits(body, problem.limits, group)
    if not problem.obstacle:
        return limits
    start = limits.sampled(body_of(problem))
    samples = [start.positions(number) for number in range(len(start.body.surfaces))]
    return replace(limits, kinds=(*limits.kinds, obstacles_of(problem, samples, group)))


def build_limit_functions(
    body: Body, spec: Limits, per_span: tuple[int, int] = (4, 8), reach: float = 0.5
) -> LimitFunctions:
    """Build the limits of a problem on samples of a body of tubes.

    Parameters
    ----------
    body : Body
        Any body of the run: only properties that never change (net shapes, starting sizes, kinds and planes of ends)
        are used.
    spec : problem.Limits
    per_span : (int, int)
        Samples per knot span in q and in r. Curvature has its peaks on knots, stretch has them anywhere: in a fold of a
        bellows, one span of r turns by more than a right angle, and four samples would miss a quarter of h₃.
    reach : float
        See `LimitFunctions`.
    """
    return LimitFunctions(
        kinds=TUBE_KINDS,
        grids=tuple(grid(surface, per_span) for surface in body.surfaces),
        slices=body.slices,
        between=between_ends(body),
        spec=spec,
        reach=reach,
    )
