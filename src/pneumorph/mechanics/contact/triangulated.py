"""Rigid bodies with a surface of triangles: the barrier of other obstacles, on the distances from the triangles.

    E = Σ_q w_q B(x_q),   B(x) = Σ_parts ± b(d)

over the sample points of the body's surface and the near parts of the obstacle's (`facets.py`). Which parts are near
changes with the state, so this is evaluated beside the terms, as contact in pairs is (`pairs.py`).
"""

from __future__ import annotations

from functools import cached_property

import numpy as np
from scipy import sparse

from pneumorph.cad.shells import windings
from pneumorph.mechanics.contact.barrier import barrier_derivatives
from pneumorph.mechanics.contact.facets import Facets, Parts, firsts
from pneumorph.mechanics.contact.obstacle import AREA, FORCE, FULL, NORMAL, Obstacle
from pneumorph.mechanics.contact.recent import Recent
from pneumorph.mechanics.contact.samples import SAMPLE_DN, SAMPLE_N, SAMPLE_WEIGHTS
from pneumorph.mechanics.contact.shapes import RigidMesh, Support
from pneumorph.mechanics.elements.terms import Connectivity, Values


class Triangulated(Obstacle):
    """An obstacle of triangles beside a body.

    Parameters
    ----------
    surface : Connectivity
        The faces of the body; see `samples.surface_of`.
    mesh : RigidMesh
        The obstacle's closed surface, counter-clockwise seen from outside.
    activation, stiffness : float
        The activation distance d̂ in mm, and the stiffness κ of the barrier in MPa.
    center : (3,)
        About what it turns.
    """

    def __init__(
        self,
        surface: Connectivity,
        mesh: RigidMesh,
        activation: float,
        stiffness: float,
        center: Values = (0.0, 0.0, 0.0),
    ):
        # Imported here because most bodies touch nothing.
        import ipctk

        self.facets, self.mesh = Facets(mesh), mesh
        self.activation, self.stiffness, self.center = activation, stiffness, np.array(center)
        self.faces = surface.nodes[: surface.count]
        count, (nodes, corner) = len(self.faces), np.unique(self.faces, return_inverse=True)
        corner = corner.reshape(-1, 6)
        # Six of the seven sample points of a face are its nodes, which it shares with others.
        self.samples = np.column_stack([corner, len(nodes) + np.arange(count)])
        self.area = np.bincount(self.samples.ravel(), surface.data[:count].ravel())
        row = np.concatenate([np.arange(len(nodes)), np.repeat(len(nodes) + np.arange(count), 6)])
        column = np.concatenate([np.arange(len(nodes)), corner.ravel()])
        value = np.concatenate([np.ones(len(nodes)), np.tile(SAMPLE_N[6], count)])
        self.nodes = nodes
        self.at_samples = sparse.csr_array((value, (row, column)), shape=(len(self.area), len(nodes)))
        self._firsts = firsts(self.faces), firsts(mesh.triangles)
        moving = len(self.area)
        self._beside = ipctk.CollisionMesh(
            np.asfortranarray(np.concatenate([np.zeros((moving, 3)), mesh.points])),
            np.asfortranarray((self.facets.edges + moving).astype(np.int32)),
            np.asfortranarray((mesh.triangles + moving).astype(np.int32)),
        )
        self._beside.can_collide = ipctk.make_vertex_patches_filter(np.arange(moving + len(mesh.points)) >= moving)
        self._touched = Recent(lambda x: TriangulatedTouch(self, x))
        self.touch = self._touched

    def places(self, x: np.ndarray) -> np.ndarray:
        """The sample points (P, 3) with nodes at x (N, 3)."""
        return self.at_samples @ x[self.nodes]

    def pressures(self, places: np.ndarray) -> np.ndarray:
        flat = places.reshape(-1, 3)
        near, pressures = self.facets.near(flat, self.activation), np.zeros(flat.shape)
        slope = barrier_derivatives(near.distance, self.activation, self.stiffness)[1]
        np.add.at(pressures, near.place, -(near.sign * slope)[:, None] * near.away)
        return pressures.reshape(places.shape)

    def free_share(self, start: np.ndarray, end: np.ndarray) -> float:
        import ipctk

        ends = [np.asfortranarray(np.concatenate([self.places(x), self.mesh.points])) for x in (start, end)]
        return float(ipctk.compute_collision_free_stepsize(self._beside, *ends, narrow_phase_ccd=ipctk.AdditiveCCD()))

    def apart(self, x: np.ndarray) -> bool:
        """Whether neither is inside the other, if the triangles of `Pairs` do not meet."""
        own, mesh = self._firsts
        around = [windings(self.mesh.points[self.mesh.triangles], place) for place in x[own]]
        around += [windings(x[self.faces[:, :3]], place) for place in self.mesh.points[mesh]]
        return max(around) < 0.5 and self.facets.near(self.places(x), self.activation).clear

    def pressed(self, x: np.ndarray) -> np.ndarray:
        touch = self._touched(x)
        return np.array([*touch.slope.sum(axis=0), touch.normal, touch.touching()[0]])

    def pressed_back(self, x: np.ndarray, bars: np.ndarray) -> np.ndarray:
        touch = self._touched(x)
        normal, area = touch.normal_slope(), touch.touching()[1]
        along = (touch.product(np.broadcast_to(bar[FORCE], area.shape)) for bar in bars)
        return np.stack([each + bar[NORMAL] * normal + bar[AREA] * area for each, bar in zip(along, bars, strict=True)])

    def around(self, sag: float) -> RigidMesh:
        return self.mesh

    def support(self, sag: float) -> Support:
        return self.mesh.support()

    def lever(self) -> np.ndarray:
        return self.mesh.middle() - self.center


class TriangulatedTouch:
    """The energy of contact with an obstacle of triangles at one state with its derivatives; see `PairsTouch`."""

    def __init__(self, obstacle: Triangulated, x: np.ndarray):
        self._obstacle, self._x = obstacle, x
        self._near: Parts = obstacle.facets.near(obstacle.places(x), obstacle.activation)
        self._barrier = barrier_derivatives(self._near.distance, obstacle.activation, obstacle.stiffness)
        self._weight = obstacle.area[self._near.place] * self._near.sign

    @property
    def nothing(self) -> bool:
        """Whether the body is not near it."""
        return not len(self._near.place)

    @cached_property
    def energy(self) -> float:
        """N·mm; not a number where surfaces have met."""
        return float(self._weight @ self._barrier[0]) if self._near.clear else float("nan")

    @cached_property
    def slope(self) -> np.ndarray:
        """Derivatives (N, 3) of the energy by the places of all nodes, N: what they press with."""
        return self._on_nodes((self._weight * self._barrier[1])[:, None] * self._near.away)

    @cached_property
    def hessian(self) -> sparse.csr_array:
        """Second derivatives (3N, 3N), N/mm."""
        obstacle, near, (_, slope, curve) = self._obstacle, self._near, self._barrier
        size = self._x.size
        if self.nothing:
            return sparse.csr_array((size, size))
        along = near.away[:, :, None] * near.away[:, None, :]
        bent = (slope / near.distance)[:, None, None] * (near.across - along)
        blocks = self._weight[:, None, None] * (curve[:, None, None] * along + bent)
        points, which = np.unique(near.place, return_inverse=True)
        summed = np.zeros((len(points), 3, 3))
        np.add.at(summed, which, blocks)
        middle = sparse.bsr_array((summed, np.arange(len(points)), np.arange(len(points) + 1)))
        by = sparse.kron(obstacle.at_samples[points], sparse.eye_array(3), format="csr")
        hessian = sparse.coo_array(by.T @ middle @ by)
        place = (3 * obstacle.nodes[:, None] + np.arange(3)).ravel()
        row, column = hessian.coords
        return sparse.csr_array((hessian.data, (place[row], place[column])), shape=(size, size))

    def product(self, motion: np.ndarray) -> np.ndarray:
        """The change (N, 3) of `slope` along a motion (N, 3) of the nodes."""
        return (self.hessian @ motion.ravel()).reshape(-1, 3)

    @property
    def normal(self) -> float:
        """The sum of the normal forces, N."""
        return float(-self._weight @ self._barrier[1])

    def normal_slope(self) -> np.ndarray:
        """Its derivatives (N, 3) by the places of the nodes."""
        return self._on_nodes(-(self._weight * self._barrier[2])[:, None] * self._near.away)

    def touching(self) -> tuple[float, np.ndarray]:
        """The area that touches, mm², and its derivatives (N, 3) by the places of the nodes; see `pressing.py`."""
        obstacle, near, (row, face, sample) = self._obstacle, self._near, self._users
        slopes = np.einsum("fai,rak->kfri", self._x[obstacle.faces], SAMPLE_DN)
        along, across = SAMPLE_WEIGHTS[sample, None] * slopes[0, face, sample], slopes[1, face, sample]
        area, away = np.cross(along, across), near.away[row]
        size = np.linalg.norm(area, axis=1)
        facing = np.maximum(-np.einsum("ri,ri->r", area, away), 0.0)
        span = (1.0 - FULL) * obstacle.activation
        share = np.clip((obstacle.activation - near.distance[row]) / span, 0.0, 1.0)
        fade, rise = share**3 * (10.0 - 15.0 * share + 6.0 * share**2), 30.0 * share**2 * (1.0 - share) ** 2 / span
        sign = near.sign[row]
        value = float(np.sum(sign * fade * facing**2 / size))
        # By the place of the sample point: the distance and its gradient change.
        turned = np.einsum("rij,rj->ri", near.across[row], area) + facing[:, None] * away
        by_place = -(sign * rise * facing**2 / size)[:, None] * away
        by_place -= (2.0 * sign * fade * facing / size / near.distance[row])[:, None] * turned
        by_area = -(sign * fade * facing / size)[:, None] * (2.0 * away + (facing / size**2)[:, None] * area)
        by = self._on_nodes(by_place, row)
        bars = np.stack([SAMPLE_WEIGHTS[sample, None] * np.cross(across, by_area), np.cross(by_area, along)], axis=-1)
        np.add.at(by, obstacle.faces[face], np.einsum("rik,rak->rai", bars, SAMPLE_DN[sample]))
        return value, by

    @cached_property
    def _users(self) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Rows of the near parts with all faces, and the number of the sample point in each, that have their point."""
        flat = self._obstacle.samples.ravel()
        order = np.argsort(flat, kind="stable")
        start = np.searchsorted(flat[order], self._near.place)
        count = np.searchsorted(flat[order], self._near.place, side="right") - start
        row = np.repeat(np.arange(len(count)), count)
        within = np.arange(len(row)) - np.repeat(np.cumsum(count) - count, count)
        return row, *np.divmod(order[start[row] + within], self._obstacle.samples.shape[1])

    def _on_nodes(self, vectors: np.ndarray, row: np.ndarray | None = None) -> np.ndarray:
        """Vectors at the places of near parts, or of those in `row`, as vectors (N, 3) on the nodes."""
        obstacle, by = self._obstacle, np.zeros(self._x.shape)
        at = np.zeros((len(obstacle.area), 3))
        np.add.at(at, self._near.place if row is None else self._near.place[row], vectors)
        by[obstacle.nodes] = obstacle.at_samples.T @ at
        return by
