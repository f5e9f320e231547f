"""The metrics of all sheets and fibres of a model as unknowns of their own; see `elements/taut.py`."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from typing import cast

import numpy as np

from pneumorph.mechanics.assembly.build import near_tip
from pneumorph.mechanics.assembly.displacement import Displacement, displacement
from pneumorph.mechanics.assembly.model import Model
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


def covers(potential: Potential) -> Iterator[tuple[Connectivity, Reinforcement]]:
    """Sheets and fibres, with the faces that they cover."""
    for elements, energies in potential.groups:
        if covering(energies):
            yield elements, cast(Reinforcement, energies[0])


def covering(energies: Sequence[ElementEnergy]) -> bool:
    """Whether these are the energy of a sheet or of fibres, which has its faces alone."""
    return any(energy.of_cover for energy in energies)


def metrics_at(model: Model, X: np.ndarray, state: State) -> Metrics:
    """The metrics of the faces as they are in a state; none without sheets and fibres."""
    if not model.reinforcements:
        return ()
    u = displacement(model.tip, X, state)
    return [metrics(elements, elements.local(X, u, state)) for elements, _ in covers(model.potential)]


def metrics_after(model: Model, X: np.ndarray, state: State, dx: np.ndarray) -> Metrics:
    """The metrics after a change of places, to first order: what turns is not stretched by that.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    dx : (N, 3) array
        Change of the places of all nodes, mm.
    """
    if not model.reinforcements:
        return ()
    u, after = displacement(model.tip, X, state), []
    for elements, _ in covers(model.potential):
        at = elements.local(X, u, state)
        after.append(metrics(elements, at) + metrics_along(elements, at, elements.gathered(dx)))
    return after


def metrics_along_state(model: Model, X: np.ndarray, state: State, change: State) -> Metrics:
    """Their derivative along a change of state.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    change : State
        Change of the unknowns.
    """
    if not model.reinforcements:
        return ()
    nodes = Displacement(model.tip, X, state)
    du = nodes.along(change)
    return [
        metrics_along(elements, elements.local(X, nodes.u, state), elements.gathered(du))
        for elements, _ in covers(model.potential)
    ]


def taut(model: Model, given: Metrics) -> Potential:
    """The potential whose tangent is that with given metrics eliminated."""
    return _with(model, given, Taut, model.potential.groups)


def pulled(model: Model, X: np.ndarray, state: State, loads: Loads, given: Metrics) -> np.ndarray:
    """By how much the residual (n,) is another with the tensions of given metrics.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    given : Metrics
        In place of the state's own.
    """
    u, own, pull = displacement(model.tip, X, state), [], []
    for (elements, energy), each in zip(covers(model.potential), given, strict=True):
        at = elements.local(X, u, state)
        own.append(tensions(energy, elements, at, loads, metrics(elements, at)))
        pull.append(tensions(energy, elements, at, loads, each))
    return pulling(model, X, state, loads, [there - here for here, there in zip(own, pull, strict=True)])


def pulling(model: Model, X: np.ndarray, state: State, loads: Loads, tension: Metrics) -> np.ndarray:
    """The part BᵀS of the residual (n,) of given tensions S.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    tension : Metrics
        S, (E, 3, 3) N/mm for each term.
    """
    only = [group for group in model.potential.groups if covering(group.energies)]
    potential = _with(model, tension, lambda _: Pull(), only)._replace(contact=None)
    return model.vector(value_and_residual(potential, X, state, loads)[1])


def missing(model: Model, X: np.ndarray, state: State, loads: Loads, given: Metrics, change: Metrics) -> np.ndarray:
    """BᵀW″(m) δm (n,): what a change δm of given metrics m adds to the residual, by the tangent at a state.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    given : Metrics
        m.
    change : Metrics
        δm.
    """
    u, tension = displacement(model.tip, X, state), []
    for (elements, energy), each, by in zip(covers(model.potential), given, change, strict=True):
        tension.append(tensions_along(energy, elements, elements.local(X, u, state), loads, each, by))
    return pulling(model, X, state, loads, tension)


def _with(
    model: Model, values: Metrics, wrap: Callable[[Reinforcement], ElementEnergy], groups: Sequence[Group]
) -> Potential:
    """The potential of these groups with other energies of sheets and fibres, which have values (E, 3, 3) beside."""
    following = zip(covers(model.potential), values, strict=True)
    changed, wrapped = [], []
    for group in groups:
        if covering(group.energies):
            (elements, energy), value = next(following)
            group = Group(with_data(elements, value), (wrap(energy),))
            wrapped.append(group)
        changed.append(group)
    others = [group for group in model.potential.near_tip if not covering(group.energies)]
    near = (*others, *near_tip(wrapped, model.sparsity.number))
    return model.potential._replace(groups=tuple(changed), near_tip=near)
