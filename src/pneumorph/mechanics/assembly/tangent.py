"""The tangent as a linear solver: a factorisation serves for its own state and, with a few corrections, nearby.

One factorisation costs as much as some twenty back-solves. Searches make many steps with one (`solve/descent.py`);
solutions near a factorised state are corrected by conjugate gradients on the exact product, and stability there is
decided by Lanczos' method. A solver may use the factorisation of another one where both configurations are near.
"""

from __future__ import annotations

import math
import time
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import sparse

from pneumorph.doing import counted
from pneumorph.interrupts import stop_if_asked
from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.enclosed import Enclosed
from pneumorph.mechanics.assembly.hessian import contact_in_pairs, tangent, with_supports
from pneumorph.mechanics.assembly.krylov import Linear, Solution, conjugate_gradients, minimal_residuals
from pneumorph.mechanics.assembly.linear import Factorisation, TooCostly, build_factorisation
from pneumorph.mechanics.assembly.metrics import Metrics
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.terms import Loads


@dataclass(frozen=True)
class Configuration:
    """A model with nodes X (N, 3), loads, and blocked plate components (6,) bool.

    `enclosed` are the chambers whose pressure is unknown; of an equilibrium, the loads have the pressures found.
    """

    model: Model
    X: np.ndarray
    loads: Loads
    blocked: np.ndarray
    enclosed: Enclosed | None = None

    @property
    def constrained(self) -> np.ndarray:
        """The unknowns (n,) bool that keep their value: supports and blocked plate components."""
        constrained = self.model.fixed.copy()
        constrained[-6:] |= self.blocked
        return constrained


LOOSE, NOTHING = 1e-3, 1e-9
"""Stiffness of a free obstacle that nothing touches, over that of the rubber, in factorisations on the way to where it
is held; and the fraction of it that counts as nothing."""


def looseness(at: Configuration) -> np.ndarray:
    """That stiffness for every unknown of free obstacles: (6J,) N/mm and N·mm/rad."""
    size = float(np.linalg.norm(np.ptp(at.X, axis=0))) / 10.0
    modulus = max(rubber.shear_modulus for rubber in at.model.rubbers.values())
    count = len(range(*at.model.object_unknowns.indices(at.model.size))) // 6
    return LOOSE * modulus * np.tile(np.repeat([size, size**3], 3), count)


EXACT = 1e-10
"""Relative accuracy at which a solution by conjugate gradients counts as exact."""

FEW = 6
"""Most products for a solution near a factorised state; a factorisation costs about as much as twice as many."""

SEVERAL = 2
"""Most right-hand sides for which that is done one after another with a lent factorisation."""

LANCZOS, SAFE = 2, 0.15
"""Steps of Lanczos' method, and how far from 1 the eigenvalues of M⁻¹K may be where no motion has become unstable."""

MOST_KEPT = 3
"""Entries of contacts that have ended are kept in the pattern up to this multiple of those that there are."""


@dataclass(frozen=True, eq=False)
class Origin:
    """What was factorised at a state: its tangent if `exact`, else one like it that serves the search.

    With `metrics` the tension of sheets and fibres was that of these, not of the state's own. If its diagonal was
    `raised`, it is no measure of stability.
    """

    at: Configuration
    state: State
    exact: bool = True
    metrics: Metrics = ()
    raised: bool = False


@dataclass(frozen=True, eq=False)
class Loan:
    """The factorisation of another solver at its configuration `of`, lent for the configuration `at`."""

    lender: Tangent
    of: Configuration
    at: Configuration

    @property
    def valid(self) -> bool:
        """Whether the lender still has it, or another one of the same configuration."""
        return self.lender.origin is not None and self.lender.origin.at is self.of


class Tangent:
    """A factorised tangent, reused as long as it serves: exact in `solve_at` and `pivots_at`, approximate elsewhere.

    Attributes
    ----------
    factorisations : int
        Number of numerical factorisations so far.
    indefinite : int
        How many of them had negative pivots.
    max_factorisations : float
        Value of `factorisations` at which no more are made, and `TooCostly` is raised instead.
    solves : int
        Number of back-solves so far.
    negative_pivots : int
        Of the last factorisation, less one for each hydrostatic unknown that is not fixed: 0 at a stable state.
    origin : Origin or None
        What was factorised last; None before the first factorisation, or if the last one failed.
    unit_seconds : float
        Time of the last assembly with factorisation; the cost of a design is reported in these units.
    """

    def __init__(self, model: Model):
        self._model = model
        self._pattern = model.sparsity.pattern
        self._loan: Loan | None = None
        self.origin: Origin | None = None
        self.factorisations = self.indefinite = 0
        self.max_factorisations = math.inf
        self.solves = 0
        self.unit_seconds = 0.0

    @cached_property
    def _factor(self) -> Factorisation:
        # The symbolic analysis costs as much as a factorisation: one that is lent may do.
        return build_factorisation(self._pattern)

    def borrow(self, lender: Tangent, at: Configuration) -> None:
        """Use the last factorisation of another solver at a configuration near its own, until one is made here.

        One that was made here at this configuration stays.
        """
        if (self.origin is None or self.origin.at is not at) and lender.origin is not None:
            self._loan, self.origin = Loan(lender, lender.origin.at, at), None

    def borrows(self, at: Configuration) -> bool:
        """Whether a factorisation that was lent for this configuration serves."""
        return self.origin is None and self._loan is not None and self._loan.valid and self._loan.at is at

    @property
    def _serving(self) -> Tangent:
        """The solver whose factorisation serves."""
        lent = self.origin is None and self._loan is not None and self._loan.valid
        return self._loan.lender if lent and self._loan is not None else self

    @property
    def serves(self) -> Origin | None:
        """What was factorised, here or where the factorisation was lent; None without one."""
        return self._serving.origin

    @property
    def ready(self) -> bool:
        """Whether there is a factorisation, of any state."""
        return self.serves is not None

    @property
    def negative_pivots(self) -> int:
        serving = self._serving
        # Each hydrostatic unknown adds one to those of the tangent with π eliminated (Haynsworth 1968).
        model = self._model if serving.origin is None else serving.origin.at.model
        return serving._factor.negative_pivots - int(np.count_nonzero(~model.fixed[model.hydrostatic_unknowns]))

    def factorise(
        self,
        at: Configuration,
        state: State,
        ratios: np.ndarray | None = None,
        metrics: Metrics = (),
        damping: np.ndarray | None = None,
    ) -> None:
        """Assemble and factorise the tangent at a state: its own, or with the stress of others or a raised diagonal.

        Parameters
        ----------
        at : Configuration
            The model with its nodes and loads.
        state : State
            The unknowns.
        ratios : (4, E) array, optional
            Volume ratios at the quadrature points, of which the volumetric stress is in place of the state's own.
        metrics : Metrics
            Of the faces under sheets and fibres, of which their tension is.
        damping : (n,) array, optional
            Added to the diagonal, N/mm and N·mm.
        """
        began = time.perf_counter()
        data = self._assembled(at, state, ratios, metrics)
        if damping is not None:
            data[self._pattern.indptr[:-1]] += damping
        own, raised = ratios is None and not metrics, damping is not None
        self.refactorise(data, Origin(at, state, own and not raised, metrics, raised))
        self.unit_seconds = time.perf_counter() - began

    def is_of(self, at: Configuration, state: State) -> bool:
        """Whether the last factorisation is of the tangent at this state.

        Configuration and state are compared by identity: equal copies do not count.
        """
        origin = self.origin
        return origin is not None and origin.at is at and origin.state is state and origin.exact

    def move_to(self, at: Configuration, state: State, values: np.ndarray | None = None) -> None:
        """Factorise at a state, unless the last factorisation is of it.

        Parameters
        ----------
        at : Configuration
            The model with its nodes and loads.
        state : State
            The unknowns.
        values : array, optional
            Of the tangent there without supports, if they are known; not where there is contact in pairs.
        """
        if self.is_of(at, state):
            return
        if values is None:
            self.factorise(at, state)
        else:
            self.refactorise(with_supports(at.model, values.copy(), at.blocked), Origin(at, state))

    def solve_at(self, at: Configuration, state: State, rhs: np.ndarray, accuracy: float = EXACT) -> np.ndarray:
        """K⁻¹ rhs (n,) or (n, k) with the tangent at this state.

        Where the last factorisation is of a state nearby, conjugate gradients make up for the difference, to a relative
        `accuracy`; else the tangent is factorised.

        Parameters
        ----------
        at : Configuration
            The model with its nodes and loads.
        state : State
            The unknowns.
        rhs : (n,) or (n, k) array
            Right-hand sides, N and N·mm.
        accuracy : float
            Relative residual in the norm of the preconditioner.
        """
        if rhs.ndim == 1 and self._is_near(at, state):
            solution = self._corrected(at, state, rhs, accuracy, FEW)
            if solution.converged:
                return solution.x
        elif rhs.ndim == 2 and rhs.shape[1] <= SEVERAL and self.borrows(at):
            return np.stack([self.solve_at(at, state, each, accuracy) for each in rhs.T], axis=1)
        self.move_to(at, state)
        return self.precondition(rhs)

    def pivots_at(self, at: Configuration, state: State) -> int:
        """Negative pivots of the tangent at this state, see `negative_pivots`.

        Where the last factorisation M is definite and of a state nearby, all eigenvalues of M⁻¹K are close to 1. One
        that is not would be found by Lanczos' method in a few steps from a random vector, for the softest motions are
        the largest part of that in the norm of M. Then K is positive definite as M is; else it is factorised.
        """
        if self._is_near(at, state):
            noise = np.where(at.constrained, 0.0, np.random.default_rng(0).standard_normal(self._model.size))
            noise[self._model.hydrostatic_unknowns] = 0.0
            if self._corrected(at, state, noise, EXACT, LANCZOS).spread < SAFE:
                return 0
        self.move_to(at, state)
        return self.negative_pivots

    def _is_near(self, at: Configuration, state: State) -> bool:
        """Whether the last factorisation is definite, and of another state of the same configuration, or lent.

        It may be one with the stress of other volume ratios.
        """
        origin, lent = self._serving.origin, self.borrows(at)
        if origin is None or self.is_of(at, state) or (self._model.mixed and not lent):
            return False
        return (origin.at is at or lent) and not origin.raised and self.negative_pivots == 0

    @contextmanager
    def spending(self, most: float) -> Iterator[None]:
        """At most this many factorisations within, of those that are left: one more raises `TooCostly`."""
        allowed = self.max_factorisations
        self.max_factorisations = min(allowed, self.factorisations + most)
        try:
            yield
        finally:
            self.max_factorisations = allowed

    def factorise_convex(self, at: Configuration, state: State, least: float = 1e-3, first: float = 0.0) -> float:
        """Factorise; if the tangent is unstable, raise its diagonal until it is stable. Returns by what fraction.

        The fractions tried are `first`, and then four times the last, or `least` after 0. The diagonal of π stays.

        Parameters
        ----------
        at : Configuration
            The model with its nodes and loads.
        state : State
            The unknowns.
        least : float
            The first fraction above zero.
        first : float
            The fraction to begin with.
        """
        began = time.perf_counter()
        data = self._assembled(at, state)
        assembled = time.perf_counter() - began
        # The columns of the upper triangle ascend: every row begins with its diagonal entry.
        places = self._pattern.indptr[:-1]
        diagonal, shift = np.abs(data[places]), first
        diagonal[self._model.hydrostatic_unknowns] = 0.0
        while True:
            raised = data.copy()
            raised[places] += shift * diagonal
            began = time.perf_counter()
            self.refactorise(raised, Origin(at, state, shift == 0.0, raised=shift > 0.0))
            self.unit_seconds = assembled + time.perf_counter() - began
            if self.negative_pivots <= 0 or shift >= 10:
                return shift
            shift = 4 * shift or least

    def _assembled(
        self, at: Configuration, state: State, ratios: np.ndarray | None = None, metrics: Metrics = ()
    ) -> np.ndarray:
        if at.model.sparsity is not self._model.sparsity:
            raise ValueError("the configuration belongs to another model")
        data = tangent(at.model, at.X, state, at.loads, at.blocked, ratios, metrics)
        if not at.model.potential.has_pairs:
            return data
        data = self._with_contact(data, contact_in_pairs(at.model, at.X, state, at.loads, at.constrained))
        # A free obstacle that nothing touches would make the tangent singular: searches need one that is not.
        places = self._pattern.indptr[:-1][at.model.object_unknowns]
        least = looseness(at)
        data[places] = np.where(np.abs(data[places]) <= NOTHING * least, least, data[places])
        return data

    def _with_contact(self, data: np.ndarray, contact: sparse.coo_array) -> np.ndarray:
        """The values with those of contact, in a pattern that has both; the symbolic analysis is repeated if needed."""
        keys = contact.coords[0].astype(np.int64) * self._model.size + contact.coords[1]
        if not self._pattern.has(keys):
            base = self._model.sparsity.pattern
            # Pairs come and go: those that have gone stay, so that they may come again, until they are too many.
            few = len(self._pattern.keys) - len(base.keys) <= MOST_KEPT * len(keys)
            self._pattern = (self._pattern if few else base).joined(keys)
            self.origin = None
            self._factor = build_factorisation(self._pattern)
        values = np.zeros(len(self._pattern.keys))
        values[self._pattern.base] = data
        values[np.searchsorted(self._pattern.keys, keys)] += contact.data
        return values

    def refactorise(self, data: np.ndarray, origin: Origin) -> None:
        """Factorise these values of the tangent, which belong to `origin`."""
        if self.factorisations >= self.max_factorisations:
            raise TooCostly
        stop_if_asked()
        self.origin = self._loan = None
        counted("factorisation")
        self._factor.refactorise(data)
        self.factorisations += 1
        self.origin = origin
        self.indefinite += self.negative_pivots > 0

    def precondition(self, rhs: np.ndarray) -> np.ndarray:
        """Back-solve with the last factorisation, for a right-hand side (n,) or several (n, k)."""
        stop_if_asked()
        self.solves += 1 if rhs.ndim == 1 else rhs.shape[1]
        return self._serving._factor.solve(rhs)

    def solve(self, at: Configuration, state: State, rhs: np.ndarray, tolerance: float, most: int) -> Solution:
        """K(state) x = rhs by preconditioned conjugate gradients.

        Stops at the relative `tolerance` in the preconditioner's norm, after `most` products, or at negative curvature.

        Parameters
        ----------
        at : Configuration
            The model with its nodes and loads.
        state : State
            The unknowns.
        rhs : (n,) array
            Right-hand side, N and N·mm.
        tolerance : float
            Relative residual in the norm of the preconditioner.
        most : int
            Most products with K.
        """
        rhs = np.where(at.constrained, 0.0, rhs)
        return conjugate_gradients(self._product(at, state), self.precondition, rhs, tolerance, most)

    def _corrected(self, at: Configuration, state: State, rhs: np.ndarray, tolerance: float, most: int) -> Solution:
        """K(state) x = rhs by the factorisation of a state nearby, see `krylov.py`."""
        method = minimal_residuals if self._model.mixed else conjugate_gradients
        return method(self._product(at, state), self.precondition, np.where(at.constrained, 0.0, rhs), tolerance, most)

    def _product(self, at: Configuration, state: State) -> Linear:
        """The exact product with the tangent at this state."""
        model, constrained = at.model, at.constrained
        along = products.tangent_map(model.potential, at.X, state, at.loads)
        return lambda p: np.where(constrained, 0.0, model.vector(along(model.state(p))))
