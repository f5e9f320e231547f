"""The total potential and the residual, as sums over the terms.

Every term enters Π, the residual, the products with second derivatives (`products.py`) and the assembled tangent
(`hessian.py`): nothing there depends on which terms there are.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace
from typing import NamedTuple

import numpy as np

from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.assembly.tip import Tip
from pneumorph.mechanics.contact.contact import Contact, PosedTouch
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

    def touches(self, x: np.ndarray, state: State, loads: Loads) -> Iterator[tuple[PosedTouch, int | None, int | None]]:
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
    groups: dict[int, Group] = {}
    for connectivity, energy in terms:
        group = groups.setdefault(id(connectivity), Group(connectivity, ()))
        groups[id(connectivity)] = group._replace(energies=(*group.energies, energy))
    return tuple(groups.values())


def without_solid(potential: Potential) -> Potential:
    """The terms but for solids and contact in pairs: all that loads enter."""
    groups = [
        Group(elements, tuple(energy for energy in energies if not energy.of_rubber))
        for elements, energies in potential.groups
    ]
    return potential._replace(groups=tuple(group for group in groups if group.energies), contact=None)


def total(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> float:
    """Π in N·mm.

    Parameters
    ----------
    potential, X, state, loads
        As for `value_and_residual`.
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
    nodes = Displacement(potential.tip, X, state)
    value, full = forces(potential, potential.groups, nodes, loads)
    return value, nodes.on_unknowns(full)


def contact_residual(potential: Potential, X: np.ndarray, state: State, loads: Loads) -> State:
    """The part of R that obstacles exert.

    Parameters
    ----------
    potential, X, state, loads
        As for `value_and_residual`.
    """
    assert potential.contact is not None
    contact = replace(potential.contact, own=None)
    groups = [group for group in potential.groups if group.connectivity is contact.surface]
    nodes = Displacement(potential.tip, X, state)
    return nodes.on_unknowns(forces(potential._replace(contact=contact), groups, nodes, loads)[1])


def forces(potential: Potential, groups: Iterable[Group], nodes: Displacement, loads: Loads) -> tuple[float, State]:
    """The energy of some groups and of all contact in pairs, and its derivatives by all displacements and unknowns.

    The derivatives by the plate are those of elements that see it: what rides on it is not included.

    Parameters
    ----------
    potential : Potential
    groups : iterable of Group
        Of the potential.
    nodes : Displacement
        Nodes and state.
    loads : Loads
        In the units of `Loads`.
    """
    value, by = 0.0, nodes.none()
    for elements, energies in groups:
        at = elements.local(nodes.X, nodes.u, nodes.state)
        for energy in energies:
            part, derivatives = energy.forces(elements, at, loads)
            value += part
            add(elements, derivatives, by)
    for touch, _, free in potential.touches(nodes.X + nodes.u, nodes.state, loads):
        value += touch.energy
        by.u[:] += touch.slope
        if free is not None:
            by.objects[free] += touch.by_pose
    return value, by


def add(elements: Connectivity, of_elements: Forces, by: State) -> None:
    """Add the forces of elements to those on all nodes and unknowns."""
    add_rows(of_elements.u, elements.nodes, by.u)
    if elements.hydrostatics.shape[1]:
        np.add.at(by.hydrostatic, elements.hydrostatics, of_elements.hydrostatic)
    if elements.plate:
        by.plate[:] += of_elements.plate
    if elements.objects:
        by.objects[:] += of_elements.objects
