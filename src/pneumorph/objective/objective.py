"""An objective: a function of the features that is minimised, with its derivatives."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array

from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.objective.features import (
    NO_SLABS,
    ElementSums,
    Features,
    ModelTraits,
    Slabs,
    element_sums,
    features_of,
    measure_features,
    sums_pulled_back,
    traits_of,
)
from pneumorph.objective.strain import StrainShare
from pneumorph.objective.tip import HeldForce, TipStiffness
from pneumorph.objective.workspace import Workspace

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
    by_pressure : {chamber: float}
        What J grows by per MPa of given pressures, beside what these do to the features.
    instead : optional
        What J is where it is no function of features; `value` is 0 then, and `sensitivity/whole.py` or
        `analysis/workspace.py` has it.
    """

    value: FeatureFunction
    slabs: Slabs = NO_SLABS
    errors: Mapping[str, FeatureFunction] = field(default_factory=dict)
    residuals: FeatureFunction | None = None
    shift: np.ndarray | None = None
    by_pressure: Mapping[str, float] = field(default_factory=dict)
    instead: TipStiffness | HeldForce | StrainShare | Workspace | None = None

    def of_pressures(self, pressures: Mapping[str, float]) -> float:
        """The part of J that is of given pressures, in MPa."""
        return sum(rate * pressures[name] for name, rate in self.by_pressure.items())

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
        value = measure(features_of(traits, at))
        return value, value

    slopes, value = jax.jacrev(residuals, has_aux=True)(at)
    return value, slopes


def in_place_of_features(what: TipStiffness | HeldForce | StrainShare | Workspace) -> Objective:
    """The objective that is something other than a function of features."""
    return Objective(lambda f: jnp.zeros(()), instead=what)


def squares(
    parts: list[tuple[float, FeatureFunction]], errors: Mapping[str, FeatureFunction], slabs: Slabs = NO_SLABS
) -> Objective:
    """The objective that is a sum of squared residuals, each function of the features with its weight."""

    def residuals(f: Features) -> Array:
        return jnp.concatenate([np.sqrt(weight) * part(f) for weight, part in parts if weight > 0.0])

    return Objective(lambda f: jnp.sum(residuals(f) ** 2), slabs, errors, residuals)


def amount(of: FeatureFunction, wanted: float | None, name: str) -> Objective:
    """The objective that makes an amount as large as possible, or as near as possible to what is wanted."""
    if wanted is None:
        return Objective(lambda f: -of(f))
    return squares([(1.0, lambda f: (of(f) - wanted)[None])], {name: lambda f: jnp.abs(of(f) - wanted)})


def components(
    targets: Mapping[str, float],
    read: Callable[[Features], tuple[Array, Array]],
    names: Sequence[str],
    weights: tuple[float, float],
) -> Objective:
    """The objective for those of six motions that have a target.

    Parameters
    ----------
    targets : dict of float
        The motions by name, mm and rad.
    read : function of Features
        The translation and the rotation vector, (3,) and (3,).
    names : (6,)
        Of the three motions along the axes and the three about them.
    weights : (2,)
        Of the squared lengths, 1/mm², and of the squared angles, 1/rad².
    """
    parts: list[tuple[float, FeatureFunction]] = []
    errors: dict[str, FeatureFunction] = {}
    for number, (error, weight) in enumerate(zip(("position_mm", "orientation_rad"), weights, strict=True)):
        given = {axis: targets[name] for axis, name in enumerate(names[3 * number :][:3]) if name in targets}
        if not given:
            continue
        axes, wanted = jnp.array(list(given)), jnp.array(list(given.values()))

        def off(f: Features, number=number, axes=axes, wanted=wanted) -> Array:
            return read(f)[number][axes] - wanted

        parts.append((weight, off))
        errors[error] = lambda f, off=off: jnp.sqrt(jnp.sum(off(f) ** 2))
    return squares(parts, errors)
