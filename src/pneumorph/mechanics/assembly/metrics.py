"""The metrics of all sheets and fibres of a model as unknowns of their own; see `elements/taut.py`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence

import numpy as np

from pneumorph.mechanics.assembly.displacement import Displacement, displacement
from pneumorph.mechanics.assembly.model import Model, near_tip
from pneumorph.mechanics.assembly.potential import Group, Potential, value_and_residual
from pneumorph.mechanics.elements.energy import ElementEnergy
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.reinforcement import Reinforcement
from pneumorph.mechanics.elements.taut import (
    Pull,
    Taut,
    metrics,
    metrics_along,
    tensions,
    tensions_along,
    with_data,
)
from pneumorph.mechanics.elements.terms import Connectivity, Loads

Metrics = Sequence[np.ndarray]
"""Metrics (E, 3, 3) of the faces under every sheet and all fibres, in the order of the terms."""


def laid_on(potential: Potential) -> Iterator[tuple[Connectivity, Reinforcement]]:
    """Sheets and fibres, with the faces that they cover."""
    for seen, energies in potential.groups:
        for energy in energies:
            if isinstance(energy, Reinforcement):
                yield seen, energy


def metrics_at(model: Model, X: np.ndarray, state: State) -> Metrics:
    """The metrics of the faces as they are in a state; none without sheets and fibres."""
    if not model.reinforcements:
        return ()
    u = displacement(model.tip, X, state)
    return [metrics(seen, seen.local(X, u, state)) for seen, _ in laid_on(model.potential)]


def metrics_after(model: Model, X: np.ndarray, state: State, dx: np.ndarray) -> Metrics:
    """Those after a change of places dx (N, 3), to first order: what turns is not stretched by that."""
    if not model.reinforcements:
        return ()
    u, found = displacement(model.tip, X, state), []
    for seen, _ in laid_on(model.potential):
        at = seen.local(X, u, state)
        found.append(metrics(seen, at) + metrics_along(seen, at, dx[seen.nodes]))
    return found


def metrics_along_state(model: Model, X: np.ndarray, state: State, change: State) -> Metrics:
    """Their derivative along a change of state."""
    if not model.reinforcements:
        return ()
    nodes = Displacement(model.tip, X, state)
    du = nodes.along(change)
    return [metrics_along(seen, seen.local(X, nodes.u, state), du[seen.nodes]) for seen, _ in laid_on(model.potential)]


def taut(model: Model, given: Metrics) -> Potential:
    """The potential whose tangent is that with given metrics eliminated."""
    return _with(model, given, Taut, model.potential.groups)


def pulled(model: Model, X: np.ndarray, state: State, loads: Loads, given: Metrics) -> np.ndarray:
    """By how much the residual (n,) is another with the tensions of given metrics in place of the state's own."""
    u, own, pull = displacement(model.tip, X, state), [], []
    for (seen, energy), each in zip(laid_on(model.potential), given, strict=True):
        at = seen.local(X, u, state)
        own.append(tensions(energy, seen, at, loads, metrics(seen, at)))
        pull.append(tensions(energy, seen, at, loads, each))
    return pulling(model, X, state, loads, [there - here for here, there in zip(own, pull, strict=True)])


def pulling(model: Model, X: np.ndarray, state: State, loads: Loads, tension: Metrics) -> np.ndarray:
    """The part BᵀS of the residual (n,) of given tensions S."""
    only = [group for group in model.potential.groups if any(isinstance(e, Reinforcement) for e in group.energies)]
    potential = _with(model, tension, lambda _: Pull(), only)._replace(contact=None)
    return model.vector(value_and_residual(potential, X, state, loads)[1])


def missing(model: Model, X: np.ndarray, state: State, loads: Loads, given: Metrics, change: Metrics) -> np.ndarray:
    """BᵀW″(m) δm (n,): what a change δm of given metrics m adds to the residual, by the tangent at a state."""
    u, found = displacement(model.tip, X, state), []
    for (seen, energy), each, by in zip(laid_on(model.potential), given, change, strict=True):
        found.append(tensions_along(energy, seen, seen.local(X, u, state), loads, each, by))
    return pulling(model, X, state, loads, found)


def _with(
    model: Model, values: Metrics, wrap: Callable[[Reinforcement], ElementEnergy], groups: Sequence[Group]
) -> Potential:
    """The potential of these groups with other energies of sheets and fibres, which have values (E, 3, 3) beside."""
    following = iter(values)
    found, wrapped = [], []
    for seen, energies in groups:
        if any(isinstance(energy, Reinforcement) for energy in energies):
            (energy,) = energies
            assert isinstance(energy, Reinforcement)
            found.append(Group(with_data(seen, next(following)), (wrap(energy),)))
            wrapped.append(found[-1])
        else:
            found.append(Group(seen, energies))
    others = [each for each in model.potential.near_tip if not any(isinstance(e, Reinforcement) for e in each.energies)]
    near = (*others, *near_tip(wrapped, model.sparsity.number))
    return model.potential._replace(groups=tuple(found), near_tip=near)
