"""The total potential and its derivatives, as sums over the terms.

Every term enters Π, the residual, the products with second derivatives and, by `hessian.py`, the assembled tangent:
nothing here depends on which terms there are.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import replace
from typing import NamedTuple

import jax
import numpy as np
from scipy import sparse

from pneumorph.mechanics.assembly.tip import Ride, Tip
from pneumorph.mechanics.contact.contact import Contact, SeenTouch
from pneumorph.mechanics.contact.pose import STILL
from pneumorph.mechanics.elements.energy import ElementEnergy, Forces, Term
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.points import add_rows
from pneumorph.mechanics.elements.terms import Connectivity, Loads


class Group(NamedTuple):
    """The energies of all terms over one connectivity, whose nodal values are gathered once for all of them."""

    connectivity: Connectivity
    energies: tuple[ElementEnergy, ...]


class Potential(NamedTuple):
    """Π of a model.

    Attributes
    ----------
    groups : tuple of Group
        All terms.
    near_tip : tuple of Group
        Their elements that depend on the plate: those that see it or have a node on the tip.
    tip : Tip
        The nodes that follow the plate.
    contact : Contact or None
        What the surface may touch; its obstacles are terms, its pairs are evaluated beside them.
    """

    groups: tuple[Group, ...]
    near_tip: tuple[Group, ...]
    tip: Tip
    contact: Contact | None = None

    @property
    def has_pairs(self) -> bool:
        """Whether there is contact whose connectivity changes with the state."""
        return self.contact is not None and self.contact.changes

    def touches(self, x: np.ndarray, state: State, loads: Loads) -> Iterator[tuple[SeenTouch, int | None, int | None]]:
        """That contact with nodes at x (N, 3), each with the number of an obstacle, or None for the body itself.

        And with the row of its unknowns, None for one that is not free.
        """
        if self.contact is not None:
            objects = {number: row for row, number in enumerate(self.contact.rows)}
            for touch, number in self.contact.touches(x, poses(self, state, loads)):
                yield touch, number, None if number is None else objects.get(number)


def poses(potential: Potential, state: State, loads: Loads) -> np.ndarray:
    """The poses (K, 6) of all obstacles."""
    if potential.contact is None:
        return np.zeros((0, 6))
    return potential.contact.poses(np.asarray(loads.shift), state.objects)


def grouped(terms: Iterable[Term]) -> tuple[Group, ...]:
    """The terms, grouped by connectivity."""
    found: dict[int, Group] = {}
    for connectivity, energy in terms:
        group = found.setdefault(id(connectivity), Group(connectivity, ()))
        found[id(connectivity)] = group._replace(energies=(*group.energies, energy))
    return tuple(found.values())


def without_solid(potential: Potential) -> Potential:
    """The terms but for solids and contact in pairs: all that loads enter."""
    groups = [
        Group(seen, tuple(energy for energy in energies if not energy.of_rubber)) for seen, energies in potential.groups
    ]
    return potential._replace(groups=tuple(group for group in groups if group.energies), contact=None)


def total(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> float:
    """Π in N·mm for nodes X (N, 3).

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    """
    return value_and_residual(potential, X, state, loads)[0]


def value_and_residual(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> tuple[float, State]:
    """Π and R = ∂Π/∂(u, plate, π, objects).

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    """
    ride = Ride(potential.tip, X, state.plate)
    value, full = _forces(potential, potential.groups, X, state, loads, ride)
    return value, _on_unknowns(ride, full)


def contact_residual(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> State:
    """The part of R that obstacles exert.

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    """
    assert potential.contact is not None
    ride, contact = Ride(potential.tip, X, state.plate), replace(potential.contact, own=None)
    groups = [group for group in potential.groups if group.connectivity is contact.surface]
    return _on_unknowns(ride, _forces(potential._replace(contact=contact), groups, X, state, loads, ride)[1])


def tangent_product(potential: Potential, X: np.ndarray, state: State, loads: Loads, direction: State) -> State:
    """K·direction without a matrix: the derivative of the residual along a change of state.

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    direction : State
        Change of the unknowns.
    """
    return tangent_map(potential, X, state, loads)(direction)


def tangent_map(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> Callable[[State], State]:
    """The same as a function of the direction, for several: what does not depend on it is computed once.

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    """
    ride, tip, nodes = Ride(potential.tip, X, state.plate), potential.tip, potential.tip.nodes
    u = _displacement(tip, state.u, ride.displacement())
    prepared = []
    for seen, energies in potential.groups:
        at = seen.local(X, u, state)
        prepared.append((seen, [energy.tangent_map(seen, at, loads) for energy in energies]))
    touches = [(touch, free) for touch, _, free in potential.touches(X + u, state, loads)]
    on_tip = _forces(potential, potential.near_tip, X, state, loads, ride)[1].u[nodes] if len(nodes) else None

    def product(direction: State) -> State:
        du = _displacement(tip, direction.u, ride.along(direction.plate))
        by = _nothing(X, state)
        for seen, maps in prepared:
            along = seen.moving(du, direction)
            for each in maps:
                _add(seen, each(along), by)
        for touch, free in touches:
            by_x, by_pose = touch.change(du, STILL if free is None else direction.objects[free])
            by.u[:] += by_x
            if free is not None:
                by.objects[free] += by_pose
        changed = _on_unknowns(ride, by)
        if on_tip is None or not np.any(direction.plate):
            return changed
        return changed._replace(plate=changed.plate + ride.on_plate_changed(on_tip, direction.plate))

    return product


def shape_product(potential: Potential, X: np.ndarray, state: State, loads: Loads, dX: np.ndarray) -> State:
    """(∂R/∂X)·dX for a motion dX (N, 3) of the nodes.

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    dX : (N, 3) array
        Motion of the nodes, mm.
    """
    return _change(potential, X, state, loads, jax.tree.map(np.zeros_like, state), dX, _none(loads))


def load_product(potential: Potential, X: np.ndarray, state: State, loads: Loads, change: Loads) -> State:
    """(∂R/∂loads)·change for a change of the loads.

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    change : Loads
        Change of the loads.
    """
    return _change(potential, X, state, loads, jax.tree.map(np.zeros_like, state), None, change)


def pullback(
    potential: Potential, X: np.ndarray, state: State, loads: Loads, ws: Sequence[State]
) -> list[tuple[np.ndarray, Loads]]:
    """∂(wᵀR)/∂X (N, 3) and ∂(wᵀR)/∂loads for every adjoint state w.

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    ws : sequence of State
        Adjoint states, per N and N·mm.
    """
    ride, tip, nodes = Ride(potential.tip, X, state.plate), potential.tip, potential.tip.nodes
    u = _displacement(tip, state.u, ride.displacement())
    by_X, by_u, by_w = np.zeros((3, len(ws), *X.shape))
    acting = [_none(loads) for _ in ws]

    def parts(groups: Iterable[Group], on_forces: bool):
        """For every energy of the groups and every w: its number, the connectivity, and what is pulled back."""
        for seen, energies in groups:
            at = seen.local(X, u, state)
            pulls = [energy.pullback(seen, at, loads, len(ws) > 1, on_forces) for energy in energies]
            for k, w in enumerate(ws):
                along = seen.local(X, _displacement(tip, w.u, ride.along(w.plate)), w)
                for pull in pulls:
                    yield k, seen, pull(Forces(along.u, along.hydrostatic, along.plate, along.objects))

    for k, seen, found in parts(potential.groups, False):
        add_rows(found.X, seen.nodes, by_X[k])
        acting[k] = jax.tree.map(np.add, acting[k], found.loads)
    # Only those of the tip's nodes are used.
    for k, seen, found in parts(potential.near_tip if len(nodes) else (), True):
        add_rows(found.u, seen.nodes, by_u[k])
        add_rows(found.w, seen.nodes, by_w[k])
    for touch, number, free in potential.touches(X + u, state, loads):
        for k, w in enumerate(ws):
            moving = STILL if free is None else w.objects[free]
            pulled, by_pose = touch.change(_displacement(tip, w.u, ride.along(w.plate)), moving)
            by_X[k] += pulled
            by_u[k] += pulled
            by_w[k] += touch.slope
            if number is not None:
                acting[k].shift[number] += by_pose
    if len(nodes):
        for k, w in enumerate(ws):
            by_X[k, nodes] += ride.on_places(by_u[k, nodes]) + ride.on_places_along(by_w[k, nodes], w.plate)
    return list(zip(by_X, acting, strict=True))


def plate_columns(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> State:
    """∂R/∂plate without contact in pairs: u (N, 3, 6), plate (6, 6), and in mixed elements π (…, 6).

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
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
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    """
    groups = tuple(group for group in potential.groups if group.connectivity.objects)
    still = jax.tree.map(np.zeros_like, state)
    units = np.eye(state.objects.size).reshape(state.objects.size, *state.objects.shape)
    product = tangent_map(potential._replace(groups=groups), X, state, loads)
    return [product(still._replace(objects=unit)) for unit in units]


def pulled_to_unknowns(tip: Tip, X: np.ndarray, state: State, by_u: np.ndarray) -> tuple[State, np.ndarray]:
    """Turn derivatives (N, 3) by all displacements into those by the unknowns and, through the tip, by X (N, 3).

    Parameters
    ----------
    tip : Tip
        The nodes that follow the plate.
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    by_u : (N, 3) array
        Derivatives by the displacements of all nodes.
    """
    ride, by_X = Ride(tip, X, state.plate), np.zeros(X.shape)
    if len(tip.nodes):
        by_X[tip.nodes] = ride.on_places(by_u[tip.nodes])
    return _on_unknowns(ride, _nothing(X, state)._replace(u=by_u.copy())), by_X


def displacement(tip: Tip, X: np.ndarray, state: State) -> np.ndarray:
    """Displacements of all nodes (N, 3); those on the tip follow the plate, images what they are images of."""
    return _displacement(tip, state.u, Ride(tip, X, state.plate).displacement())


def displacement_along(tip: Tip, X: np.ndarray, state: State, change: State) -> np.ndarray:
    """Derivative (N, 3) of the displacements along a change of state.

    Parameters
    ----------
    tip : Tip
        The nodes that follow the plate.
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    change : State
        Change of the unknowns.
    """
    return displacement_maps(tip, X, state)[0](change)


def displacement_maps(
    tip: Tip, X: np.ndarray, state: State
) -> tuple[Callable[[State], np.ndarray], Callable[[np.ndarray], State]]:
    """The derivative of all displacements (N, 3), as a function of a change of state, and its transpose."""
    ride = Ride(tip, X, state.plate)

    def along(change: State) -> np.ndarray:
        return _displacement(tip, change.u, ride.along(change.plate))

    def pulled(by_u: np.ndarray) -> State:
        return _on_unknowns(ride, _nothing(X, state)._replace(u=by_u.copy()))

    return along, pulled


def contact_tangent(
    potential: Potential, X: np.ndarray, state: State, loads: Loads
) -> tuple[sparse.csr_array, np.ndarray]:
    """Of contact in pairs: ∂²E/∂x∂x (3N, 3N) by the places of all nodes, and what the plate's turn adds (6, 6).

    Parameters
    ----------
    potential : Potential
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    state : State
        The unknowns.
    loads : Loads
        In the units of `Loads`.
    """
    ride = Ride(potential.tip, X, state.plate)
    x = X + _displacement(potential.tip, state.u, ride.displacement())
    found, turned = sparse.csr_array((X.size, X.size)), np.zeros((6, 6))
    for touch, _, _ in potential.touches(x, state, loads):
        found = found + touch.hessian
        if len(potential.tip.nodes):
            forces = touch.slope[potential.tip.nodes]
            turned += np.stack([ride.on_plate_changed(forces, unit) for unit in np.eye(6)], axis=-1)
    return found, turned


def _forces(
    potential: Potential, groups: Iterable[Group], X, state: State, loads: Loads, ride: Ride
) -> tuple[float, State]:
    """The sum of energies, and its derivatives by all displacements, by π, and by the plate where elements see it.

    Of `groups` of the potential's, and all its contact in pairs.
    """
    u = _displacement(ride.tip, state.u, ride.displacement())
    value, by = 0.0, _nothing(X, state)
    for seen, energies in groups:
        at = seen.local(X, u, state)
        for energy in energies:
            part, found = energy.forces(seen, at, loads)
            value += part
            _add(seen, found, by)
    for touch, _, free in potential.touches(X + u, state, loads):
        value += touch.energy
        by.u[:] += touch.slope
        if free is not None:
            by.objects[free] += touch.by_pose
    return value, by


def _change(potential: Potential, X, state: State, loads: Loads, dstate: State, dX, dloads: Loads) -> State:
    """Derivative of R along a change of state, nodes and loads."""
    ride, tip, nodes = Ride(potential.tip, X, state.plate), potential.tip, potential.tip.nodes
    moving = ride.along(dstate.plate) if dX is None else ride.along(dstate.plate) + ride.moved(dX[nodes])
    u, du = _displacement(tip, state.u, ride.displacement()), _displacement(tip, dstate.u, moving)
    motion = np.zeros(X.shape) if dX is None else dX
    by = _nothing(X, state)
    for seen, energies in potential.groups:
        at = seen.local(X, u, state)
        along = seen.local(motion, du, dstate)
        for energy in energies:
            _add(seen, energy.change(seen, at, loads, along, dloads), by)
    for touch, number, free in potential.touches(X + u, state, loads):
        moved = STILL if number is None else dloads.shift[number]
        if free is None:
            by.u[:] += touch.change(motion + du, moved)[0]
        else:
            by_x, by_pose = touch.change(motion + du, moved + dstate.objects[free])
            by.u[:] += by_x
            by.objects[free] += by_pose
    changed = _on_unknowns(ride, by)
    if len(nodes) and (dX is not None or np.any(dstate.plate)):
        _, forces = _forces(potential, potential.near_tip, X, state, loads, ride)
        turned = ride.on_plate_changed(forces.u[nodes], dstate.plate, None if dX is None else dX[nodes])
        changed = changed._replace(plate=changed.plate + turned)
    return changed


def _add(seen: Connectivity, found: Forces, by: State) -> None:
    add_rows(found.u, seen.nodes, by.u)
    if seen.hydrostatics.shape[1]:
        np.add.at(by.hydrostatic, seen.hydrostatics, found.hydrostatic)
    if seen.plate:
        by.plate[:] += found.plate
    if seen.objects:
        by.objects[:] += found.objects


def _nothing(X: np.ndarray, state: State) -> State:
    """Zeros by all nodes and unknowns."""
    return State(np.zeros(X.shape), *(np.zeros(part.shape) for part in state[1:]))


def _displacement(tip: Tip, u: np.ndarray, on_tip: np.ndarray) -> np.ndarray:
    full = np.array(u, dtype=float)
    full[tip.nodes] = on_tip
    tip.tied.led(full)
    return full


def _on_unknowns(ride: Ride, full: State) -> State:
    """Convert forces on all nodes to forces on the unknowns: those on the tip act on the plate, see also `Tied`."""
    nodes = ride.tip.nodes
    ride.tip.tied.gathered(full.u)
    if not len(nodes):
        return full
    plate = full.plate + ride.on_plate(full.u[nodes])
    full.u[nodes] = 0.0
    return full._replace(plate=plate)


def _none(loads: Loads) -> Loads:
    return jax.tree.map(lambda load: np.zeros(np.shape(load)), loads)
