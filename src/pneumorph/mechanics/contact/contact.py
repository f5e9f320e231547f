"""What the surface of a body may touch: energies beside the terms, and steps on which nothing meets."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from scipy import sparse

from pneumorph.mechanics.contact.free import Free, gaps, share_above
from pneumorph.mechanics.contact.obstacle import Obstacle
from pneumorph.mechanics.contact.pairs import Pairs, PairsTouch
from pneumorph.mechanics.contact.pose import STILL, View
from pneumorph.mechanics.contact.triangulated import TriangulatedTouch
from pneumorph.mechanics.elements.terms import Connectivity

MOST_TURN = 0.1
"""Largest turn of an obstacle in a step, rad."""

STILL_VIEW = View(np.zeros(3), STILL)
"""How the body sees itself."""


class PosedTouch:
    """A touch with its derivatives by the places of the nodes and by the pose of the obstacle that sees it."""

    def __init__(self, touch: PairsTouch | TriangulatedTouch, view: View, x: np.ndarray):
        self._touch, self._view, self._x = touch, view, x

    @property
    def energy(self) -> float:
        """N·mm; not a number where surfaces have met."""
        return self._touch.energy

    @cached_property
    def slope(self) -> np.ndarray:
        """Derivatives (N, 3) of the energy by the places of all nodes, N: what they press with."""
        return self._view.directed(self._touch.slope)

    @cached_property
    def hessian(self) -> sparse.csr_array:
        """Second derivatives (3N, 3N), N/mm, by the places of the nodes."""
        hessian = self._touch.hessian
        if not self._view.turned or self._touch.nothing:
            return hessian
        blocks = sparse.bsr_array(hessian, blocksize=(3, 3))
        turn = self._view.rotation
        data = np.einsum("ia,kab,jb->kij", turn, blocks.data, turn)
        return sparse.csr_array(sparse.bsr_array((data, blocks.indices, blocks.indptr), shape=hessian.shape))

    @property
    def by_pose(self) -> np.ndarray:
        """Derivatives (6,) of the energy by the pose, N and N·mm."""
        return self._view.by_pose(self._x, self._touch.slope)

    def change(self, dx: np.ndarray, dpose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How `slope`, and the derivative (6,) by the pose, change along dx (N, 3) and dpose (6,)."""
        return self._view.change(self._x, self._touch.slope, self._touch.product, dx, dpose)


@dataclass(frozen=True, eq=False)
class Contact:
    """What the surface of a body may touch.

    Attributes
    ----------
    surface : Connectivity
        Its faces; the data are areas at their sample points.
    obstacles : dict of Obstacle by name
        Rigid bodies.
    guards : dict of Pairs by name of an obstacle
        The body's surface and triangles around the obstacle, for what reaches in between the sample points.
    own : Pairs or None
        The body's surface and itself, if it may touch itself.
    free : dict of Free by name of an obstacle
        Those that are free, in the order of their unknowns.
    """

    surface: Connectivity
    obstacles: Mapping[str, Obstacle]
    guards: Mapping[str, Pairs]
    own: Pairs | None
    free: Mapping[str, Free] = field(default_factory=dict)

    @property
    def changes(self) -> bool:
        """Whether there is contact whose connectivity changes with the state."""
        beside = any(each.touch is not None for each in self.obstacles.values())
        return beside or bool(self.guards) or self.own is not None or bool(self.free)

    @cached_property
    def rows(self) -> list[int]:
        """The numbers of the free obstacles."""
        return [list(self.obstacles).index(name) for name in self.free]

    def poses(self, shift: np.ndarray, objects: np.ndarray) -> np.ndarray:
        """The poses (K, 6) of all obstacles, from the given ones and the unknowns (J, 6) of those that are free."""
        poses = np.array(shift, dtype=float)
        poses[self.rows] += objects
        return poses

    def views(self, poses: np.ndarray) -> list[View]:
        """How every obstacle sees the body, at poses (K, 6)."""
        return [View(each.center, pose) for each, pose in zip(self.obstacles.values(), poses, strict=True)]

    def touches(self, x: np.ndarray, poses: np.ndarray) -> Iterator[tuple[PosedTouch, int | None]]:
        """All contact whose connectivity changes with the state, with nodes at x (N, 3) and obstacles at poses (K, 6).

        With the number of the obstacle, None where the body touches itself.
        """
        for number, (name, view) in enumerate(zip(self.obstacles, self.views(poses), strict=True)):
            own, guard = self.obstacles[name].touch, self.guards.get(name)
            for touch in (own, guard and guard.touch):
                if touch is not None:
                    yield PosedTouch(touch(view.in_frame(x)), view, x), number
        if self.own is not None:
            yield PosedTouch(self.own.touch(x), STILL_VIEW, x), None

    def _kept_apart(self, poses: np.ndarray) -> Iterator[tuple[Obstacle | Pairs, View]]:
        """All that must not meet the body, and how it sees that, where obstacles are at poses (K, 6)."""
        for (name, obstacle), view in zip(self.obstacles.items(), self.views(poses), strict=True):
            yield obstacle, view
            if name in self.guards:
                yield self.guards[name], view
        if self.own is not None:
            yield self.own, STILL_VIEW

    def apart(self, x: np.ndarray, poses: np.ndarray) -> bool:
        """Whether nothing interpenetrates with nodes at x (N, 3) and obstacles at poses (K, 6)."""
        above = bool(np.all(gaps(self.obstacles, self.free, self.views(poses)) > 0.0))
        return above and all(each.apart(view.in_frame(x)) for each, view in self._kept_apart(poses))

    def apart_at_rest(self, X: np.ndarray) -> bool:
        """The same with undeformed nodes at X (N, 3) and obstacles in their places."""
        return self.apart(X, np.zeros((len(self.obstacles), 6)))

    def free_share(self, start: np.ndarray, end: np.ndarray, poses: np.ndarray, there: np.ndarray) -> float:
        """A share of the motion of the nodes from `start` to `end` (N, 3) on which nothing meets.

        Obstacles move from poses (K, 6) to those `there`. Every one sees the nodes go straight ahead, and no one turns
        by more than `MOST_TURN`, within which that is nearly so.

        Parameters
        ----------
        start, end : (N, 3) array
            Places of the nodes, mm.
        poses, there : (K, 6) array
            Poses of the obstacles before and after, mm and rad.
        """
        turn = np.linalg.norm((there - poses)[:, 3:], axis=1).max(initial=0.0)
        shares = [1.0 if turn <= MOST_TURN else float(MOST_TURN / turn)]
        shares.append(share_above(*(gaps(self.obstacles, self.free, self.views(each)) for each in (poses, there))))
        for (each, view), (_, after) in zip(self._kept_apart(poses), self._kept_apart(there), strict=True):
            shares.append(each.free_share(view.in_frame(start), after.in_frame(end)))
        return min(shares)
