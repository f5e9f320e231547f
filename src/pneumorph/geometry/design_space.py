"""The design variables, and the constant linear map from them to control points, pressures, sheets and fibres."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray
from scipy import sparse

from pneumorph.geometry.body import Body
from pneumorph.problem.designed import designed, reinforcements
from pneumorph.problem.reinforcement import data_of
from pneumorph.problem.variable import Variable
from pneumorph.symmetry.basis import column_squares

if TYPE_CHECKING:
    from pneumorph.problem import Problem

Array = NDArray[np.float64]
ByTask = Mapping[str, Mapping[str, float]]

# The whole range of a variable that is no shape in mm of Φ: a step of 0.2 mm changes it by a tenth of its range.
SPAN = 2.0

_ROUNDING = 1e-12  # mm of Φ that rounding errors of a step may leave between a variable and its bound


@dataclass(frozen=True)
class FreePressure:
    """A pressure that is designed along with the shape: its task, its chamber, and its scale in mm of Φ per MPa.

    `shared` are the other chambers that have it, and `others` other tasks with the pressures of this one.
    """

    task: str
    chamber: str
    scale: float
    shared: tuple[str, ...] = ()
    others: tuple[str, ...] = ()

    @property
    def chambers(self) -> tuple[str, ...]:
        """All chambers that have it."""
        return (self.chamber, *self.shared)

    @property
    def tasks(self) -> tuple[str, ...]:
        """All tasks in which they have it."""
        return (self.task, *self.others)


@dataclass(frozen=True)
class FreeDatum:
    """A stiffness, coverage or winding angle of a sheet or of fibres that is designed along with the shape.

    Attributes
    ----------
    name, key : str
        That of its table, and its key there.
    place : (int, int)
        Where it is in `Loads.reinforcement`.
    start, scale : float
        Its value at the start in N/mm, 1 or rad, and its scale in mm of Φ.
    """

    name: str
    key: str
    place: tuple[int, int]
    start: float
    scale: float


@dataclass(frozen=True, eq=False)
class DesignSpace:
    """The design variables Φ = [shape in mm, free pressures scaled to mm, free data of sheets and fibres scaled to mm].

    Control points are P = L Φ + offset: some of their coordinates are fixed, and some move together. For a symmetric
    design Φ holds the independent variables only, and L carries them to all images. The columns of L are orthogonal, so
    LᵀL is diagonal.

    Attributes
    ----------
    reference : Body
        The starting body.
    L : csr (3·n_points, n_shape)
        One row per coordinate of the control points, point by point (x, y, z).
    offset : (3·n_points,) array
        Fixed coordinates in mm.
    start, lower, upper : (n,) arrays
        Φ of the reference body, and the bounds of Φ. Those of the shape are mostly infinite.
    free_pressures : tuple of FreePressure
    free_data : tuple of FreeDatum
        The last entries of Φ, in this order, after those of the pressures.
    fixed_pressures : {task: {chamber: MPa}}
    reinforcements : int
        Number of sheets and fibres.
    """

    reference: Body
    L: sparse.csr_matrix
    offset: Array
    start: Array
    lower: Array
    upper: Array
    free_pressures: tuple[FreePressure, ...]
    free_data: tuple[FreeDatum, ...]
    fixed_pressures: Mapping[str, Mapping[str, float]]
    reinforcements: int

    @property
    def n(self) -> int:
        """Number of variables."""
        return len(self.start)

    @property
    def n_shape(self) -> int:
        """Number of variables that move control points; the rest are pressures, and data of sheets and fibres."""
        return len(self.start) - len(self.free_pressures) - len(self.free_data)

    def within_bounds(self, phi: Array) -> Array:
        """Φ (n,) with every variable within its bounds, and at one from which it is no farther than rounding errors."""
        above = np.where(phi > self.lower + _ROUNDING, phi, self.lower)
        return np.where(above < self.upper - _ROUNDING, above, self.upper)

    def control_points(self, phi: Array) -> Array:
        """Control points (n_points, 3) in mm."""
        return (self.L @ phi[: self.n_shape] + self.offset).reshape(-1, 3)

    def body(self, phi: Array) -> Body:
        """The body that Φ describes."""
        return self.reference.with_control_points(self.control_points(phi))

    def departure(self, body: Body) -> float:
        """Largest distance in mm of a body's control points from where its nearest body in this space has them."""
        away = body.control_points().ravel() - self.offset
        nearest = self.L @ ((self.L.T @ away) / column_squares(self.L))
        return float(np.linalg.norm((away - nearest).reshape(-1, 3), axis=1).max())

    def pressures(self, phi: Array) -> dict[str, dict[str, float]]:
        """Pressure in MPa of every chamber in every task, fixed and free."""
        result = {task: dict(chambers) for task, chambers in self.fixed_pressures.items()}
        for free, value in zip(self.free_pressures, phi[self.n_shape : self._data.start], strict=True):
            for task in free.tasks:
                result[task] |= dict.fromkeys(free.chambers, float(value) / free.scale)
        return result

    def data(self, phi: Array) -> dict[str, dict[str, float]]:
        """What is designed of sheets and fibres, by their names and by key, in N/mm, 1 and rad."""
        result: dict[str, dict[str, float]] = {}
        for free, value in zip(self.free_data, phi[self._data], strict=True):
            result.setdefault(free.name, {})[free.key] = float(value) / free.scale
        return result

    def reinforcement(self, phi: Array) -> Array:
        """The changes (R, 2) of all sheets and fibres since the start, as in `Loads.reinforcement`."""
        result = np.zeros((self.reinforcements, 2))
        for free, value in zip(self.free_data, phi[self._data], strict=True):
            result[free.place] = value / free.scale - free.start
        return result

    @property
    def _data(self) -> slice:
        return slice(len(self.start) - len(self.free_data), len(self.start))

    def pullback(self, dP: Array, dp: ByTask | None = None, reinforcement: Array | None = None) -> Array:
        """Gradient with respect to Φ from those with respect to control points, pressures, sheets and fibres.

        Parameters
        ----------
        dP : (n_points, 3) array
            Derivatives with respect to the control points' coordinates, per mm.
        dp : {task: {chamber: float}}, optional
            Derivatives with respect to the pressures, per MPa; missing ones are zero.
        reinforcement : (R, 2) array, optional
            Derivatives with respect to what `Loads.reinforcement` changes of sheets and fibres; zero by default.

        Returns
        -------
        (n,) array
        """
        dp = dp or {}
        by_pressure = [
            sum(dp.get(task, {}).get(chamber, 0.0) for task in free.tasks for chamber in free.chambers) / free.scale
            for free in self.free_pressures
        ]
        by_datum = [0.0 if reinforcement is None else reinforcement[free.place] / free.scale for free in self.free_data]
        return np.concatenate([self.L.T @ np.asarray(dP, dtype=float).ravel(), by_pressure, by_datum])


@dataclass(frozen=True, eq=False)
class ShapeVariables:
    """The variables of a shape, L v + offset: which coordinates of control points move, and which move together.

    Attributes
    ----------
    L, offset : see `DesignSpace`
    start, lower, upper : (n_shape,) arrays
        Values of the starting body, and bounds.
    """

    L: sparse.csr_matrix
    offset: Array
    start: Array
    lower: Array
    upper: Array


def tied_coordinates(coordinates: Array, variable: NDArray[np.int64]) -> ShapeVariables:
    """The variables of coordinates (m,) of which each has an index (m,): the same if they are equal, −1 if fixed."""
    moving = np.flatnonzero(variable >= 0)
    shape = len(variable), int(variable.max(initial=-1)) + 1
    L = sparse.csr_matrix((np.ones(len(moving)), (moving, variable[moving])), shape=shape)
    start = (L.T @ coordinates) / column_squares(L)
    free = np.full(shape[1], np.inf)
    return ShapeVariables(L, np.where(variable < 0, coordinates, 0.0), start, -free, free)


def build_space(problem: Problem, body: Body, shape: ShapeVariables) -> DesignSpace:
    """The design variables of a problem, those of the shape of its starting body first."""
    pressures, data, variables = [], [], []
    fixed: dict[str, dict[str, float]] = {}
    for task in problem.task:
        fixed[task.name] = {}
        for chamber, pressure in task.pressure.items():
            if not pressure.free:
                fixed[task.name][chamber] = pressure.start
                continue
            if pressure.same_as is not None or task.pressures_of is not None:
                continue
            shared = tuple(name for name, other in task.pressure.items() if other.same_as == chamber)
            others = tuple(other.name for other in problem.task if other.pressures_of == task.name)
            pressures.append(FreePressure(task.name, chamber, _scale(pressure), shared, others))
            variables.append(pressure)
    names = {each.name: list(data_of(each)) for each in reinforcements(problem)}
    for name, own in designed(problem).items():
        for key, datum in own.items():
            place = list(names).index(name), names[name].index(key)
            data.append(FreeDatum(name, key, place, datum.start, _scale(datum)))
            variables.append(datum)
    # Those that are no shape, in mm of Φ.
    others = np.array([[_scale(each) * bound for bound in (each.start, each.min, each.max)] for each in variables])
    values, lower, upper = others.reshape(-1, 3).T
    return DesignSpace(
        reference=body,
        L=shape.L,
        offset=shape.offset,
        start=np.concatenate([shape.start, values]),
        lower=np.concatenate([shape.lower, lower]),
        upper=np.concatenate([shape.upper, upper]),
        free_pressures=tuple(pressures),
        free_data=tuple(data),
        fixed_pressures=fixed,
        reinforcements=len(names),
    )


def _scale(variable: Variable) -> float:
    """What of Φ, in mm, one unit of a variable that is no shape is."""
    return SPAN / (variable.max - variable.min)
