"""Proof of a mould: checks of the pieces, of the space that they leave, and of how they come apart."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from itertools import combinations

import manifold3d
import numpy as np
from numpy.typing import NDArray

from pneumorph.make.checks import Check, closure, distances, manifold
from pneumorph.make.mould.piece import Role
from pneumorph.make.mould.plan import Plan, SplitPlan
from pneumorph.make.mould.tessellation import Tessellation
from pneumorph.make.triangles import together

Array = NDArray[np.float64]

VOLUME = 1e-3
"""Largest volume of the rubber part that pieces may take up, and largest overlap of two pieces, both relative to it."""

MEETING = 1.0 / 6.0
"""How deep triangles on one surface with other vertices overlap on average, over the chord.

Those of an arc are 1 - x² of the chord from it, with x from 0 at their middles to 1 at their ends. With another y for
the others, the mean of half of |x² - y²| is 1/6.
"""

RUBBER = ("product", "part", "negative")
"""Roles of pieces that are cast; all others are printed."""

_RAYS = 1500  # per piece, to find its thinnest wall
_OPPOSITE = -0.985  # cosine between the normals of both sides of a wall; those of an edge are farther from parallel


@dataclass(frozen=True, eq=False)
class Part:
    """A piece as triangles.

    Attributes
    ----------
    name : str
    role : Role
    mesh : Tessellation
    solid : manifold3d.Manifold
    """

    name: str
    role: Role
    mesh: Tessellation
    solid: manifold3d.Manifold


def part(name: str, role: Role, mesh: Tessellation) -> Part:
    """Build a part; its solid is empty if the triangles are not closed."""
    return Part(name, role, mesh, manifold(mesh.triangles))


def proof(plan: SplitPlan, parts: Sequence[Part], chord: float) -> Iterator[Check]:
    """All checks of a mould; those of single pieces first.

    Parameters
    ----------
    parts : sequence of Part
        All pieces, among them the rubber part.
    chord : float
        Chord error of their triangles, mm.
    """
    for each in parts:
        yield closure(each.name, each.mesh.triangles, each.solid)
    yield from sizes(plan, parts)
    product = next(each for each in parts if each.role == "product")
    around = [each for each in parts if each.role in ("mould", "core")]
    yield from room("mould", product, around, chord)
    yield overlap(around, product.solid.volume())
    most = plan.spec.release_stretch
    for number, release in enumerate(plan.releases, start=1):
        yield Check(f"outer-{number}", "stretch of the rubber when pulled off", release.stretch, most)
    for core in plan.cores:
        yield Check(f"core-{core.chamber}", "lateral deflection while casting", core.sag, plan.spec.core_sag, "mm")
        yield Check(f"core-{core.chamber}", "high points below it that trap air", len(plan.trapped[core.chamber]), 0)
    yield from openings(product, sum(len(core.stems) - 1 for core in plan.cores))


def sizes(plan: Plan, parts: Sequence[Part]) -> Iterator[Check]:
    """Whether pieces fit the printer, and are thick enough for it; those of rubber are not printed."""
    printer = plan.spec.printer
    for each in parts:
        if each.role in RUBBER:
            continue
        size, most = np.sort(np.ptp(each.mesh.triangles.points, axis=0)), np.sort(printer.volume)
        yield Check(each.name, "size beyond that of the printer", max(float((size - most).max()), 0.0), 0.0, "mm")
        yield Check(each.name, "places thinner than the printer can print", _thin(each, printer.wall), 0)


def _thin(each: Part, least: float) -> int:
    """Number of sampled places where opposite sides of a piece are nearer to each other than `least` mm."""
    points, corners = each.mesh.triangles.points, each.mesh.triangles.corners
    a, b, c = np.moveaxis(points[corners], 1, 0)
    normal = np.cross(b - a, c - a)
    area = np.linalg.norm(normal, axis=1)
    chosen = np.random.default_rng(0).choice(len(area), size=_RAYS, p=area / area.sum())
    normal = normal[chosen] / area[chosen, None]
    start = (a + b + c)[chosen] / 3.0 - 1e-4 * normal
    count = 0
    for origin, end, outward in zip(start.tolist(), (start - least * normal).tolist(), normal, strict=True):
        hits = each.solid.ray_cast(origin, end)
        count += any(np.dot(hit.normal, outward) < _OPPOSITE for hit in hits)
    return count


def room(name: str, product: Part, around: Sequence[Part], chord: float) -> Iterator[Check]:
    """Check that the space between pieces of a mould is the rubber part: by distances both ways, and by volume.

    Parameters
    ----------
    name : str
        Of the mould.
    product : Part
        The rubber part.
    around : sequence of Part
        The pieces around it.
    chord : float
        Largest distance of triangles from their surfaces, mm; distances must not be larger.
    """
    away = distances(together([each.mesh.triangles for each in around]), product.mesh.triangles.points)
    yield Check(name, "distance of the part's points from the mould's surfaces", float(away.max()), chord, "mm")
    away = distances(product.mesh.triangles, np.concatenate([curved(each) for each in around]))
    yield Check(name, "distance of the mould's curved surfaces from the part", float(away.max()), chord, "mm")
    volume = product.solid.volume()
    taken = sum((product.solid ^ each.solid).volume() for each in around)
    limit = max(VOLUME, MEETING * chord * product.solid.surface_area() / volume)
    yield Check(name, "volume of the part that pieces take up, relative", taken / volume, limit)


def curved(part: Part) -> Array:
    """The vertices (n, 3) of a piece on the rubber's own spline surfaces."""
    return part.mesh.triangles.points[np.unique(part.mesh.triangles.corners[part.mesh.spline])]


def overlap(around: Sequence[Part], volume: float) -> Check:
    """The largest volume that two pieces share, relative to a volume."""
    shared = {
        f"{one.name} and {other.name}": (one.solid ^ other.solid).volume() for one, other in combinations(around, 2)
    }
    worst = max(shared, key=lambda names: shared[names])
    return Check(worst, "largest overlap of two pieces, relative to the part", shared[worst] / volume, VOLUME)


def openings(product: Part, handles: int) -> Iterator[Check]:
    """Every chamber is connected with the outside by its own holes, and with nothing else.

    A body without holes has as many closed surfaces as it has chambers, and one more. A chamber's first hole joins its
    surface to the outer one; every further hole, or a connection of two chambers, adds a handle. `handles` are those of
    second stems.
    """
    yield Check("body", "closed chambers", len(product.solid.decompose()) - 1, 0)
    yield Check("body", "connections between chambers", abs(product.solid.genus() - handles), 0)
