"""Products with second derivatives of the total potential, without matrices: along changes of state, nodes, loads."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence

import jax
import numpy as np

from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.assembly.potential import Group, Potential, add, forces
from pneumorph.mechanics.contact.pose import STILL
from pneumorph.mechanics.elements.energy import Forces, Pulled
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.points import add_rows
from pneumorph.mechanics.elements.several import TOGETHER
from pneumorph.mechanics.elements.terms import Connectivity, Loads


def tangent_product(potential: Potential, X: np.ndarray, state: State, loads: Loads, direction: State) -> State:
    """K·direction: the derivative of the residual along a change of the unknowns.

    Parameters
    ----------
    potential, X, state, loads
        As for `potential.value_and_residual`.
    direction : State
        Change of the unknowns.
    """
    return tangent_map(potential, X, state, loads)(direction)


def tangent_map(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> Callable[[State], State]:
    """The same as a function of the direction, for several: what does not depend on it is computed once.

    Parameters
    ----------
    potential, X, state, loads
        As for `potential.value_and_residual`.
    """
    nodes, tip = Displacement(potential.tip, X, state), potential.tip.nodes
    prepared = []
    for elements, energies in potential.groups:
        at = elements.local(X, nodes.u, state)
        prepared.append((elements, [energy.tangent_map(elements, at, loads) for energy in energies]))
    touches = [(touch, free) for touch, _, free in potential.touches(X + nodes.u, state, loads)]
    on_tip = forces(potential, potential.near_tip, nodes, loads)[1].u[tip] if len(tip) else None

    def product(direction: State) -> State:
        du, by = nodes.along(direction), nodes.none()
        for elements, maps in prepared:
            along = elements.moving(du, direction)
            for each in maps:
                add(elements, each(along), by)
        for touch, free in touches:
            by_x, by_pose = touch.change(du, STILL if free is None else direction.objects[free])
            by.u[:] += by_x
            if free is not None:
                by.objects[free] += by_pose
        changed = nodes.on_unknowns(by)
        if on_tip is None or not np.any(direction.plate):
            return changed
        return changed._replace(plate=changed.plate + nodes.ride.on_plate_changed(on_tip, direction.plate))

    return product


def shape_product(potential: Potential, X: np.ndarray, state: State, loads: Loads, dX: np.ndarray) -> State:
    """(∂R/∂X)·dX.

    Parameters
    ----------
    potential, X, state, loads
        As for `potential.value_and_residual`.
    dX : (N, 3) array
        Motion of the nodes, mm.
    """
    nodes, tip = Displacement(potential.tip, X, state), potential.tip.nodes
    still = jax.tree.map(np.zeros_like, state)
    du = nodes.along(still, dX)
    changed = nodes.on_unknowns(_change(potential, nodes, loads, dX, du, _none(loads)))
    if len(tip):
        _, full = forces(potential, potential.near_tip, nodes, loads)
        turned = nodes.ride.on_plate_changed(full.u[tip], still.plate, dX[tip])
        changed = changed._replace(plate=changed.plate + turned)
    return changed


def load_product(potential: Potential, X: np.ndarray, state: State, loads: Loads, change: Loads) -> State:
    """(∂R/∂loads)·change.

    Parameters
    ----------
    potential, X, state, loads
        As for `potential.value_and_residual`.
    change : Loads
        Change of the loads.
    """
    nodes, still = Displacement(potential.tip, X, state), np.zeros(X.shape)
    return nodes.on_unknowns(_change(potential, nodes, loads, still, still, change))


def pullback(
    potential: Potential, X: np.ndarray, state: State, loads: Loads, ws: Sequence[State]
) -> list[tuple[np.ndarray, Loads]]:
    """∂(wᵀR)/∂X (N, 3) and ∂(wᵀR)/∂loads for every adjoint state w.

    Parameters
    ----------
    potential, X, state, loads
        As for `potential.value_and_residual`.
    ws : sequence of State
        Adjoint states, per N and N·mm.
    """
    nodes, tip = Displacement(potential.tip, X, state), potential.tip.nodes
    by_X, by_u, by_w = np.zeros((3, len(ws), *X.shape))
    acting, moved = [_none(loads) for _ in ws], [nodes.along(w) for w in ws]

    def parts(groups: Iterable[Group], on_forces: bool) -> Iterator[tuple[int, Connectivity, Pulled]]:
        """For every energy of the groups and every w: its number, the connectivity, and what is pulled back."""
        for elements, energies in groups:
            at = elements.local(X, nodes.u, state)
            pulls = [energy.pullback(elements, at, loads, on_forces) for energy in energies]
            for k, (du, w) in enumerate(zip(moved, ws, strict=True) if pulls else ()):
                along = elements.moving(du, w)
                for pull in pulls:
                    yield k, elements, pull(Forces(along.u, along.hydrostatic, along.plate, along.objects))

    several, each = [], []
    for elements, energies in potential.groups:
        at = elements.local(X, nodes.u, state)
        pulls = [energy.pullback_of_several(elements, at) if len(ws) > 1 else None for energy in energies]
        several += [pull for pull in pulls if pull is not None]
        left = (energy for energy, pull in zip(energies, pulls, strict=True) if pull is None)
        each.append(Group(elements, tuple(left)))
    for pull in several:
        for first in range(0, len(ws), TOGETHER):
            own = slice(first, first + TOGETHER)
            by_X[own] += pull(moved[own], ws[own])
    for k, elements, pulled in parts(each, False):
        add_rows(pulled.X, elements.nodes, by_X[k])
        acting[k] = jax.tree.map(np.add, acting[k], pulled.loads)
    # Only those of the tip's nodes are used.
    for k, elements, pulled in parts(potential.near_tip if len(tip) else (), True):
        add_rows(pulled.u, elements.nodes, by_u[k])
        add_rows(pulled.w, elements.nodes, by_w[k])
    for touch, number, free in potential.touches(X + nodes.u, state, loads):
        for k, w in enumerate(ws):
            by_x, by_pose = touch.change(moved[k], STILL if free is None else w.objects[free])
            by_X[k] += by_x
            by_u[k] += by_x
            by_w[k] += touch.slope
            if number is not None:
                acting[k].shift[number] += by_pose
    if len(tip):
        ride = nodes.ride
        for k, w in enumerate(ws):
            by_X[k, tip] += ride.on_places(by_u[k, tip]) + ride.on_places_along(by_w[k, tip], w.plate)
    return list(zip(by_X, acting, strict=True))


def plate_columns(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> State:
    """∂R/∂plate without contact in pairs: u (N, 3, 6), plate (6, 6), and in mixed elements π (…, 6).

    Parameters
    ----------
    potential, X, state, loads
        As for `potential.value_and_residual`.
    """
    near = potential._replace(groups=potential.near_tip, contact=None)
    still = jax.tree.map(np.zeros_like, state)
    product = tangent_map(near, X, state, loads)
    columns = [product(still._replace(plate=unit)) for unit in np.eye(6)]
    return State(*(np.stack(parts, axis=-1) for parts in zip(*columns, strict=True)))


def object_columns(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> list[State]:
    """∂R/∂objects: the change of R along each unknown of the free obstacles, row after row.

    Parameters
    ----------
    potential, X, state, loads
        As for `potential.value_and_residual`.
    """
    groups = tuple(group for group in potential.groups if group.connectivity.objects)
    still = jax.tree.map(np.zeros_like, state)
    units = np.eye(state.objects.size).reshape(state.objects.size, *state.objects.shape)
    product = tangent_map(potential._replace(groups=groups), X, state, loads)
    return [product(still._replace(objects=unit)) for unit in units]


def _change(
    potential: Potential, nodes: Displacement, loads: Loads, dX: np.ndarray, du: np.ndarray, dloads: Loads
) -> State:
    """The change of the forces on all nodes and unknowns along motions dX, du (N, 3) and a change of the loads."""
    X, state = nodes.X, nodes.state
    still, by = jax.tree.map(np.zeros_like, state), nodes.none()
    for elements, energies in potential.groups:
        at, along = elements.local(X, nodes.u, state), elements.local(dX, du, still)
        for energy in energies:
            add(elements, energy.change(elements, at, loads, along, dloads), by)
    for touch, number, free in potential.touches(X + nodes.u, state, loads):
        moved = STILL if number is None else dloads.shift[number]
        by_x, by_pose = touch.change(dX + du, moved)
        by.u[:] += by_x
        if free is not None:
            by.objects[free] += by_pose
    return by


def _none(loads: Loads) -> Loads:
    return jax.tree.map(lambda load: np.zeros(np.shape(load)), loads)
