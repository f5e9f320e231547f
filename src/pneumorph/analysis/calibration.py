"""Find what a measured curve says of a body's rubber, walls and pressures: least squares with exact derivatives.

States are solved at all measured pressures. With the derivatives of what is measured at each (`quantity_slopes`),
Gauss–Newton steps lead to the parameters whose curve is nearest to the measured one. A factor s of all moduli is that
of all loads l, and of the stiffness of sheets and fibres, divided by s (`as_cast`). Under k = l/s a motion or a volume
is m(k), and changes by −k·∂m/∂k / s. What the tip pushes with where it is held is s r(k): it changes by r − k·∂r/∂k.
Single constants of a rubber change its energy, and what is measured by the adjoint of `sensitivity/constants.py`.

Errors ε of constants, which an earlier fit left open, change the curve by S ε. Least squares make up for them by
−A⁺S ε of the parameters, with the derivatives A by these: so the constants that are found are off by (1 − G A⁺S) ε,
where G are their changes by parameters, and by what the noise of the curve leaves. No error counts twice.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from scipy.optimize import lsq_linear
from scipy.special import stdtrit

from pneumorph.analysis.along import Curve, along, solved_along
from pneumorph.analysis.constants import (
    Constants,
    changed,
    constants_of,
    forces_by_constants,
    rubbers_in,
    with_changed,
)
from pneumorph.analysis.surface_motions import offset
from pneumorph.analysis.tolerances import LOADS, MODULUS, as_cast, pressure_of
from pneumorph.doing import doing
from pneumorph.errors import Hopeless, ProblemError
from pneumorph.geometry import Body
from pneumorph.mechanics import Configuration, Equilibrium, State, Tangent, predict, solve
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mesh import Morph
from pneumorph.mesh.tets import chambers_of
from pneumorph.problem import Problem, Task
from pneumorph.problem.components import PUSHES
from pneumorph.problem.constants import constants, is_modulus, named
from pneumorph.problem.material import Material
from pneumorph.sensitivity import quantity_slopes

PARAMETERS = {"modulus": "%", "wall": "mm", "pressure": "kPa"}
"""What can be fitted beside constants of rubbers, with the unit in which it is told: moduli relative to those of the
problem, rubber added at all chambers, and what is added to all measured pressures. Chambers without pressure at all
points are open to the air. Constants are told in % of those of the problem, too."""

UNITS = {"%": 0.01, "mm": 1.0, "kPa": 1e-3}

MOST_STEPS, ENOUGH, OF_DEVIATION = 12, 1e-5, 1e-3
"""Most Gauss–Newton steps, and the largest step after which there are no more: in percent, mm and kPa, or relative to
the standard deviations of the parameters."""

SHORT, OF_INTERVAL = 1e-3, 0.1
"""A search that ends is told to have ended early where its last step was longer than this, in percent, mm and kPa, and
than this part of the standard deviations."""

APART = 0.98
"""Correlation above which two parameters do the same to the curve, so that it tells their sum alone."""

MOST_FACTORISATIONS = 60
"""Most for one state."""

LEAST_FACTOR, MOST_FACTOR = 0.1, 10.0
"""Moduli over those of the problem between which fits stay: sources of a rubber differ by less, so a curve that asks
for others has other units or signs."""

LONGEST = 60.0
"""Longest step of a constant, in %: one of which the curve says little would go far beyond what a rubber has."""

UNKNOWN = 50.0
"""Half an interval of a constant, in %, from which the curve does not determine it."""

FAR = 0.01
"""Root mean square of the differences over the largest measured value above which a fit has to go on."""

NEAR = 0.5
"""The same, above which the nearest curve is not that of this body."""

NOTHING = 1e-9
"""Derivatives of a point over the largest, below which it tells nothing."""

CHECK = "check the signs and units of its columns, and whose loads act"
"""What to do about a curve that the body does not have."""


@dataclass(frozen=True)
class Calibration:
    """Fitted parameters.

    Attributes
    ----------
    names : sequence of str
        Of `PARAMETERS`, and names of constants.
    values, half : (k,)
        Values, in their units, and half the widths of their confidence intervals of 95 %.
    covariance : (k, k)
        Of the values.
    made_up : {constant: (k,)}
        What they make up for per relative change of a constant that is not as the problem says, A⁺S.
    before, after : (n,) mm and rad, N and N·mm, mm³
        The curve with the problem's rubber and walls, and with the fitted ones.
    short : {name: value}
        Parameters that the last step still changed by so much, where the search ended before the nearest curve.
    """

    names: Sequence[str]
    values: np.ndarray
    half: np.ndarray
    covariance: np.ndarray
    made_up: Mapping[str, np.ndarray]
    before: np.ndarray
    after: np.ndarray
    short: Mapping[str, float] = field(default_factory=dict)

    @property
    def constants(self) -> dict[str, float]:
        """The relative changes of the constants that were fitted."""
        return {
            name: 0.01 * float(value) for name, value in zip(self.names, self.values, strict=True) if is_constant(name)
        }

    @property
    def undetermined(self) -> list[str]:
        """The constants that were fitted of which the curve says too little."""
        return [name for name, half in zip(self.names, self.half, strict=True) if is_constant(name) and half > UNKNOWN]

    @property
    def factor(self) -> float:
        """The factor of all moduli."""
        return 1.0 + 0.01 * float(dict(zip(self.names, self.values, strict=True)).get("modulus", 0.0))

    @property
    def together(self) -> list[tuple[str, str]]:
        """Pairs of parameters that the curve does not tell apart."""
        scale = np.sqrt(np.diag(self.covariance))
        one, other = np.nonzero(np.triu(np.abs(self.covariance) > APART * np.outer(scale, scale), 1))
        return [(self.names[int(i)], self.names[int(j)]) for i, j in zip(one, other, strict=True)]


def calibrate(problem: Problem, body: Body, task: Task, curve: Curve, names: Sequence[str]) -> Calibration:
    """Fit parameters to a measured curve.

    Parameters
    ----------
    problem, body : one of its designs.
    task : whose loads act; of a force of the tip, one that holds the motion.
    curve : measured.
    names : of `PARAMETERS` and of constants, fewer than points.

    Raises
    ------
    ProblemError
        If the body has free obstacles or friction, or chambers that are sealed or filled to a volume.
    ComputationError
        If a state is not found.
    Hopeless
        If the curve is not one of this body, or does not determine the parameters.
    """
    if free := [each.name for each in problem.obstacle if each.free is not None]:
        raise ProblemError(f"obstacle {free[0]}: is free; only bodies on fixed obstacles can be calibrated")
    with doing("calibrating"):
        fit = _Fit.of(problem, body, task, curve, names)
        return fitted(fit, names, fit.begun())


def is_constant(name: str) -> bool:
    """Whether what is fitted is a constant of a rubber."""
    return name not in PARAMETERS


def fitted(fit: _Fit, names: Sequence[str], here: _Solved) -> Calibration:
    """The parameters of a curve by steps from solved states of the body as it is designed."""
    units = np.array([UNITS[PARAMETERS.get(name, "%")] for name in names])
    longest = np.array([LONGEST if is_constant(name) else np.inf for name in names])
    before, theta, step = here.values, np.zeros(len(names)), np.zeros(len(names))
    cost = float(np.sum((here.values - fit.curve.values) ** 2))
    for _ in range(MOST_STEPS):
        slopes = here.slopes(names) * units
        step = lsq_linear(slopes, fit.curve.values - here.values, (-longest, longest)).x
        # Half of a step that makes it worse, or leads to where there is no state.
        for part in (1.0, 0.5, 0.25, 0.125):
            there = fit.moved(here, dict(zip(names, ((theta + part * step) * units).tolist(), strict=True)))
            if there is not None and float(np.sum((there.values - fit.curve.values) ** 2)) <= cost * (1 + 1e-9):
                break
        else:
            if np.sqrt(cost / len(here.values)) > FAR * np.abs(fit.curve.values).max():
                raise Hopeless(
                    f"no other values of {', '.join(names)}, with moduli within a factor of {MOST_FACTOR:g}, bring the "
                    f"body nearer to the measured curve; {CHECK}"
                )
            break
        step = part * step
        theta, here = theta + step, there
        cost = float(np.sum((here.values - fit.curve.values) ** 2))
        enough = np.maximum(ENOUGH, OF_DEVIATION * _deviations(slopes, cost))
        if np.all(np.abs(step) < enough):
            break
    left, largest = np.sqrt(cost / len(here.values)), np.abs(fit.curve.values).max()
    if left > NEAR * largest:
        share = 100 * left / largest
        raise Hopeless(f"the nearest curve leaves differences of {share:.2g} % of the largest value; {CHECK}")
    slopes = here.slopes(names) * units
    # A point that no parameter moves, such as one without pressure, tells nothing of what the others are off by.
    tells = np.linalg.norm(slopes, axis=1) > NOTHING * np.linalg.norm(slopes, axis=1).max()
    slopes, cost = slopes[tells], float(np.sum((here.values - fit.curve.values)[tells] ** 2))
    free = len(slopes) - len(names)
    information = slopes.T @ slopes
    if free < 1 or not np.linalg.cond(information) <= 1e14:
        more = "fit fewer parameters" if len(names) > 1 else "give points at other pressures"
        raise Hopeless(f"the curve does not determine {' and '.join(names)}; {more}")
    deviations = _deviations(slopes, cost)
    half = stdtrit(free, 0.975) * deviations
    early = np.abs(step) > np.maximum(SHORT, OF_INTERVAL * deviations)
    known = [name for each in here.known.values() for name in each.names]
    made_up = np.linalg.lstsq(slopes, here.slopes(known)[tells], rcond=None)[0] if known else np.zeros((len(names), 0))
    return Calibration(
        names,
        theta,
        half,
        cost / free * np.linalg.inv(information),
        dict(zip(known, made_up.T, strict=True)),
        before,
        here.values,
        {name: float(each) for name, each, long in zip(names, step, early, strict=True) if long},
    )


def covariance_after(problem: Problem, fit: Calibration, region: str) -> np.ndarray:
    """The covariance (c, c) of the relative errors of a region's constants after a fit, but for the bulk modulus.

    Parameters
    ----------
    problem : with the rubbers before it, and the covariances of earlier fits.
    fit : of a body of the problem.
    region : see `rubbers_in`.
    """
    rubbers, factors = rubbers_in(problem), {name: 1.0 + by for name, by in fit.constants.items()}
    own = [named(region, name) for name in rubbers[region].constants]
    # Relative changes of what was found by the values of the parameters in their units.
    by_values = np.zeros((len(own), len(fit.names)))
    for column, name in enumerate(fit.names):
        if name == "modulus":
            moduli = [is_modulus(each) for each in rubbers[region].constants]
            by_values[:, column] = np.where(moduli, 0.01 / fit.factor, 0.0)
        elif name in own:
            by_values[own.index(name), column] = 0.01 / factors[name]
    covariance = by_values @ fit.covariance @ by_values.T
    for other, material in rubbers.items():
        if material.covariance:
            names = [named(other, name) for name in material.constants]
            left = -by_values @ np.array([fit.made_up[name] for name in names]).T
            if other == region:
                left += np.diag([1.0 / factors.get(name, 1.0) for name in names])
            covariance += left @ np.array(material.covariance) @ left.T
    return covariance


def _deviations(slopes: np.ndarray, cost: float) -> np.ndarray:
    """Standard deviations (k,) of the parameters by derivatives (n, k) and the sum of squares that is left."""
    count, parameters = slopes.shape
    return np.sqrt(cost / max(count - parameters, 1) * np.diag(np.linalg.pinv(slopes.T @ slopes)))


@dataclass(frozen=True, eq=False)
class _Fit:
    """A body on its mesh under the loads of every point of the curve, and how nodes move (N, 3) per mm of rubber.

    Derivatives are known by all constants of the rubbers in `regions`.
    """

    problem: Problem
    regions: Sequence[str]
    curve: Curve
    points: Sequence[Configuration]
    tangent: Tangent
    morph: Morph
    thicker: np.ndarray

    @classmethod
    def of(cls, problem: Problem, body: Body, task: Task, curve: Curve, names: Sequence[str] = ()) -> _Fit:
        """The body meshed for the pressures of the curve, in part where these are symmetric, to fit these names."""
        morph, points = along(problem, body, task, curve.pressures)
        faces = [face for face in morph.mesh.faces if chambers_of(face)]
        thicker = sum((offset(morph.mesh, face) for face in faces), np.zeros_like(points[0].X))
        regions = [
            region
            for region, material in rubbers_in(problem).items()
            if material.covariance or any(named(region, each) in names for each in constants(material))
        ]
        thicker = thicker[: morph.n_surface]
        return cls(problem, regions, curve, points, Tangent(points[0].model), morph, thicker)

    def configurations(self, parameters: Mapping[str, float]) -> list[Configuration]:
        """All points with parameters in the units of the code; those that are left out are zero."""
        more, wall, pressure = (parameters.get(name, 0.0) for name in PARAMETERS)
        inflated = zip(self.points[0].model.chambers, self.inflated, strict=True)
        changes = {MODULUS: more, **{pressure_of(name): pressure for name, some in inflated if some}}
        points = self.points
        if others := {name: by for name, by in parameters.items() if is_constant(name)}:
            model = with_changed(points[0].model, self.problem, others)
            points = [replace(at, model=model) for at in points]
        return [as_cast(at, wall * self.morph.extend(self.thicker), changes) for at in points]

    def is_rubber(self, parameters: Mapping[str, float]) -> bool:
        """Whether rubbers with parameters have moduli like those of the problem, and pure numbers of their signs."""
        for region, material in changed(self.problem, parameters).items():
            own, now = self.materials[region], constants(material)
            factors = [now[name] / value for name, value in constants(own).items() if value and not is_modulus(name)]
            factors.append(material.initial_shear_modulus / own.initial_shear_modulus)
            factors.append(material.bulk_modulus / own.bulk_modulus)
            factors[-2:] = [(1.0 + parameters.get("modulus", 0.0)) * each for each in factors[-2:]]
            if not all(LEAST_FACTOR <= each <= MOST_FACTOR for each in factors):
                return False
        return True

    @cached_property
    def materials(self) -> dict[str, Material]:
        """Those of the problem, by region."""
        return rubbers_in(self.problem)

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
        path = self.configurations({})
        return _Solved(self, {}, path, solved_along(path, self.curve.pressures, self.tangent))

    def moved(self, near: _Solved, parameters: Mapping[str, float]) -> _Solved | None:
        """The states with other parameters, from those with the parameters before; None if one is not found."""
        if not self.is_rubber(parameters):
            return None
        path, states = self.configurations(parameters), []
        for at, before, state in zip(path, near.path, near.states, strict=True):
            self.tangent.move_to(before, state)
            start = predict(before, self.tangent, state, at.X - before.X, at.loads)
            answer = solve(at, self.tangent, start, since=(before, state), most=MOST_FACTORISATIONS)
            if not isinstance(answer, Equilibrium):
                return None
            states.append(answer.state)
        return _Solved(self, parameters, path, states)


@dataclass(frozen=True, eq=False)
class _Solved:
    """The states of all points of a curve with some parameters."""

    fit: _Fit
    parameters: Mapping[str, float]
    path: Sequence[Configuration]
    states: Sequence[State]

    @property
    def factor(self) -> float:
        """That of all moduli."""
        return 1.0 + self.parameters.get("modulus", 0.0)

    @cached_property
    def known(self) -> dict[str, Constants]:
        """The constants by which there are derivatives, as they are now, by region."""
        now = changed(self.fit.problem, self.parameters)
        return {region: constants_of(region, now[region]) for region in self.fit.regions}

    @cached_property
    def _of_points(self) -> list[tuple[float, dict[str, float]]]:
        """What was measured at every point, and its derivatives by all parameters, in the units of the code.

        Of the bodies that are solved, under loads divided by the factor of all moduli.
        """
        answers, quantity = [], self.fit.curve.quantity
        force = self.factor if quantity in PUSHES else 1.0
        for at, state in zip(self.path, self.states, strict=True):
            self.fit.tangent.move_to(at, state)
            slopes = quantity_slopes(at, self.fit.tangent, state, (quantity,))
            value, by_X, by_load = float(slopes.motion[0]), slopes.X[0], slopes.loads[0]
            by = {
                "modulus": (value if quantity in PUSHES else 0.0) - force / self.factor * _by_all_loads(at, by_load),
                "wall": force * float(np.sum(self.fit.morph.on_surface(by_X) * self.fit.thicker)),
                "pressure": force / self.factor * float(np.sum(np.asarray(by_load.pressure)[self.fit.inflated])),
            }
            for region, forces in forces_by_constants(at, state, self.known).items():
                names, by_each = self.known[region].names, -force * forces @ slopes.adjoints[0]
                # Per relative change of the problem's constants, of which these are multiples.
                by |= {
                    name: float(each) / (1.0 + self.parameters.get(name, 0.0))
                    for name, each in zip(names, by_each, strict=True)
                }
            answers.append((force * value, by))
        return answers

    @property
    def values(self) -> np.ndarray:
        """The curve (n,), in the units of `Curve.values`."""
        return np.array([value for value, _ in self._of_points])

    def slopes(self, names: Sequence[str]) -> np.ndarray:
        """Its derivatives (n, k) by parameters with these names, in the units of the code."""
        return np.array([[by[name] for name in names] for _, by in self._of_points])


def _by_all_loads(at: Configuration, by: Loads) -> float:
    """What a quantity changes by per relative change of all loads and of the stiffness of all sheets and fibres."""
    parts = [float(np.sum(np.asarray(getattr(at.loads, part)) * getattr(by, part))) for part in ("pressure", *LOADS)]
    sheets = [float(each.stiffness) for each in at.model.reinforcements.values()]
    stiffness = np.array(sheets) + np.asarray(at.loads.reinforcement)[:, 0]
    return sum(parts) + float(stiffness @ np.asarray(by.reinforcement)[:, 0])
