"""Fast derivatives of the solid: those at the quadrature points are in `response.py`, Numba kernels do the rest.

No geometry is differentiated, and what is compiled depends on the kind of rubber alone. A test compares all of it with
the general way of `energy.py`.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import ClassVar

import jax
import jax.numpy as jnp
import numpy as np
from jax import Array
from jax.tree_util import register_dataclass

from pneumorph.mechanics.elements import points
from pneumorph.mechanics.elements.element import TET_CORNER_N, TET_DN, TET_WEIGHT, tet_energies
from pneumorph.mechanics.elements.energy import Blocks, ElementEnergy, Forces, Pulled, PullSeveral
from pneumorph.mechanics.elements.kinematics import State, volume_ratio
from pneumorph.mechanics.elements.response import (
    Along,
    StrainedPoints,
    Tangents,
    along_at,
    couplings_at,
    invariant_derivatives,
    moduli_at,
    stress_at,
    tangents_at,
)
from pneumorph.mechanics.elements.several import (
    TET_SLOPES,
    TOGETHER,
    add_side_by_side,
    shape_forces_of_several,
    side_by_side,
)
from pneumorph.mechanics.elements.stiffness import (
    coupling_blocks,
    element_blocks,
    invariant_blocks,
    invariant_node_blocks,
    node_blocks,
)
from pneumorph.mechanics.elements.terms import Connectivity, Loads, Local, Values
from pneumorph.mechanics.material.energies import Energy
from pneumorph.mechanics.material.memory import PointParameters
from pneumorph.threads import each


@partial(register_dataclass, data_fields=["parameters"], meta_fields=["energy_density"])
@dataclass(frozen=True, eq=False)
class Solid(ElementEnergy):
    """∫ ψ(F, π) over tetrahedra of one rubber, of ten nodes and, where they are mixed, four hydrostatic unknowns."""

    of_rubber: ClassVar[bool] = True

    energy_density: Energy
    parameters: Values

    def energies(self, local: Local, loads: Loads) -> Array:
        own = self.at(local.data)
        return tet_energies(local.X, local.u, corner_hydrostatics(local), own.energy_density, own.parameters)

    def at(self, data: Values) -> Solid:
        """The same where the data of elements (C, k) are parameters of their points; here there are none."""
        return self

    def forces(self, elements: Connectivity, at: Local, loads: Loads) -> tuple[float, Forces]:
        """∫ψ over all elements, and its derivatives by u (E, 10, 3) and π (E, c)."""
        u, hydrostatic = np.empty(at.u.shape), np.zeros(at.hydrostatic.shape)

        def work(chunk: slice) -> float:
            here, own = strained(elements, at, chunk), self.at(at.data[chunk])
            psi, stress, slope = stress_at(own, here)
            points.nodal_forces(stress, here.A, here.measure, TET_DN, u[chunk])
            # Searches look at states so far away that their energy is not finite, and see it by the result.
            with np.errstate(over="ignore", invalid="ignore"):
                if elements.hydrostatics.shape[1]:
                    hydrostatic[chunk] = (here.measure * slope).T @ TET_CORNER_N
                return float(np.sum(here.measure * psi))

        return sum(each(work, elements.chunks())), _forces(at, u, hydrostatic)

    def change(self, elements: Connectivity, at: Local, loads: Loads, along: Local, dloads: Loads) -> Forces:
        """Change of the derivatives by u and π along a change of X, u and π.

        Parameters
        ----------
        elements : Connectivity
            Of the E elements of a nodes and c unknowns π.
        at : Local
            What the elements see: X and u (E, a, 3) in mm, π (E, c) in MPa.
        loads : Loads
            Unused: none enters.
        along : Local
            Change of what the elements see.
        dloads : Loads
            Unused.
        """
        u, hydrostatic = np.empty(at.u.shape), np.zeros(at.hydrostatic.shape)

        def work(chunk: slice) -> None:
            here, (dF, dA, growth) = strained(elements, at, chunk), _room(elements)
            points.straining(along.X[chunk], along.u[chunk], TET_DN, here.F, here.A, dF, dA, growth)
            dhydrostatic = _at_points(along.hydrostatic[chunk], elements.chunk)
            stress, slope, dstress, dslope = along_at(self.at(at.data[chunk]), here)(dF, dhydrostatic)
            # The forces ∫ P : δF are linear in the stress, in A and in the volumes: each changes in its turn.
            with_A = np.empty((elements.chunk, 10, 3))
            points.nodal_forces(dstress + growth * stress, here.A, here.measure, TET_DN, u[chunk])
            points.nodal_forces(stress, dA, here.measure, TET_DN, with_A)
            u[chunk] += with_A
            if elements.hydrostatics.shape[1]:
                hydrostatic[chunk] = (here.measure * (dslope + growth * slope)).T @ TET_CORNER_N

        each(work, elements.chunks())
        return _forces(at, u, hydrostatic)

    def tangent_map(self, elements: Connectivity, at: Local, loads: Loads) -> Callable[[Local], Forces]:
        """`change` as a function of changes of u (E, 10, 3) and π (E, c) alone: the rest is computed once."""
        prepared = each(lambda chunk: _linearised(self, elements, at, chunk, True), elements.chunks())

        def product(along: Local) -> Forces:
            u, hydrostatic = np.empty(at.u.shape), np.zeros(at.hydrostatic.shape)

            def work(part: Linearised) -> None:
                (chunk, here, change), dF = part, np.empty((3, 3, 4, elements.chunk))
                points.strain_along(along.u[chunk], TET_DN, here.A, dF)
                _, _, dstress, dslope = change(dF, _at_points(along.hydrostatic[chunk], elements.chunk))
                points.nodal_forces(dstress, here.A, here.measure, TET_DN, u[chunk])
                if elements.hydrostatics.shape[1]:
                    hydrostatic[chunk] = (here.measure * dslope).T @ TET_CORNER_N

            each(work, prepared)
            return _forces(at, u, hydrostatic)

        return product

    def pullback(
        self, elements: Connectivity, at: Local, loads: Loads, on_forces: bool = True
    ) -> Callable[[Forces], Pulled]:
        """A function of w = (u (E, 10, 3), π (E, c)): derivatives (E, 10, 3) of (∂∫ψ/∂(u, π))·w by X, u, and w's own u.

        The last two are zero without `on_forces`. What does not depend on w is computed once.

        Parameters
        ----------
        elements : Connectivity
            Of the E elements of a nodes and c unknowns π.
        at : Local
            What the elements see: X and u (E, a, 3) in mm, π (E, c) in MPa.
        loads : Loads
            Unused: none enters.
        on_forces : bool
            Whether the derivatives by u and by w's own u are wanted.
        """
        none = jax.tree.map(np.zeros_like, loads)
        prepared = each(lambda chunk: _linearised(self, elements, at, chunk, False), elements.chunks())

        def pull(w: Forces) -> Pulled:
            X, u, own = np.empty(at.u.shape), np.zeros(at.u.shape), np.zeros(at.u.shape)

            def work(part: Linearised) -> None:
                (chunk, here, along), slope = part, np.empty((3, 3, 4, elements.chunk))
                points.strain_along(w.u[chunk], TET_DN, here.A, slope)
                dhydrostatic = _at_points(w.hydrostatic[chunk], elements.chunk)
                stress, dilation, dstress, _ = along(slope, dhydrostatic)
                integrand = np.einsum("ij...,ij...->...", stress, slope) + dilation * dhydrostatic
                points.shape_forces(integrand, stress, dstress, slope, here.F, here.A, here.measure, TET_DN, X[chunk])
                if on_forces:
                    points.nodal_forces(dstress, here.A, here.measure, TET_DN, u[chunk])
                    points.nodal_forces(stress, here.A, here.measure, TET_DN, own[chunk])

            each(work, prepared)
            return Pulled(X, u, own, none)

        return pull

    def pullback_of_several(self, elements: Connectivity, at: Local) -> PullSeveral:
        """The moduli at the points are computed once, and `TOGETHER` w are pulled back at once."""

        def prepare(chunk: slice) -> tuple[slice, StrainedPoints, Tangents]:
            here = strained(elements, at, chunk)
            return chunk, here, tangents_at(self.at(at.data[chunk]), here)

        prepared = each(prepare, elements.chunks())

        def pull(moved: Sequence[np.ndarray], ws: Sequence[State]) -> np.ndarray:
            along, hydrostatic = side_by_side(moved), side_by_side([w.hydrostatic for w in ws])

            def work(part: tuple[slice, StrainedPoints, Tangents]) -> tuple[np.ndarray, np.ndarray]:
                chunk, here, tangents = part
                nodes, dhydrostatic = elements.nodes[chunk].T, np.zeros((4, elements.chunk, TOGETHER))
                if elements.hydrostatics.shape[1]:
                    dhydrostatic = np.tensordot(TET_CORNER_N, hydrostatic.take(elements.hydrostatics[chunk].T, 0), 1)
                slopes = np.tensordot(TET_SLOPES, along.take(nodes, axis=0), 1)
                shape_forces_of_several(slopes, dhydrostatic, *tangents, here.F, here.A, here.measure)
                return nodes, np.tensordot(TET_SLOPES, slopes, ((0, 1), (0, 1)))

            by_X = np.zeros(along.shape)
            for nodes, forces in each(work, prepared):
                add_side_by_side(forces, nodes, by_X)
            return np.moveaxis(by_X[..., : len(ws)], -1, 0)

        return pull

    def blocks(self, elements: Connectivity, at: Local, loads: Loads, ratios: np.ndarray | None = None) -> Blocks:
        """Second derivatives of every element by u and u (M, 55, 9), by u and π (M, 10, c, 3), by π and π (M, c, c).

        With volume ratios (4, M) at the points, elements without π have the stress U'(J) of these in place of their
        own J.

        Parameters
        ----------
        elements : Connectivity
            Of the E elements of a nodes and c unknowns π.
        at : Local
            What the elements see: X and u (E, a, 3) in mm, π (E, c) in MPa.
        loads : Loads
            Unused: none enters.
        ratios : (4, M) array, optional
            Volume ratios at the quadrature points.
        """
        count, corners = len(elements.nodes), elements.hydrostatics.shape[1]
        if ratios is not None:
            ratios = np.hstack([ratios, np.ones((4, count - elements.count))])
        motion, coupling = np.empty((count, 55, 9)), np.zeros((count, 10, corners, 3))
        compression = np.zeros((count, corners, corners))

        def work(chunk: slice) -> None:
            here, own = strained(elements, at, chunk), self.at(at.data[chunk])
            excess = None if ratios is None else float(self.parameters[-1]) * (ratios[:, chunk] - volume_ratio(here.F))
            if self.energy_density.of_invariants is not None:
                # Nine derivatives instead of eighty-one: half the time of the whole assembly.
                by_invariants = np.array(invariant_derivatives(own, here.F, here.hydrostatic)[0])
                if excess is not None:
                    by_invariants[2] += excess
                invariant_blocks(here.measure * by_invariants[:9], here.F, here.A, TET_DN, motion[chunk])
            else:
                element_blocks(moduli_at(own, here, excess), here.A, TET_DN, motion[chunk])
            if corners:
                _couple(own, here, coupling[chunk], compression[chunk])

        each(work, elements.chunks())
        return motion[: elements.count], coupling[: elements.count], compression[: elements.count]

    def node_blocks(self, elements: Connectivity, at: Local, loads: Loads) -> Blocks:
        """The same, but by u and u only of every node with itself (M, 10, 9).

        Parameters
        ----------
        elements : Connectivity
            Of the E elements of a nodes and c unknowns π.
        at : Local
            What the elements see: X and u (E, a, 3) in mm, π (E, c) in MPa.
        loads : Loads
            Unused: none enters.
        """
        count, corners = len(elements.nodes), elements.hydrostatics.shape[1]
        motion, coupling = np.empty((count, 10, 9)), np.zeros((count, 10, corners, 3))
        compression = np.zeros((count, corners, corners))

        def work(chunk: slice) -> None:
            here, own = strained(elements, at, chunk), self.at(at.data[chunk])
            if self.energy_density.of_invariants is not None:
                by_invariants = np.array(invariant_derivatives(own, here.F, here.hydrostatic)[0])
                invariant_node_blocks(here.measure * by_invariants[:9], here.F, here.A, TET_DN, motion[chunk])
            else:
                node_blocks(moduli_at(own, here), here.A, TET_DN, motion[chunk])
            if corners:
                _couple(own, here, coupling[chunk], compression[chunk])

        each(work, elements.chunks())
        return motion[: elements.count], coupling[: elements.count], compression[: elements.count]


@partial(register_dataclass, data_fields=["parameters", "share", "softening"], meta_fields=["energy_density"])
@dataclass(frozen=True, eq=False)
class Remembering(Solid):
    """The potential of a step of a rubber that remembers, see `material/memory.py`.

    The data of an element are H and W at its points, of which W is the last: (7, 4) numbers.
    """

    share: Values
    softening: Values

    def at(self, data: Values) -> Solid:
        points = data.reshape(-1, 7, 4).transpose(1, 2, 0)
        own = self.parameters
        return Solid(
            self.energy_density,
            PointParameters(points[:6], points[6], self.share, self.softening, own, own[-1]),
        )


def _couple(solid: Solid, here: StrainedPoints, coupling: np.ndarray, compression: np.ndarray) -> None:
    """Fill the blocks by u and π, and by π and π, of a chunk."""
    slopes, among = couplings_at(solid, here)
    coupling_blocks(slopes, here.A, TET_DN, TET_CORNER_N, coupling)
    compression[:] = np.einsum("qe,qc,qd->ecd", among, TET_CORNER_N, TET_CORNER_N, optimize=True)


def _forces(at: Local, u: np.ndarray, hydrostatic: np.ndarray) -> Forces:
    """Forces of elements that see neither the plate nor obstacles."""
    return Forces(u, hydrostatic, np.zeros(at.plate.shape), np.zeros(at.objects.shape))


def corner_hydrostatics(local: Local) -> Array:
    """π at the corners of tetrahedra (E, 4); zero, and unused, without mixed elements."""
    return local.hydrostatic if local.hydrostatic.shape[1] else jnp.zeros((local.X.shape[0], 4))


def strained(elements: Connectivity, at: Local, chunk: slice) -> StrainedPoints:
    """The quadrature points of a chunk."""
    F, A = np.empty((3, 3, 4, elements.chunk)), np.empty((3, 3, 4, elements.chunk))
    measure = np.empty((4, elements.chunk))
    points.strain(at.X[chunk], at.u[chunk], TET_DN, TET_WEIGHT, F, A, measure)
    return StrainedPoints(F, A, _at_points(at.hydrostatic[chunk], elements.chunk), measure * elements.weight[chunk])


def _at_points(hydrostatic: np.ndarray, count: int) -> np.ndarray:
    """π at the points (4, C) from its values at the corners (C, 4); zero, and unused, without mixed elements."""
    return TET_CORNER_N @ hydrostatic.T if hydrostatic.shape[1] else np.zeros((4, count))


Linearised = tuple[slice, StrainedPoints, Along]


def _linearised(solid: Solid, elements: Connectivity, at: Local, chunk: slice, several: bool) -> Linearised:
    here = strained(elements, at, chunk)
    return chunk, here, along_at(solid.at(at.data[chunk]), here, several)


def _room(elements: Connectivity) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Empty arrays for δF, δA and tr(A δJ) of a chunk."""
    return np.empty((3, 3, 4, elements.chunk)), np.empty((3, 3, 4, elements.chunk)), np.empty((4, elements.chunk))
