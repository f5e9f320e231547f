"""Contact of the body's surface with itself and with rigid meshes, by incremental potential contact (Li et al. 2020).

Every quadratic face counts as the four flat triangles of its six nodes. The energy is a sum over pairs of their
corners, edges and faces that are nearer to each other than the activation distance (from ipctk). Which pairs these are
changes with the state, so unlike other terms this one has no connectivity of its own: `Pairs.touch` looks for them at
every state. The weights of the pairs are areas of the mesh as it was made, constants like its connectivity: the energy
depends on places x = X + u alone, and its mixed derivative by u and X is its Hessian.
"""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from typing import TYPE_CHECKING

import numpy as np
from scipy import sparse

from pneumorph.mechanics.contact.recent import Recent
from pneumorph.mechanics.contact.shapes import RigidMesh
from pneumorph.mechanics.contact.skin import collision_mesh
from pneumorph.mechanics.elements.terms import Connectivity
from pneumorph.mesh import Unfolded

if TYPE_CHECKING:
    import ipctk

FLAT = np.array([[0, 3, 5], [3, 1, 4], [5, 4, 2], [3, 4, 5]])
"""The flat triangles of a six-node triangle, with its orientation."""

PER_PAIR = 1 / 20
"""Between two parallel surfaces a point has that many near parts: with this factor κ means the same as for obstacles,
a pressure of about 1.2 κ at half the activation distance. (ipctk's sets with fewer pairs are not continuous: their
energies jump by up to 0.1 %.)"""


class Pairs:
    """Parts of surfaces that may touch each other: the body's with itself, or with rigid meshes, or both.

    Parameters
    ----------
    surface : Connectivity
        The faces of the body.
    X : (N, 3) array
        Nodes of the mesh as it was made. Where parts of its surface are nearer to each other than the activation
        distance, that is made half as long as the least such distance: nothing presses on itself at rest.
    own : bool
        Whether the body's surface may touch itself.
    rigid : sequence of RigidMesh
    activation, stiffness : float
        The activation distance d̂ in mm, and the stiffness κ of the barrier in MPa.
    image : Unfolded, optional
        The whole body of a sector, whose surface this is: each sector has its share of the energy.
    """

    def __init__(
        self,
        surface: Connectivity,
        X: np.ndarray,
        own: bool,
        rigid: Sequence[RigidMesh],
        activation: float,
        stiffness: float,
        image: Unfolded | None = None,
    ):
        # Imported here because most bodies touch nothing.
        import ipctk

        self._given = activation, stiffness
        faces = surface.nodes[: surface.count][:, FLAT].reshape(-1, 3)
        nodes, corners = np.unique(faces, return_inverse=True)
        self._moving, source, turn = len(nodes), nodes, np.tile(np.eye(3), (len(nodes), 1, 1))
        self._share = 1.0
        if image is not None:
            source, turn, self._share = image.source[nodes], image.turn[nodes], 1.0 / image.copies
        columns = np.repeat(3 * source[:, None] + np.arange(3), 3, axis=0)
        # The places of its corners by those of the nodes.
        self._by = sparse.csr_array(
            (turn.ravel(), columns.ravel(), 3 * np.arange(3 * self._moving + 1)), (3 * self._moving, X.size)
        )
        self._by.eliminate_zeros()
        starts = self._moving + np.cumsum([0, *(len(each.points) for each in rigid)])
        triangles = np.concatenate(
            [corners.reshape(-1, 3), *(each.triangles + start for each, start in zip(rigid, starts, strict=False))]
        )
        self._rigid = np.concatenate([np.zeros((0, 3)), *(each.points for each in rigid)])
        self._activation = activation
        self._mesh = collision_mesh(self._places(X), triangles)
        moving = self._moving
        only_others = ipctk.make_vertex_patches_filter(np.arange(starts[-1]) >= moving)
        self._mesh.can_collide = ipctk.make_static_obstacle_filter(moving) if own else only_others
        neighbours = self._near(self._places(X))
        if own and not neighbours.empty():
            # ipctk gives the square of the distance.
            self._activation = 0.5 * neighbours.compute_minimum_distance(self._mesh, self._places(X)) ** 0.5
        self._potential = ipctk.BarrierPotential(self._activation, PER_PAIR * stiffness, True)
        self.touch = Recent(lambda x: PairsTouch(self, x.shape[0], self._places(x)))
        """The contact with nodes at x (N, 3)."""

    def of_whole(self, surface: Connectivity, X: np.ndarray) -> Pairs:
        """The same of the whole body of a sector, with its faces and nodes (N, 3)."""
        return Pairs(surface, X, True, [], *self._given)

    def _places(self, x: np.ndarray) -> np.ndarray:
        return np.asfortranarray(np.concatenate([(self._by @ x.ravel()).reshape(-1, 3), self._rigid]))

    def _near(self, places: np.ndarray) -> ipctk.NormalCollisions:
        import ipctk

        collisions = ipctk.NormalCollisions()
        collisions.use_area_weighting = True
        collisions.build(self._mesh, places, self._activation)
        return collisions

    def free_share(self, start: np.ndarray, end: np.ndarray) -> float:
        """A share of the straight motion of the nodes from `start` to `end` (N, 3) on which nothing meets."""
        import ipctk

        ends = self._places(start), self._places(end)
        return float(ipctk.compute_collision_free_stepsize(self._mesh, *ends, narrow_phase_ccd=ipctk.AdditiveCCD()))

    def apart(self, x: np.ndarray) -> bool:
        """Whether no surface goes through another with nodes at x (N, 3)."""
        import ipctk

        return not ipctk.has_intersections(self._mesh, self._places(x))


class PairsTouch:
    """The energy of contact in pairs at one state with its derivatives; what has not been asked for is not computed."""

    def __init__(self, pairs: Pairs, count: int, places: np.ndarray):
        self._pairs, self._count, self._at = pairs, count, places
        self._collisions = pairs._near(places)

    @property
    def nothing(self) -> bool:
        """Whether no surfaces are near each other."""
        return self._collisions.empty()

    @cached_property
    def energy(self) -> float:
        """N·mm."""
        pairs = self._pairs
        return 0.0 if self.nothing else pairs._share * float(pairs._potential(self._collisions, pairs._mesh, self._at))

    @cached_property
    def slope(self) -> np.ndarray:
        """Derivatives (N, 3) of the energy by the places of all nodes, N: what they press with."""
        pairs = self._pairs
        if self.nothing:
            return np.zeros((self._count, 3))
        slope = pairs._potential.gradient(self._collisions, pairs._mesh, self._at)[: 3 * pairs._moving]
        return pairs._share * (pairs._by.T @ slope).reshape(-1, 3)

    @cached_property
    def hessian(self) -> sparse.csr_array:
        """Second derivatives (3N, 3N), N/mm."""
        pairs, size, moving = self._pairs, 3 * self._count, 3 * self._pairs._moving
        if self.nothing:
            return sparse.csr_array((size, size))
        hessian = sparse.coo_array(pairs._potential.hessian(self._collisions, pairs._mesh, self._at))
        row, column = hessian.coords
        some = (row < moving) & (column < moving) & (hessian.data != 0.0)
        values = pairs._share * hessian.data[some]
        by_corners = sparse.csr_array((values, (row[some], column[some])), shape=(moving, moving))
        return sparse.csr_array(pairs._by.T @ by_corners @ pairs._by)

    def product(self, motion: np.ndarray) -> np.ndarray:
        """The change (N, 3) of `slope` along a motion (N, 3) of the nodes."""
        return (self.hessian @ motion.ravel()).reshape(-1, 3)
