"""The state on a refined mesh near one of the coarser mesh, without a factorisation there.

The fields of the coarser mesh are fields of the refined mesh too. So unknowns of the refined mesh are those of the
coarser one, c, and what new nodes have beyond the coarser fields: displacements s, and q of π. In these, K δ = −R is
solved by a few products. The preconditioner has the tangent of the coarser mesh for c, whose factorisation there is,
and for s the blocks D of every new node with itself (Yserentant 1986, Numerische Mathematik 49, 379–412). With π the
part of s and q is

    [ αD   Bᵀ ]
    [ B   −C  ]

with the couplings B of both: of its Schur complement C + B D⁻¹Bᵀ/α, which is like a mass matrix, a few steps of
conjugate gradients are enough.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.krylov import conjugate_gradients, minimal_residuals
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.products import tangent_map
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import Guess, State, deformation_gradients, volume_ratio
from pneumorph.mechanics.solve.balance import apart, applied_force, bulk_over_shear, evaluate, free_share, supported
from pneumorph.mechanics.solve.border import Border, border_at, enclosed_in, missing_volumes, pushes, with_pressures
from pneumorph.mechanics.solve.descent import Place, line_search
from pneumorph.mechanics.solve.split import Split, Surplus, hydrostatic_on, surplus_of
from pneumorph.mesh.refine import PARTS_OF_TET, Refined

PLAIN, MIXED = 20, 60
"""Most products with the tangent: of plain elements, and of those with π."""

PLAIN_LEFT, MIXED_LEFT = 0.1, 0.02
"""The part of the residual, in the norm of the preconditioner, at which they end. With a third left, a motion to which
parts of both signs contribute may be wrong in sign; with π with 6 % left too, and it may lack two thirds."""

LOCKING = 50.0
"""κ/μ from which elements without π are so much too stiff that a few products do not show it."""

CONTRACTING = 0.35
"""The largest part of the residual that one step may leave, in the norm of the preconditioner."""

MOST_STEPS, MOST_HALVINGS = 20, 5
"""Of a search: Newton's steps, and how often one is halved."""

ROUGH_FROM, ROUGH, SMOOTH = 0.1, (0.3, 12), (0.1, 40)
"""Relative residual above which a state is rough. Steps from rough and smooth states leave these parts of it, in the
norm of the preconditioner, or take so many products."""

ENOUGH = 0.7
"""Residual to which the last step is solved, as a part of that at which the search ends."""

MET = 5e-3
"""Relative residual at which a search ends, or that part of the first one in the norm of the preconditioner: the
difference of both meshes is known to a few per cent then."""


def on_refined(fine: Refined, at: Configuration, state: State) -> State:
    """A state of a mesh as one of the refined mesh."""
    u = fine.P @ displacement(at.model.tip, at.X, state)
    return state._replace(u=u, hydrostatic=hydrostatic_on(fine, at, state))


def guess_on_refined(fine: Refined, at: Configuration, state: State) -> Guess:
    """A state of a mesh as a start on the refined mesh: its displacements, and the mean volume ratio of every element.

    In the parts of an element the ratios of its displacements vary as they like, since only their mean is in balance
    there; where κ is large, their stress makes the tangent indefinite.
    """
    tets = at.model.tets.nodes[: at.model.elements]
    ratios = volume_ratio(deformation_gradients(tets, at.X, displacement(at.model.tip, at.X, state)))
    means = np.repeat(ratios.mean(axis=0), len(PARTS_OF_TET))
    return Guess(on_refined(fine, at, state), ratios=np.tile(means, (len(ratios), 1)))


@dataclass(frozen=True, eq=False)
class Nested:
    """A refined mesh `there` under its loads, with the factorised tangent of the coarser one at an equilibrium."""

    split: Split
    tangent: Tangent
    there: Configuration

    @property
    def definite(self) -> bool:
        """Whether the tangent of the coarser mesh is positive definite, so that conjugate gradients serve."""
        return not self.there.model.mixed and self.tangent.negative_pivots == 0

    def forces(self, vector: np.ndarray) -> np.ndarray:
        """−R at unknowns (n,) of the refined mesh, by the split ones."""
        model = self.there.model
        return -self.split.forces(
            kernels.value_and_residual(model.potential, self.there.X, model.state(vector), self.there.loads)[1]
        )

    def linearised(self, vector: np.ndarray) -> Linearised | None:
        """The linearised equilibrium at these unknowns; None where a new node alone would lower the potential."""
        model, state = self.there.model, self.there.model.state(vector)
        surplus = surplus_of(self.split, self.there, state)
        if surplus is None:
            return None
        return Linearised(self, surplus, tangent_map(model.potential, self.there.X, state, self.there.loads))


@dataclass(frozen=True, eq=False)
class Linearised:
    """The equations K δ = −R on a refined mesh, by the split unknowns, with their preconditioner."""

    nested: Nested
    surplus: Surplus
    product: Callable[[State], State]

    def precondition(self, forces: np.ndarray) -> np.ndarray:
        """The split unknowns from forces on them, nearly."""
        coarse = self.nested.split.coarse
        return np.concatenate([self.nested.tangent.precondition(forces[:coarse]), self.surplus.solved(forces[coarse:])])

    def size(self, forces: np.ndarray) -> float:
        """How large forces are in the norm of the preconditioner."""
        moved = self.precondition(forces)
        return float(np.sqrt(forces @ moved) if self.nested.definite else np.linalg.norm(moved))

    def solved(self, forces: np.ndarray, left: float, most: int) -> tuple[np.ndarray, float]:
        """The step (n,) of the unknowns of the refined mesh that leaves a part of the forces, and the spread.

        Parameters
        ----------
        forces : by the split unknowns.
        left : in the norm of the preconditioner.
        most : products.
        """
        split, method = self.nested.split, conjugate_gradients if self.nested.definite else minimal_residuals
        found = method(lambda x: split.forces(self.product(split.direction(x))), self.precondition, forces, left, most)
        return self.nested.there.model.vector(split.direction(found.x)), found.spread

    def balanced(self, vector: np.ndarray) -> State:
        """The state with its forces in balance where the coarser fields pass them on, to the plate and to obstacles."""
        split, model = self.nested.split, self.nested.there.model
        last = self.precondition(self.nested.forces(vector))
        return model.state(vector + model.vector(split.direction(split.of_coarse(last[: split.coarse]))))


def _nested(fine: Refined, at: Configuration, tangent: Tangent, state: State, there: Configuration) -> Nested | None:
    """What both ways begin with; None where surfaces would meet, and for nearly incompressible rubber without π."""
    start = there.model.vector(on_refined(fine, at, state))
    if not apart(there, start) or (not at.model.mixed and bulk_over_shear(at) >= LOCKING):
        return None
    try:
        tangent.move_to(at, state)
    except SingularMatrix:
        return None
    return Nested(Split(fine, at, state, there), tangent, there)


def near_refined(
    fine: Refined, at: Configuration, tangent: Tangent, state: State, there: Configuration
) -> tuple[Configuration, State] | None:
    """The state on a refined mesh by one linear step, with its configuration (enclosed chambers have other pressures).

    None where the residual does not fall, where surfaces would meet, where small parts of the body are unstable, and
    for nearly incompressible rubber without π.

    Parameters
    ----------
    fine : Refined
        The mesh.
    at, state : of the coarser mesh, an equilibrium.
    tangent : Tangent
        The linear solver of the coarser mesh; it is factorised at the state if it is not yet.
    there : Configuration
        The refined mesh under the same loads.
    """
    nested = _nested(fine, at, tangent, state, there)
    if nested is None:
        return None
    vector = there.model.vector(on_refined(fine, at, state))
    border = None if at.enclosed is None else border_at(at, tangent, state)
    here = nested.linearised(vector)
    if here is None:
        return None
    before = nested.forces(vector)
    left, most = (PLAIN_LEFT, PLAIN) if nested.definite else (MIXED_LEFT, MIXED)
    step, spread = here.solved(before, left, most)
    if border is not None:
        there, step = _with_pressures(there, border, nested.split, vector, step)
        here = replace(here, nested=replace(nested, there=there))
    if not np.isfinite(spread) or not np.all(np.isfinite(step)) or free_share(there, vector, step) < 1.0:
        return None
    if not here.size(here.nested.forces(vector + step)) <= CONTRACTING * here.size(before):
        return None
    return there, here.balanced(vector + step)


def search_refined(
    fine: Refined, at: Configuration, tangent: Tangent, state: State, there: Configuration
) -> State | None:
    """The state on a refined mesh by Newton's method, each of whose steps takes a few products; None where it fails.

    Plain elements lower the potential, mixed ones the residual in the norm of the preconditioner. Displacements of the
    coarser mesh are rough there at first: little is gained by solving for them well.

    Parameters
    ----------
    fine, at, tangent, state, there
        See `near_refined`.
    """
    nested = None if at.enclosed is not None else _nested(fine, at, tangent, state, there)
    if nested is None or not (nested.definite or there.model.mixed):
        return None
    vector = there.model.vector(on_refined(fine, at, state))
    scale, first = applied_force(there, there.model.state(vector)), 0.0
    for _ in range(MOST_STEPS):
        energy, residual = evaluate(there, there.model.state(vector))
        place = Place(vector, energy, supported(there, residual))
        here = nested.linearised(vector)
        if here is None:
            return None
        forces = nested.forces(vector)
        size = here.size(forces)
        first = first or size
        if place.size <= MET * scale or size <= MET * first:
            return here.balanced(vector)
        left, most = ROUGH if place.size > ROUGH_FROM * scale else SMOOTH
        # No step is solved better than the search needs to end.
        step, _ = here.solved(forces, max(left, ENOUGH * MET * first / size), most)
        following = _lower(there, place, step) if nested.definite else _contracted(here, vector, step, size)
        if following is None:
            return None
        vector = following
    return None


def _lower(there: Configuration, place: Place, step: np.ndarray) -> np.ndarray | None:
    """The unknowns after as much of a step as lets the potential fall."""
    moved = line_search(there, place, step)
    return None if moved is None else moved.vector


def _contracted(here: Linearised, vector: np.ndarray, step: np.ndarray, size: float) -> np.ndarray | None:
    """The unknowns after as much of a step as lets the residual fall, in the norm of the preconditioner."""
    there = here.nested.there
    share = free_share(there, vector, step)
    for _ in range(MOST_HALVINGS if share else 0):
        forces = here.nested.forces(vector + share * step)
        if np.isfinite(forces).all() and here.size(forces) <= (1.0 - share / 4.0) * size:
            return vector + share * step
        share /= 2.0
    return None


def _with_pressures(
    there: Configuration, border: Border, split: Split, vector: np.ndarray, step: np.ndarray
) -> tuple[Configuration, np.ndarray]:
    """The pressures of enclosed chambers after a step at constant ones, and the step with their change.

    How the body yields to them is taken from the coarser mesh.
    """
    model, given = there.model, enclosed_in(there)
    state = model.state(vector)
    push = pushes(there, given, state)
    change = np.linalg.solve(border.schur, push.T @ step - missing_volumes(there, state))
    step = step + model.vector(split.direction(split.of_coarse(border.along @ change)))
    return with_pressures(there, given, np.asarray(there.loads.pressure)[given.rows(model)] + change), step
