"""The limit that keeps the body at rest out of obstacles in their places, from where tasks move them.

Around an obstacle is room of half of the contact distance, or of half of the gap at the start where that is less: the
faces of meshes are flatter than surfaces are, and what is nearer than the contact distance is pressed on at rest. The
value is how far surfaces reach into this room. Obstacles of triangles may have any shape, all others are convex.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from pneumorph.cad.space import TOUCHING, Space
from pneumorph.geometry.regions import Ball, Cylinder, HalfSpace, Image, Intersection, Outside, Region, box
from pneumorph.limits.certify.enclosed import EnclosedBody
from pneumorph.limits.certify.places import Pairs, Points
from pneumorph.limits.certify.tally import Tally
from pneumorph.limits.lattice.neighbours import balls, close_pairs
from pneumorph.limits.lattice.triangles import distances
from pneumorph.limits.limit import Limit
from pneumorph.limits.rows.regions import rows_beyond
from pneumorph.limits.rows.sampled import Near, Placed, RowBlock, SampledBody, by_surface
from pneumorph.problem.contact import BoxSpec, CylinderSpec, ObstacleSpec, PlaneSpec, SphereSpec, TriangulatedSpec

if TYPE_CHECKING:
    from pneumorph.problem import Problem

Floats = NDArray[np.float64]

OBSTACLES = Limit("obstacles", "reach into obstacles", "mm", False, 0.002, "obstacles_mm", lambda limits: 0.0, "wall")

ROOM = 0.5
"""Part of the contact distance, or of the gap at the start."""


@dataclass(frozen=True, eq=False)
class Room:
    """What is kept free around an obstacle, up to a `width` in mm."""

    obstacle: Region | Space
    width: float

    def reach(self, x: Floats) -> Floats:
        """How far points (..., 3) are within it, mm; negative outside."""
        return self.width - self.obstacle.beyond(x)

    def enclosed(self, x: Floats, error: Floats) -> Floats:
        """Upper bounds (n,) of that on pieces within distances `error` (n,) of flat triangles (n, 3, 3)."""
        if isinstance(self.obstacle, Space):
            return self._beside_triangles(self.obstacle, x, error)
        # How far points are beyond a convex region is nowhere less than by a tangent.
        centres = x.mean(axis=1)
        away = np.einsum("nkc,nc->nk", x - centres[:, None], self.obstacle.outward(centres))
        return self.reach(centres) - away.min(axis=1) + error

    def _beside_triangles(self, obstacle: Space, x: Floats, error: Floats) -> Floats:
        """The distance changes no faster than places do; where that does not decide, by that of the triangles."""
        centres, radii = balls(x)
        at_centres = self.reach(centres)
        above = at_centres + radii + error
        some = np.flatnonzero((above > 0.0) & (at_centres < self.width))
        within = self.width + TOUCHING + error[some]
        # Large enough to be sharper than what is known of a piece.
        gap = within + radii[some]
        i, j = close_pairs(x[some], obstacle.corners, gap)
        np.minimum.at(gap, i, distances(x[some], obstacle.corners, i, j, gap[i])[0])
        above[some] = np.minimum(above[some], np.where(gap > 0.0, within - gap, np.inf))
        return above


@dataclass(frozen=True)
class Obstacles:
    """Surfaces are outside the rooms around obstacles."""

    rooms: tuple[Room, ...] = ()

    @property
    def limits(self) -> tuple[Limit, ...]:
        return (OBSTACLES,)

    def rows(self, at: SampledBody, near: Near) -> Iterator[RowBlock]:
        scale = OBSTACLES.scale(at.spec)
        for number in range(len(at.body.surfaces)):
            x = at.positions(number)
            for room in self.rooms:
                points = at.worst(number, room.reach(x) / scale, -near.reach / scale)
                if len(points.cell):
                    yield self._rows(at, points, room)

    def rows_at(self, at: SampledBody, limit: str, places: Points | Pairs) -> Iterator[RowBlock]:
        assert isinstance(places, Points)
        for points in by_surface(at, places):
            numbers, weights = at.sums(points)
            x = np.einsum("mk,mkc->mc", weights, at.body.control_points()[numbers])
            worst = np.argmax([room.reach(x) for room in self.rooms], axis=0)
            for k in np.unique(worst):
                some = worst == k
                margin = np.broadcast_to(points.margin, len(some))[some]
                yield self._rows(at, Placed(points.number, points.cell[some], points.at[some], margin), self.rooms[k])

    def certify(self, body: EnclosedBody, tallies: Mapping[str, Tally]) -> None:
        tally = tallies[OBSTACLES.name]
        accuracy = replace(tally.accuracy, scale=OBSTACLES.scale(body.spec))
        for number in body.own:
            tally.points(number, body.faceted(number, self._enclosed, accuracy, tally.worst))

    def shares(self, at: SampledBody, number: int) -> Iterator[tuple[str, Floats]]:
        x = at.positions(number)
        yield OBSTACLES.name, OBSTACLES.used(np.max([room.reach(x) for room in self.rooms], axis=0), 0.0)

    def smooth(self, at: Any) -> dict[str, Any]:
        return {}

    def _enclosed(self, x: Floats, error: Floats) -> tuple[Floats, Floats]:
        """Upper bounds (n,) of the value on pieces, and its values (n, 3) at their corners."""
        attained = np.max([room.reach(x) for room in self.rooms], axis=0)
        above = np.max([room.enclosed(x, error) for room in self.rooms], axis=0)
        return np.maximum(above, attained.max(axis=1)), attained

    @staticmethod
    def _rows(at: SampledBody, points: Placed, room: Room) -> RowBlock:
        return rows_beyond(at, points, Outside(room.obstacle), room.width + points.margin, OBSTACLES.scale(at.spec))


def obstacles_of(problem: Problem, samples: Sequence[Floats], group: Sequence[Floats] = ()) -> Obstacles:
    """The limit of a problem with obstacles.

    Parameters
    ----------
    problem : Problem
    samples : sequence of (..., 3) array
        Points of the surfaces at the start, mm.
    group : sequence of (3, 3) array
        Operations about the middle of the body, of which images need not be looked at: a body is outside of an obstacle
        if the part of which all others are images is outside of all images of the obstacle.
    """
    x, middle = np.concatenate([each.reshape(-1, 3) for each in samples]), np.array([0.0, 0.0, problem.body.length / 2])
    rooms: list[Room] = []
    for spec in problem.obstacle:
        own: list[Floats] = []
        region = region_of(spec)
        # All images have the same room.
        gap = region.beyond(x).min()
        width = ROOM * min(problem.contact_distance, max(float(gap), 0.0))
        for matrix in group or (np.eye(3),):
            image = image_of(region, matrix, middle)
            beyond = image.beyond(x)
            if not any(np.allclose(beyond, known, atol=1e-9) for known in own):
                own.append(beyond)
                rooms.append(Room(image, width))
    return Obstacles(tuple(rooms))


def region_of(spec: ObstacleSpec) -> Region | Space:
    """What an obstacle fills in its place."""
    match spec:
        case PlaneSpec():
            return HalfSpace(spec.normal, float(np.dot(spec.normal, spec.point)))
        case SphereSpec():
            return Ball(spec.radius, spec.center)
        case CylinderSpec():
            middle = float(np.dot(spec.axis, spec.center))
            x, y, z = spec.axis
            back = (-x, -y, -z)
            ends = HalfSpace(spec.axis, middle + spec.length / 2), HalfSpace(back, spec.length / 2 - middle)
            return Intersection((Cylinder(spec.radius, spec.center, spec.axis), *ends))
        case BoxSpec():
            low, high = (np.array(spec.center) + side * np.array(spec.size) / 2 for side in (-1, 1))
            return box(tuple(low.tolist()), tuple(high.tolist()))
        case TriangulatedSpec():
            points, triangles = spec.surface
            turn = Rotation.from_rotvec(spec.rotation)
            return Space(turn.apply(spec.scale * points) + np.array(spec.position), triangles)


def image_of(region: Region | Space, matrix: Floats, middle: Floats) -> Region | Space:
    """What an orthogonal matrix (3, 3) about a point (3,) maps into a region."""
    if not isinstance(region, Space):
        return Image(region, matrix, middle)
    points = middle + (region.points - middle) @ matrix
    return Space(points, region.triangles if np.linalg.det(matrix) > 0 else region.triangles[:, ::-1])
