"""Objectives to be minimised, built from the tables of a problem as functions of the features."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import partial
from typing import TYPE_CHECKING

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.errors import ProblemError
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.contact.pose import pose_of
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.plate import rotation as rotation_of
from pneumorph.objective.curve import section_targets
from pneumorph.objective.custom import custom
from pneumorph.objective.features import (
    NO_SLABS,
    ElementSums,
    Features,
    ModelTraits,
    Slabs,
    element_sums,
    equidistant,
    features_of,
    measure_features,
    sums_pulled_back,
    traits_of,
)
from pneumorph.objective.rotations import angle_residual
from pneumorph.problem import (
    ContactArea,
    Custom,
    MatchCurve,
    MatchSections,
    Maximize,
    Press,
    Reach,
    TargetMotion,
    TargetPose,
)
from pneumorph.problem.components import MOTIONS, POSE

if TYPE_CHECKING:
    from pneumorph.problem import Problem

_READERS = {
    "extension": lambda f: f.translation[2],
    "bending_x": lambda f: f.rotation[0],
    "bending_y": lambda f: f.rotation[1],
    "twist": lambda f: f.rotation[2],
}
FeatureFunction = Callable[[Features], Array]


@dataclass(frozen=True, eq=False)
class Objective:
    """A function of the features that is minimised.

    Attributes
    ----------
    value : function of Features
        J.
    slabs : Slabs
        The sections whose features it needs.
    errors : {name: function of Features}
        Reported distances from the target; names end in the unit, "_mm", "_rad", "_N" or "_mm2".
    residuals : function of Features, optional
        The residuals (k,) of which J is the sum of squares; None if J is not such a sum.
    shift : (K, 6) array, optional
        Poses of the obstacles; by default they are in their places.
    """

    value: FeatureFunction
    slabs: Slabs = NO_SLABS
    errors: Mapping[str, FeatureFunction] = field(default_factory=dict)
    residuals: FeatureFunction | None = None
    shift: np.ndarray | None = None

    def features(self, model: Model, X: np.ndarray, state: State) -> Features:
        """The features of a state on nodes X (N, 3) in mm, with the sections that the objective needs."""
        return measure_features(model, X, state, self.slabs, self.shift)

    def at(self, model: Model, X: np.ndarray, state: State) -> float:
        """J for a state on nodes X."""
        return float(_value(self, traits_of(model), self._sums(model, X, state)))

    def slope(self, model: Model, X: np.ndarray, state: State) -> tuple[float, np.ndarray, State]:
        """J for a state on nodes X, and its derivatives with respect to X (N, 3) and the unknowns."""
        value, by_sums = _slope(self, traits_of(model), self._sums(model, X, state))
        by_X, by_state = self._pulled_back(model, X, state, jax.tree.map(lambda part: np.asarray(part)[None], by_sums))
        return float(value), by_X[0], by_state[0]

    def jacobian(self, model: Model, X: np.ndarray, state: State) -> tuple[np.ndarray, np.ndarray, list[State]]:
        """Residuals (k,) for a state on nodes X, and their derivatives with respect to X (k, N, 3) and the unknowns."""
        residuals, by_sums = _jacobian(self, traits_of(model), self._sums(model, X, state))
        return np.asarray(residuals), *self._pulled_back(model, X, state, by_sums)

    def _sums(self, model: Model, X: np.ndarray, state: State) -> ElementSums:
        return element_sums(model, X, state, self.slabs, self.shift)

    def _pulled_back(self, model: Model, X: np.ndarray, state: State, bars: ElementSums):
        return sums_pulled_back(model, X, state, self.slabs, jax.tree.map(np.asarray, bars), self.shift)


@partial(jax.jit, static_argnums=(0, 1))
def _value(objective: Objective, traits: ModelTraits, at: ElementSums) -> Array:
    return objective.value(features_of(traits, at))


@partial(jax.jit, static_argnums=(0, 1))
def _slope(objective: Objective, traits: ModelTraits, at: ElementSums) -> tuple[Array, ElementSums]:
    return jax.value_and_grad(lambda at: objective.value(features_of(traits, at)))(at)


@partial(jax.jit, static_argnums=(0, 1))
def _jacobian(objective: Objective, traits: ModelTraits, at: ElementSums) -> tuple[Array, ElementSums]:
    measure = objective.residuals
    assert measure is not None

    def residuals(at: ElementSums) -> tuple[Array, Array]:
        found = measure(features_of(traits, at))
        return found, found

    slopes, found = jax.jacrev(residuals, has_aux=True)(at)
    return found, slopes


def build_objectives(problem: Problem, aimed: bool = False) -> dict[str, Objective]:
    """Build the objective of every task, or of those with a target alone.

    Raises
    ------
    ProblemError
        If a target curve has no direction at some point, or a user's function fails or does not return a number.
    """
    length, chambers = problem.body.length, tuple(chamber.name for chamber in problem.body.chamber)
    obstacles = tuple(obstacle.name for obstacle in problem.obstacle)
    found = {}
    for number, task in enumerate(problem.task):
        if aimed and not task.objective.aimed:
            continue
        match task.objective:
            case Maximize() as asked:
                found[task.name] = maximize(asked.motion)
            case MatchCurve() as asked:
                slabs = equidistant(asked.sections, length)
                try:
                    targets = section_targets(np.array(asked.control_points), asked.degree, slabs.middle / length)
                except ValueError as error:
                    raise ProblemError(f"task[{number}].objective.control_points: {error}") from None
                found[task.name] = match(slabs, *targets, asked.orientation_weight, asked.position_weight)
            case MatchSections() as asked:
                turns = np.array([rotation_of(jnp.array(turn)) for turn in asked.rotations])
                found[task.name] = match(equidistant(len(turns), length), None, turns)
            case Reach() as asked:
                found[task.name] = reach(asked, length)
            case TargetMotion() as asked:
                found[task.name] = target_motion(asked)
            case Press() as asked:
                found[task.name] = press(asked)
            case ContactArea() as asked:
                found[task.name] = contact_area(asked)
            case TargetPose() as asked:
                found[task.name] = target_pose(asked)
            case Custom() as asked:
                slabs = equidistant(asked.sections, length)
                measure = custom(f"task[{number}].objective", asked, chambers, obstacles)
                found[task.name] = Objective(measure, slabs)
        shift = [pose_of(task.poses.get(name, ())) for name in obstacles]
        found[task.name] = replace(found[task.name], shift=np.array(shift).reshape(-1, 6))
    return found


def motion(name: str) -> FeatureFunction:
    """A motion of the end-effector: "extension" in mm, "bending_x", "bending_y" or "twist" in rad.

    With a minus sign, as in "-twist", the motion in the opposite direction.
    """
    sign = -1.0 if name.startswith("-") else 1.0
    read = _READERS[name.lstrip("+-")]
    return lambda f: sign * read(f)


def maximize(name: str) -> Objective:
    """The objective −`motion`, whose minimum is the largest motion (Remark 1 of the paper)."""
    measure = motion(name)
    return Objective(lambda f: -measure(f))


def match(
    slabs: Slabs,
    position: np.ndarray | None,
    rotation: np.ndarray,
    orientation_weight: float = 1.0,
    position_weight: float = 0.0,
) -> Objective:
    """Objective for target positions (S, 3) in mm and rotations (S, 3, 3) of sections: (8)–(10), Section VIII-E.

    The rotation of each section relative to the previous one, or to the clamped base for the first, is compared with
    that of the target. J is the weighted sum of squared geodesic distances (rad²) and squared distances of centres
    (mm²).
    """
    steps = jnp.asarray(_relative(rotation))
    count = len(rotation)

    def turned(f: Features) -> Array:
        before = jnp.concatenate([jnp.eye(3)[None], f.section_rotation[:-1]])
        relative = jnp.swapaxes(before, 1, 2) @ f.section_rotation
        return jax.vmap(angle_residual)(relative, steps).ravel()

    errors = {"orientation_rad": lambda f: jnp.sqrt(jnp.sum(turned(f) ** 2) / (2 * count))}
    parts = [(orientation_weight, turned)]
    if position is not None:

        def away(f: Features) -> Array:
            return (f.section_position - position).ravel()

        errors["position_mm"] = lambda f: jnp.sqrt(jnp.sum(away(f) ** 2) / count)
        parts.append((position_weight, away))
    return _squares(parts, slabs, errors)


def reach(asked: Reach, length: float) -> Objective:
    """Objective for a target position of the plate's centre, relative to the base's, and rotation: (8)–(10)."""
    parts: list[tuple[float, FeatureFunction]] = []
    errors: dict[str, FeatureFunction] = {}
    if asked.position is not None:
        wanted = jnp.array(asked.position) - jnp.array([0.0, 0.0, length])

        def away(f: Features) -> Array:
            return f.translation - wanted

        parts.append((asked.position_weight, away))
        errors["position_mm"] = lambda f: jnp.sqrt(jnp.sum(away(f) ** 2))
    if asked.rotation is not None:
        turned = rotation_of(jnp.array(asked.rotation))

        def off(f: Features) -> Array:
            return angle_residual(rotation_of(f.rotation), turned)

        parts.append((asked.rotation_weight, off))
        errors["orientation_rad"] = lambda f: jnp.sqrt(jnp.sum(off(f) ** 2) / 2)
    return _squares(parts, NO_SLABS, errors)


def target_motion(asked: TargetMotion) -> Objective:
    """Target components of the tip's translation and rotation vector, each in the sum of squares if it is given."""
    parts: list[tuple[float, FeatureFunction]] = []
    errors: dict[str, FeatureFunction] = {}
    for name, of, motions in (
        ("position_mm", lambda f: f.translation, MOTIONS[:3]),
        ("orientation_rad", lambda f: f.rotation, MOTIONS[3:]),
    ):
        given = [number for number, motion in enumerate(motions) if motion in asked.targets]
        if not given:
            continue
        wanted = jnp.array([asked.targets[motions[number]] for number in given])

        def off(f: Features, of=of, given=tuple(given), wanted=wanted) -> Array:
            return of(f)[jnp.array(given)] - wanted

        parts.append((asked.weight_of(motions[given[0]]), off))
        errors[name] = lambda f, off=off: jnp.sqrt(jnp.sum(off(f) ** 2))
    return _squares(parts, NO_SLABS, errors)


def target_pose(asked: TargetPose) -> Objective:
    """Target components of a free obstacle's displacement and rotation vector, each in the sum if it is given."""
    parts: list[tuple[float, FeatureFunction]] = []
    errors: dict[str, FeatureFunction] = {}
    for name, motions, weight in (
        ("position_mm", POSE[:3], asked.position_weight),
        ("orientation_rad", POSE[3:], asked.rotation_weight),
    ):
        given = [motion for motion in motions if motion in asked.targets]
        if not given:
            continue
        rows = tuple(POSE.index(motion) for motion in given)
        wanted = jnp.array([asked.targets[motion] for motion in given])

        def off(f: Features, rows=rows, wanted=wanted) -> Array:
            return f.pose[asked.obstacle][jnp.array(rows)] - wanted

        parts.append((weight, off))
        errors[name] = lambda f, off=off: jnp.sqrt(jnp.sum(off(f) ** 2))
    return _squares(parts, NO_SLABS, errors)


def press(asked: Press) -> Objective:
    """The largest force on an obstacle, or a target for it: a component, or the sum of the normal forces; N or N²."""

    def force(f: Features) -> Array:
        on = f.contact[asked.obstacle]
        return on.normal if asked.direction is None else jnp.dot(on.force, jnp.array(asked.direction))

    return _amount(force, asked.force, "force_N")


def contact_area(asked: ContactArea) -> Objective:
    """The largest area of contact with an obstacle, or a target for it; mm² or mm⁴."""
    return _amount(lambda f: f.contact[asked.obstacle].area, asked.area, "area_mm2")


def _amount(of: FeatureFunction, wanted: float | None, name: str) -> Objective:
    """The objective that makes an amount as large as possible, or as near as possible to what is wanted."""
    if wanted is None:
        return Objective(lambda f: -of(f))
    return _squares([(1.0, lambda f: (of(f) - wanted)[None])], NO_SLABS, {name: lambda f: jnp.abs(of(f) - wanted)})


def _squares(
    parts: list[tuple[float, FeatureFunction]], slabs: Slabs, errors: Mapping[str, FeatureFunction]
) -> Objective:
    """The objective that is a weighted sum of squared residuals."""

    def residuals(f: Features) -> Array:
        return jnp.concatenate([np.sqrt(weight) * part(f) for weight, part in parts if weight > 0.0])

    return Objective(lambda f: jnp.sum(residuals(f) ** 2), slabs, errors, residuals)


def _relative(rotation: np.ndarray) -> np.ndarray:
    """Each rotation relative to the previous one, the first to the identity."""
    before = np.concatenate([np.eye(3)[None], rotation[:-1]])
    return np.swapaxes(before, 1, 2) @ rotation
