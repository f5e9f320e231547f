"""Equilibrium as a minimum of the potential, for elements without hydrostatic unknowns.

Newton's method with conjugate gradients, preconditioned by a reused factorisation, and a line search on Π: descent
finds stable states only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.mechanics.assembly.kinematics import State
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.material.energies import SMALLEST_RATIO
from pneumorph.mechanics.solve.balance import (
    INTERPENETRATION,
    RUNAWAY_STRETCH,
    apart,
    applied_force,
    evaluate,
    free_share,
    largest_stretch,
    smallest_ratio,
    stepped_ratios,
    supported,
    unloaded,
)

MOST_NEWTON_STEPS, MOST_WITH_CONTACT = 40, 100
MOST_PRODUCTS = 6
"""Conjugate-gradient steps with an old factorisation; a new one costs about as much as five."""

SPARE = 0.1
"""Part of the tolerance to which the last step aims."""

LEAST_SHIFT = 1e-3
"""Least fraction by which the diagonal of an unstable tangent is raised."""

MOST_RELAXATIONS, MOST_RELAXATIONS_AT_REST, RELAXED = 3, 10, 0.9
"""Smoothing steps with one factorisation, or with that at rest, and the fraction of the residual that each but the last
leaves at most."""

MOST_WITH_RATIOS = 8
"""Steps with volume ratios, each of which is a factorisation."""

SMOOTH, ROUGH, FAR = 0.02, 1.0, 10.0
"""Relative residuals: of a state without rough detail; above which the tangent is often indefinite for the stress of
rough volume ratios; and above which nearly always, though a nearby state has been factorised."""


def minimise(
    at: Configuration, tangent: Tangent, start: State, tolerance: float, ratios: np.ndarray | None = None
) -> tuple[State, float] | str:
    """Minimise Π from `start`; returns the state and its relative residual, or the reason why it failed.

    `ratios` (4, E) are volume ratios nearer to those of the equilibrium than the start's own, see `Guess`.
    """
    model = at.model
    vector = supported(at, model.vector(start))
    if not apart(at, vector):
        return INTERPENETRATION
    energy, residual = evaluate(at, model.state(vector))
    if not np.isfinite(energy) or not np.isfinite(residual).all():
        return "the starting state is not finite"
    scale = applied_force(at, model.state(vector))
    begin = here = Place(vector, energy, supported(at, residual))
    # Steps over which Π may rise are not for surfaces that touch.
    known = ratios if model.contact is None and begin.size > SMOOTH * scale else None
    try:
        if begin.size > tolerance * scale:
            here = _relaxed(at, tangent, begin, scale, known is not None)
        raised = None
        most = MOST_NEWTON_STEPS if model.contact is None else MOST_WITH_CONTACT
        for _ in range(most):
            size = here.size / scale
            if size <= tolerance:
                if smallest_ratio(at, here.vector) <= SMALLEST_RATIO:
                    return "an element is turned inside out"
                if not apart(at, here.vector):
                    return INTERPENETRATION
                return model.state(here.vector), size
            if size > 1e-2 and largest_stretch(at, model.state(here.vector)) > RUNAWAY_STRETCH:
                return f"the body runs away (stretch beyond {RUNAWAY_STRETCH:g}), as when a chamber balloons"
            found = None
            if known is None or size <= (FAR if tangent.ready else ROUGH):
                found = _direction(at, tangent, here, scale, raised, tolerance, known is None)
            if found is None:
                assert known is not None, "the diagonal is raised until the tangent is stable"
                here, known, raised = _smoothed(at, tangent, begin, known, scale), None, None
                continue
            direction, raised = found
            moved = _line_search(at, here, direction)
            if moved is None:
                return "the line search found no lower potential"
            here = moved
    except SingularMatrix:
        return "the tangent is singular"
    return f"Newton's method did not converge in {most} steps (relative residual {here.size / scale:.1e})"


@dataclass(frozen=True, eq=False)
class Place:
    """Unknowns (n,), with the potential and the residual there."""

    vector: np.ndarray
    energy: float
    residual: np.ndarray

    @property
    def size(self) -> float:
        """Norm of the residual."""
        return float(np.linalg.norm(self.residual))


def _relaxed(at: Configuration, tangent: Tangent, here: Place, scale: float, ratios_known: bool) -> Place:
    """The place after steps with the factorisation of a nearby state, or with that at rest if there is none.

    They smooth the rough detail of a state, and end when one leaves most of the residual, or little is left. Where
    volume ratios are known, there is a better way far from the answer (`_smoothed`), and none are made.
    """
    model, most = at.model, MOST_RELAXATIONS
    if not tangent.ready:
        if ratios_known or here.size <= SMOOTH * scale or not np.any(here.vector):
            return here
        tangent.factorise(unloaded(at), model.state(np.zeros(model.size)))
        most = MOST_RELAXATIONS_AT_REST
    elif ratios_known and here.size > FAR * scale:
        return here
    for _ in range(most):
        moved = _line_search(at, here, supported(at, tangent.precondition(-here.residual)))
        if moved is None:
            break
        before, here = here, moved
        if here.size > RELAXED * before.size or here.size <= SMOOTH * scale:
            break
    return here


def _smoothed(at: Configuration, tangent: Tangent, here: Place, ratios: np.ndarray, scale: float) -> Place:
    """A place without the rough detail of a predicted or interpolated state, for which the tangent is indefinite.

    Where κ is large, the volumetric stress of rough displacements is nowhere near the equilibrium's. That of `ratios`
    takes its place in the tangent; after a step they are the linearised ones, as where stresses are unknowns of their
    own (Magisano, Leonetti and Garcea 2017, Computer Methods in Applied Mechanics and Engineering 313, 986-1005).
    """
    best = here
    for _ in range(MOST_WITH_RATIOS):
        tangent.factorise_with(at, at.model.state(here.vector), ratios)
        direction = supported(at, tangent.precondition(-here.residual))
        moved = _sound(at, here, direction)
        if moved is None:
            break
        ratios, here = stepped_ratios(at, ratios, here.vector, direction, moved.vector), moved
        if here.size <= ROUGH * scale:
            return here
        best = min(best, here, key=lambda place: place.size)
    return best


def _sound(at: Configuration, here: Place, direction: np.ndarray) -> Place | None:
    """Shorten a step until no element is turned inside out; None where one always is. Π may rise."""
    step = free_share(at, here.vector, direction)
    for _ in range(4):
        trial = here.vector + step * direction
        value, gradient = evaluate(at, at.model.state(trial))
        if np.isfinite(value) and np.isfinite(gradient).all() and smallest_ratio(at, trial) > SMALLEST_RATIO:
            return Place(trial, value, supported(at, gradient))
        step *= 0.5
    return None


def _direction(at: Configuration, tangent: Tangent, here: Place, scale: float, raised, tolerance: float, raising: bool):
    """A descent direction, and by what fraction the last factorisation's diagonal is raised; None before the first.

    None where the tangent is unstable and its diagonal is not to be raised.

    The factorisation of a nearby tangent is good for a few conjugate-gradient steps; if they do not converge, the
    tangent is factorised. Where it is indefinite, conjugate gradients follow its negative curvature.
    """
    state, residual, size = at.model.state(here.vector), here.residual, here.size / scale
    # More accurate than the state has to be is wasted.
    accuracy = float(np.clip(max(np.sqrt(size), SPARE * tolerance / size), 1e-3, 0.1))
    if raised == 0:
        solution = tangent.solve(at, state, -residual, accuracy, MOST_PRODUCTS)
        if solution.converged:
            return solution.x, raised
    if not raising:
        tangent.factorise(at, state)
        return (tangent.precondition(-residual), 0.0) if tangent.negative_pivots <= 0 else None
    # Where the last tangent was unstable, this one is likely to be so by about as much.
    first = raised / 4 if raised and raised / 4 >= LEAST_SHIFT else 0.0
    raised = tangent.factorise_convex(at, state, LEAST_SHIFT, first)
    if raised:
        return tangent.solve(at, state, -residual, 0.1, 2 * MOST_PRODUCTS).x, raised
    return tangent.precondition(-residual), raised


def _line_search(at: Configuration, here: Place, direction: np.ndarray) -> Place | None:
    """Shorten the step until Π falls enough; None where it does not."""
    slope = float(here.residual @ direction)
    if not slope < 0:
        return None
    # Near the minimum Π changes by less than its rounding error; there the residual decides.
    rounding = 1e-12 * (abs(here.energy) + abs(slope))
    step = free_share(at, here.vector, direction)
    for _ in range(12):
        trial = here.vector + step * direction
        value, gradient = evaluate(at, at.model.state(trial))
        if np.isfinite(value) and np.isfinite(gradient).all():
            there = Place(trial, value, supported(at, gradient))
            enough = value <= here.energy + 1e-4 * step * slope
            converged = value <= here.energy + rounding and there.size < here.size
            if enough or converged:
                return there
        step *= 0.5
    return None
