"""Pressures for a motion of the tip: the inverse of a body whose shape is given.

The squared distance from the wanted motion is minimised over the pressures within bounds by Gauss-Newton steps in a
trust region, each a linear least-squares problem with bounds (Branch, Coleman & Li 1999; `scipy.optimize.lsq_linear`).
The derivatives of the motion by the pressures are exact, by adjoints with the tangent that is factorised anyway, and so
are those of the forces with which the plate pushes where it is held. Of all pressures that are as near, those with the
least effort are found, by a small weight on their squares. Equilibria are sought from the nearest that are known, and
unstable ones count as none.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.optimize import lsq_linear

from pneumorph.analysis.explore import Explorer
from pneumorph.mechanics import Configuration, Equilibrium, NoEquilibrium, Tangent
from pneumorph.objective import HeldForce
from pneumorph.objective.objective import in_place_of_features
from pneumorph.problem.components import MOTIONS, PUSH, PUSHES
from pneumorph.sensitivity import motion_slopes, objective_slope

PER_RADIAN = np.degrees(1.0)
"""Millimetres that count as much as a radian: a degree counts as one."""

WANTED = MOTIONS + PUSHES
"""What may be wanted."""

PER_FORCE = 100.0
"""Millimetres that count as much as the whole of a force that is wanted: a hundredth of it counts as one."""

WITHIN, SHARE = 0.02, 0.005
"""Distance from the wanted motion at which it is reached: in mm, but at most this share of the motion itself."""

EFFORT, STILL = 2.5, 0.5
"""Weight of the whole range of a pressure, and the change of the distance that ends the search, relative to that."""

MOST, RESTARTS = 25, 4
"""Steps from a start, and further starts where the wanted motion is not reached."""


@dataclass(frozen=True)
class Reached:
    """The pressures whose motion, or force, is nearest to the wanted one.

    Attributes
    ----------
    pressures : {chamber: MPa}
    motion : (6,)
        Translation (mm) and rotation vector (rad) of the tip.
    pushes : {motion: float}
        Forces and moments with which the plate pushes where motions are held, N and N·mm.
    off : {motion: float}
        By how much each of the wanted motions and forces is missed, mm and rad, N and N·mm.
    distance : float
        The length of these, mm; a degree, and a hundredth of a force that is wanted, count as 1 mm.
    reached : bool
        Whether that is as good as none.
    nearer : float
        By how much the distance would become smaller at other pressures within the bounds, mm, if the motion were
        linear from here: 0 where the pressures are a nearest point to first order.
    at_bounds : tuple of str
        Chambers whose pressure is at a bound.
    by_pressure : (6, C)
        Derivatives of the motion, per MPa of each chamber.
    solves : int
        Equilibria that were sought.
    starts : int
        Pressures from which the search began.
    """

    pressures: Mapping[str, float]
    motion: np.ndarray
    pushes: Mapping[str, float]
    off: Mapping[str, float]
    distance: float
    reached: bool
    nearer: float
    at_bounds: tuple[str, ...]
    by_pressure: np.ndarray
    solves: int
    starts: int


@dataclass(frozen=True, eq=False)
class _Point:
    """Pressures as parts of their ranges (C,), the motion and forces (12,) there, which motions are held, and the
    derivatives (12, C) by these parts."""

    q: np.ndarray
    values: np.ndarray
    held: tuple[str, ...]
    slope: np.ndarray


class Reaching:
    """Finds pressures for motions, one after another: later searches begin near what is known by then.

    Parameters
    ----------
    explorer : of the body.
    bounds : {chamber: (lower, upper)}
        Pressures in MPa, the lower below the upper; chambers without bounds have no pressure.
    """

    def __init__(self, explorer: Explorer, bounds: Mapping[str, tuple[float, float]]) -> None:
        self._explorer, self._names = explorer, tuple(bounds)
        self._lower, self._upper = np.array(list(bounds.values()), float).reshape(-1, 2).T
        # Unlike pressures, so that all are solved on the same mesh whatever they are.
        self._like = dict(zip(self._names, self._lower + (self._upper - self._lower) * self._odd(), strict=True))
        self._points: list[_Point] = []
        self._solves = 0

    def _odd(self) -> np.ndarray:
        return 0.5 + 0.4 * (np.arange(len(self._names)) + 1) / (len(self._names) + 1)

    def reach(self, wanted: Mapping[str, float]) -> Reached | None:
        """The pressures for a motion or force, or those nearest to it; None where no equilibrium was found at all.

        Parameters
        ----------
        wanted : {name: float}
            Of `WANTED`, mm and rad, N and N·mm, where motions that are pushed against are held; the others are free.
        """
        before, goal = self._solves, _Goal(wanted)
        best, starts = None, 0
        for q in self._starts(goal):
            point = self._descend(goal, q)
            starts += 1
            if point is not None and (best is None or goal.distance(point) < goal.distance(best)):
                best = point
            if best is not None and goal.distance(best) <= goal.within:
                break
        return None if best is None else self._reached(goal, best, self._solves - before, starts)

    def _starts(self, goal: _Goal) -> Sequence[np.ndarray]:
        """Where to begin: at what is nearest, the pressures of tasks first of all, and then all over the ranges."""
        if not self._points:
            for pressures in self._explorer.known_pressures():
                q = (np.array([pressures.get(name, 0.0) for name in self._names]) - self._lower) / self._range
                self._point(np.clip(q, 0.0, 1.0))
        near = [min(self._points, key=goal.distance).q] if self._points else [np.clip(self._rest, 0.0, 1.0)]
        # Loaded here: it takes a third of a second, and few searches need it.
        from scipy.stats import qmc

        return [*near, *qmc.Sobol(len(self._names), rng=0).random(RESTARTS)]

    @property
    def _range(self) -> np.ndarray:
        return self._upper - self._lower

    @property
    def _rest(self) -> np.ndarray:
        """No pressure, as parts of the ranges."""
        return -self._lower / self._range

    def _descend(self, goal: _Goal, q: np.ndarray) -> _Point | None:
        point, radius = self._point(q), 0.5
        if point is None:
            return None
        for _ in range(MOST):
            matrix, rhs = goal.linear(point, self._rest)
            step = _step(point, matrix, rhs, radius)
            expected = float(rhs @ rhs - np.sum((rhs - matrix @ step) ** 2))
            if expected <= (STILL * goal.within) ** 2 or radius < 1e-4:
                break
            there = self._point(np.clip(point.q + step, 0.0, 1.0))
            gained = 0.0 if there is None else goal.merit(point, self._rest) - goal.merit(there, self._rest)
            longest = float(np.abs(step).max())
            if there is None or gained < 0.1 * expected:
                radius = 0.25 * longest
                if there is None or gained <= 0.0:
                    continue
            elif gained > 0.75 * expected:
                radius = max(radius, 2.0 * longest)
            point = there
        return point

    def _point(self, q: np.ndarray) -> _Point | None:
        """The motion at pressures; None without a stable equilibrium."""
        pressures = self._pressures(q)
        self._solves += 1
        at, answer, tangent = self._explorer.solved(pressures, self._like)
        if isinstance(answer, NoEquilibrium) or not answer.stable:
            return None
        values, by = _measured(at, tangent, answer)
        chambers = list(at.model.chambers)
        columns = [by[:, chambers.index(name)] if name in chambers else np.zeros(len(by)) for name in self._names]
        held = tuple(name for name, is_held in zip(MOTIONS, at.blocked, strict=True) if is_held)
        point = _Point(q, values, held, np.column_stack(columns) * self._range)
        self._points.append(point)
        return point

    def _pressures(self, q: np.ndarray) -> dict[str, float]:
        return dict(zip(self._names, (self._lower + self._range * q).tolist(), strict=True))

    def _reached(self, goal: _Goal, point: _Point, solves: int, starts: int) -> Reached:
        at_bounds = tuple(
            name
            for name, q, rest in zip(self._names, point.q, self._rest, strict=True)
            if (q <= 1e-9 and abs(rest) > 1e-9) or q >= 1.0 - 1e-9
        )
        matrix, rhs = goal.linear(point)
        left = float(np.linalg.norm(rhs - matrix @ _step(point, matrix, rhs, 1.0)))
        return Reached(
            self._pressures(point.q),
            point.values[: len(MOTIONS)],
            {name: float(point.values[WANTED.index(PUSH + name)]) for name in point.held},
            dict(zip(goal.names, goal.off(point), strict=True)),
            goal.distance(point),
            goal.distance(point) <= goal.within,
            max(goal.distance(point) - left, 0.0),
            at_bounds,
            point.slope[: len(MOTIONS)] / self._range,
            solves,
            starts,
        )


def _measured(at: Configuration, tangent: Tangent, answer: Equilibrium) -> tuple[np.ndarray, np.ndarray]:
    """Motion and forces (12,) at an equilibrium, and their derivatives (12, C) by the pressures of all chambers."""
    slopes = motion_slopes(at, tangent, answer.state)
    by = [np.asarray(load.pressure) for load in slopes.loads]
    values = list(slopes.motion)
    for name, held in zip(MOTIONS, at.blocked, strict=True):
        force, slope = 0.0, np.zeros(len(at.model.chambers))
        if held:
            rate = objective_slope(at, tangent, answer, in_place_of_features(HeldForce(name, 1.0)))
            force, slope = rate.value, np.array([rate.pressure[chamber] for chamber in at.model.chambers])
        values.append(force)
        by.append(slope)
    return np.array(values), np.array(by)


def _step(point: _Point, matrix: np.ndarray, rhs: np.ndarray, radius: float) -> np.ndarray:
    """The step (C,) of the parts of ranges that makes |A s − b| smallest, within the bounds and a radius."""
    low, high = np.maximum(-point.q, -radius), np.minimum(1.0 - point.q, radius)
    return lsq_linear(matrix, rhs, (np.minimum(low, -1e-12), np.maximum(high, 1e-12)), tol=1e-12).x


class _Goal:
    """Wanted motions and forces, and how far points are from them."""

    def __init__(self, wanted: Mapping[str, float]):
        self.names = tuple(wanted)
        self._rows = [WANTED.index(name) for name in self.names]
        self._values = np.array(list(wanted.values()))
        self._scale = np.array([self._scale_of(name, value) for name, value in wanted.items()])
        size = float(np.linalg.norm(self._scale * self._values))
        self.within = min(WITHIN, SHARE * size) if size else WITHIN

    def off(self, point: _Point) -> np.ndarray:
        """What each wanted motion and force is missed by, mm and rad, N and N·mm."""
        return point.values[self._rows] - self._values

    def distance(self, point: _Point) -> float:
        """In mm."""
        return float(np.linalg.norm(self._scale * self.off(point)))

    def merit(self, point: _Point, rest: np.ndarray) -> float:
        """What is minimised: the squared distance, and a little effort."""
        return self.distance(point) ** 2 + self._effort**2 * float(np.sum((point.q - rest) ** 2))

    def linear(self, point: _Point, rest: np.ndarray | None = None) -> tuple[np.ndarray, np.ndarray]:
        """A and b of the merit |A s − b|² after a step s of the parts, with a motion that is linear in it; without
        effort, if no pressures at rest are given."""
        slope = self._scale[:, None] * point.slope[self._rows]
        if rest is None:
            return slope, -self._scale * self.off(point)
        matrix = np.vstack([slope, self._effort * np.eye(len(point.q))])
        return matrix, np.concatenate([-self._scale * self.off(point), -self._effort * (point.q - rest)])

    def _scale_of(self, name: str, value: float) -> float:
        """Millimetres that count as much as one mm, rad, N or N·mm."""
        if name in MOTIONS:
            return 1.0 if MOTIONS.index(name) < 3 else PER_RADIAN
        # Of none that is wanted, one newton or newton millimetre stands for the whole.
        return PER_FORCE / (abs(value) or 1.0)

    @property
    def _effort(self) -> float:
        return EFFORT * self.within
