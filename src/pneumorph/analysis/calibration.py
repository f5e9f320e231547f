"""Find what a measured curve says of a body's rubber, walls and pressures: least squares with exact derivatives.

States are solved at all measured pressures. With the derivatives of what is measured at each (`quantity_slopes`),
Gauss–Newton steps lead to the parameters whose curve is nearest to the measured one. A factor s of all moduli is that
of all loads l, and of the stiffness of sheets and fibres, divided by s (`as_cast`). Under k = l/s a motion or a volume
is m(k), and changes by −k·∂m/∂k / s. What the tip pushes with where it is held is s r(k): it changes by r − k·∂r/∂k.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.stats import t as students

from pneumorph.analysis.along import Curve, along, solved_along
from pneumorph.analysis.surface_motions import offset
from pneumorph.analysis.tolerances import LOADS, MODULUS, as_cast, pressure_of
from pneumorph.doing import doing
from pneumorph.errors import ComputationError, ProblemError
from pneumorph.geometry import Body
from pneumorph.mechanics import Configuration, Equilibrium, State, Tangent, predict, solve
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mesh import Morph
from pneumorph.mesh.tets import chambers_of
from pneumorph.problem import Problem, Task
from pneumorph.problem.components import PUSHES
from pneumorph.sensitivity import quantity_slopes

PARAMETERS = {"modulus": "%", "wall": "mm", "pressure": "kPa"}
"""What can be fitted, with the unit in which it is told: moduli relative to those of the problem, rubber added at all
chambers, and what is added to all measured pressures. Chambers without pressure at all points are open to the air."""

UNITS = {"%": 0.01, "mm": 1.0, "kPa": 1e-3}

MOST_STEPS, ENOUGH, OF_DEVIATION = 12, 1e-5, 1e-3
"""Most Gauss–Newton steps, and the largest step after which there are no more: in percent, mm and kPa, or relative to
the standard deviations of the parameters."""

APART = 0.98
"""Correlation above which two parameters do the same to the curve, so that it tells their sum alone."""

MOST_FACTORISATIONS = 60
"""Most for one state."""

LEAST_FACTOR, MOST_FACTOR = 0.1, 10.0
"""Moduli over those of the problem between which fits stay: sources of a rubber differ by less, so a curve that asks
for others has other units or signs."""

FAR = 0.01
"""Root mean square of the differences over the largest measured value above which a fit has to go on."""

CHECK = "check the signs and units of its columns, and whose loads act"
"""What to do about a curve that the body does not have."""


@dataclass(frozen=True)
class Calibration:
    """Fitted parameters.

    Attributes
    ----------
    names : sequence of str
        Of `PARAMETERS`.
    values, half : (k,)
        Values, in their units, and half the widths of their confidence intervals of 95 %.
    correlation : (k, k)
    before, after : (n,) mm and rad, N and N·mm, mm³
        The curve with the problem's rubber and walls, and with the fitted ones.
    """

    names: Sequence[str]
    values: np.ndarray
    half: np.ndarray
    correlation: np.ndarray
    before: np.ndarray
    after: np.ndarray

    @property
    def factor(self) -> float:
        """The factor of all moduli."""
        return 1.0 + 0.01 * float(dict(zip(self.names, self.values, strict=True)).get("modulus", 0.0))

    @property
    def together(self) -> list[tuple[str, str]]:
        """Pairs of parameters that the curve does not tell apart."""
        one, other = np.nonzero(np.triu(np.abs(self.correlation) > APART, 1))
        return [(self.names[int(i)], self.names[int(j)]) for i, j in zip(one, other, strict=True)]


def calibrate(problem: Problem, body: Body, task: Task, curve: Curve, names: Sequence[str]) -> Calibration:
    """Fit parameters to a measured curve.

    Parameters
    ----------
    problem, body : one of its designs.
    task : whose loads act; of a force of the tip, one that holds the motion.
    curve : measured.
    names : of `PARAMETERS`, fewer than points.

    Raises
    ------
    ProblemError
        If the body has free obstacles or friction, or chambers that are sealed or filled to a volume.
    ComputationError
        If a state is not found, or the parameters cannot be fitted.
    """
    if free := [each.name for each in problem.obstacle if each.free is not None]:
        raise ProblemError(f"obstacle {free[0]}: is free; only bodies on fixed obstacles can be calibrated")
    with doing("calibrating"):
        fit = _Fit.of(problem, body, task, curve)
        return fitted(fit, names, fit.begun())


def fitted(fit: _Fit, names: Sequence[str], here: _Solved) -> Calibration:
    """The parameters of a curve by steps from solved states of the body as it is designed."""
    units = np.array([UNITS[PARAMETERS[name]] for name in names])
    before, theta = here.values, np.zeros(len(names))
    cost = float(np.sum((here.values - fit.curve.values) ** 2))
    for _ in range(MOST_STEPS):
        slopes = here.slopes(names) * units
        step = np.linalg.lstsq(slopes, fit.curve.values - here.values, rcond=None)[0]
        # Half of a step that makes it worse, or leads to where there is no state.
        for part in (1.0, 0.5, 0.25, 0.125):
            there = fit.moved(here, _all(names, (theta + part * step) * units))
            if there is not None and float(np.sum((there.values - fit.curve.values) ** 2)) <= cost * (1 + 1e-9):
                break
        else:
            if np.sqrt(cost / len(here.values)) > FAR * np.abs(fit.curve.values).max():
                what = ", ".join(names).replace("modulus", f"modulus within a factor of {MOST_FACTOR:g}")
                raise ComputationError(f"no other {what} brings the body nearer to the measured curve; {CHECK}")
            break
        theta, here = theta + part * step, there
        cost = float(np.sum((here.values - fit.curve.values) ** 2))
        enough = np.maximum(ENOUGH, OF_DEVIATION * _deviations(slopes, cost))
        if np.all(np.abs(part * step) < enough):
            break
    slopes = here.slopes(names) * units
    free = len(fit.curve.values) - len(names)
    information = slopes.T @ slopes
    if free < 1 or not np.linalg.cond(information) <= 1e14:
        more = "fit fewer parameters" if len(names) > 1 else "give points at other pressures"
        raise ComputationError(f"the curve does not determine {' and '.join(names)}; {more}")
    scale = np.sqrt(np.diag(np.linalg.inv(information)))
    correlation = np.linalg.inv(information) / np.outer(scale, scale)
    return Calibration(
        names, theta, students.ppf(0.975, free) * _deviations(slopes, cost), correlation, before, here.values
    )


def _deviations(slopes: np.ndarray, cost: float) -> np.ndarray:
    """Standard deviations (k,) of the parameters by derivatives (n, k) and the sum of squares that is left."""
    count, parameters = slopes.shape
    return np.sqrt(cost / max(count - parameters, 1) * np.diag(np.linalg.pinv(slopes.T @ slopes)))


def _all(names: Sequence[str], values: np.ndarray) -> np.ndarray:
    """All three parameters, in the units of the code."""
    given = dict(zip(names, values, strict=True))
    return np.array([given.get(name, 0.0) for name in PARAMETERS])


@dataclass(frozen=True, eq=False)
class _Fit:
    """A body on its mesh under the loads of every point of the curve, and how nodes move (N, 3) per mm of rubber."""

    curve: Curve
    points: Sequence[Configuration]
    tangent: Tangent
    morph: Morph
    thicker: np.ndarray

    @classmethod
    def of(cls, problem: Problem, body: Body, task: Task, curve: Curve) -> _Fit:
        """The body meshed for the pressures of the curve, in part where these are symmetric."""
        morph, points = along(problem, body, task, curve.pressures)
        faces = [face for face in morph.mesh.faces if chambers_of(face)]
        thicker = sum((offset(morph.mesh, face) for face in faces), np.zeros_like(points[0].X))
        return cls(curve, points, Tangent(points[0].model), morph, thicker[: morph.n_surface])

    def configurations(self, parameters: np.ndarray) -> list[Configuration]:
        """All points with parameters in the units of the code."""
        more, wall, pressure = map(float, parameters)
        inflated = zip(self.points[0].model.chambers, self.inflated, strict=True)
        changes = {MODULUS: more, **{pressure_of(name): pressure for name, some in inflated if some}}
        return [as_cast(at, wall * self.morph.extend(self.thicker), changes) for at in self.points]

    @property
    def inflated(self) -> np.ndarray:
        """Which chambers (C,) have pressure at some point."""
        return np.any(self.curve.pressures, axis=0)

    def begun(self) -> _Solved:
        """The states as the body is designed, along the curve from the lowest pressure.

        Raises
        ------
        ComputationError
            If one is not found.
        """
        path = self.configurations(np.zeros(len(PARAMETERS)))
        return _Solved(self, 1.0, path, solved_along(path, self.curve.pressures, self.tangent))

    def moved(self, near: _Solved, parameters: np.ndarray) -> _Solved | None:
        """The states with other parameters, from those with the parameters before; None if one is not found."""
        if not LEAST_FACTOR <= 1.0 + parameters[0] <= MOST_FACTOR:
            return None
        path, states = self.configurations(parameters), []
        for at, before, state in zip(path, near.path, near.states, strict=True):
            self.tangent.move_to(before, state)
            start = predict(before, self.tangent, state, at.X - before.X, at.loads)
            answer = solve(at, self.tangent, start, since=(before, state), most=MOST_FACTORISATIONS)
            if not isinstance(answer, Equilibrium):
                return None
            states.append(answer.state)
        return _Solved(self, 1.0 + float(parameters[0]), path, states)


@dataclass(frozen=True, eq=False)
class _Solved:
    """The states of all points of a curve with some parameters, among them the factor of all moduli."""

    fit: _Fit
    factor: float
    path: Sequence[Configuration]
    states: Sequence[State]

    @cached_property
    def _of_points(self) -> list[tuple[float, np.ndarray]]:
        """What was measured at every point, and its derivatives by all parameters, in the units of the code.

        Of the bodies that are solved, under loads divided by the factor of all moduli.
        """
        answers, quantity = [], self.fit.curve.quantity
        force = self.factor if quantity in PUSHES else 1.0
        for at, state in zip(self.path, self.states, strict=True):
            self.fit.tangent.move_to(at, state)
            slopes = quantity_slopes(at, self.fit.tangent, state, (quantity,))
            value, by_X, by_load = float(slopes.motion[0]), slopes.X[0], slopes.loads[0]
            by = [
                (value if quantity in PUSHES else 0.0) - force / self.factor * _by_all_loads(at, by_load),
                force * float(np.sum(self.fit.morph.on_surface(by_X) * self.fit.thicker)),
                force / self.factor * float(np.sum(np.asarray(by_load.pressure)[self.fit.inflated])),
            ]
            answers.append((force * value, np.array(by)))
        return answers

    @property
    def values(self) -> np.ndarray:
        """The curve (n,), in the units of `Curve.values`."""
        return np.array([value for value, _ in self._of_points])

    def slopes(self, names: Sequence[str]) -> np.ndarray:
        """Its derivatives (n, k) by parameters with these names."""
        return np.array([by for _, by in self._of_points])[:, [list(PARAMETERS).index(name) for name in names]]


def _by_all_loads(at: Configuration, by: Loads) -> float:
    """What a quantity changes by per relative change of all loads and of the stiffness of all sheets and fibres."""
    parts = [float(np.sum(np.asarray(getattr(at.loads, part)) * getattr(by, part))) for part in ("pressure", *LOADS)]
    sheets = [float(each.stiffness) for each in at.model.reinforcements.values()]
    stiffness = np.array(sheets) + np.asarray(at.loads.reinforcement)[:, 0]
    return sum(parts) + float(stiffness @ np.asarray(by.reinforcement)[:, 0])
