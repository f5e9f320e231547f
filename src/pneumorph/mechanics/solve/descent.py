"""Equilibrium as a minimum of the potential, for elements without hydrostatic unknowns.

Newton's method with conjugate gradients, preconditioned by a reused factorisation, and a line search on Π: descent
finds stable states only.
"""

from __future__ import annotations

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

MOST_RELAXATIONS, MOST_RELAXATIONS_AT_REST, RELAXED, SMOOTH = 3, 10, 0.9, 0.02
"""Steps with an older factorisation, or with that at rest, before the tangent is factorised; the fraction of the
residual that each may leave at most; and the relative residual at which they end. They smooth the rough detail of a
predicted or interpolated state, where the tangent would be indefinite."""


def minimise(
    at: Configuration, tangent: Tangent, start: State, tolerance: float, ratios: np.ndarray | None = None
) -> tuple[State, float] | str:
    """Minimise Π from `start`; returns the state and its relative residual, or the reason why it failed.

    The volume ratios (E,) of a start from another mesh, where they are given, take the place of its own in the first
    tangent. Where κ is large, those of rough displacements give a stress that is nowhere near that of the equilibrium,
    while the true one makes this step a good one, as where stresses are unknowns of their own (Magisano, Leonetti and
    Garcea 2017, Computer Methods in Applied Mechanics and Engineering 313, 986-1005).
    """
    model = at.model
    vector = supported(at, model.vector(start))
    if not apart(at, vector):
        return INTERPENETRATION
    energy, residual = evaluate(at, model.state(vector))
    if not np.isfinite(energy) or not np.isfinite(residual).all():
        return "the starting state is not finite"
    scale = applied_force(at, model.state(vector))
    residual = supported(at, residual)
    size = float(np.linalg.norm(residual)) / scale
    relaxations = MOST_RELAXATIONS if tangent.ready else 0
    if not tangent.ready and size > SMOOTH and ratios is not None:
        tangent.factorise_with(at, model.state(vector), ratios)
        relaxations = 1
    elif not tangent.ready and size > SMOOTH and np.any(vector):
        # Of a rough state whose volume ratios are not known, steps with the definite tangent at rest smooth the detail.
        tangent.factorise(unloaded(at), model.state(np.zeros(model.size)))
        relaxations = MOST_RELAXATIONS_AT_REST
    raised = None
    most = MOST_NEWTON_STEPS if model.contact is None else MOST_WITH_CONTACT
    for _ in range(most):
        if size <= tolerance:
            if smallest_ratio(at, vector) <= SMALLEST_RATIO:
                return "an element is turned inside out"
            if not apart(at, vector):
                return INTERPENETRATION
            return model.state(vector), size
        state = model.state(vector)
        relaxing = relaxations > 0
        try:
            if relaxing:
                direction = supported(at, tangent.precondition(-residual))
            else:
                direction, raised = _direction(at, tangent, state, residual, size, raised, tolerance)
        except SingularMatrix:
            return "the tangent is singular"
        moved = _line_search(at, vector, energy, residual, direction, scale)
        if moved is None and not relaxing:
            return "the line search found no lower potential"
        previous = size
        if moved is not None:
            vector, energy, residual = moved
            size = float(np.linalg.norm(residual)) / scale
        if relaxing:
            relaxations = relaxations - 1 if size < RELAXED * previous and size > SMOOTH else 0
        if size > 1e-2 and largest_stretch(at, model.state(vector)) > RUNAWAY_STRETCH:
            return f"the body runs away (stretch beyond {RUNAWAY_STRETCH:g}), as when a chamber balloons"
    return f"Newton's method did not converge in {most} steps (relative residual {size:.1e})"


def _direction(
    at: Configuration, tangent: Tangent, state: State, residual: np.ndarray, size: float, raised, tolerance: float
):
    """A descent direction, and by what fraction the last factorisation's diagonal is raised; None before the first.

    The factorisation of a nearby tangent is good for a few conjugate-gradient steps; if they do not converge, the
    tangent is factorised. Where it is indefinite, conjugate gradients follow its negative curvature.
    """
    # More accurate than the state has to be is wasted.
    accuracy = float(np.clip(max(np.sqrt(size), SPARE * tolerance / size), 1e-3, 0.1))
    if raised == 0:
        solution = tangent.solve(at, state, -residual, accuracy, MOST_PRODUCTS)
        if solution.converged:
            return solution.x, raised
    # Where the last tangent was unstable, this one is likely to be so by about as much.
    first = raised / 4 if raised and raised / 4 >= LEAST_SHIFT else 0.0
    raised = tangent.factorise_convex(at, state, LEAST_SHIFT, first)
    if raised:
        return tangent.solve(at, state, -residual, 0.1, 2 * MOST_PRODUCTS).x, raised
    return tangent.precondition(-residual), raised


def _line_search(at: Configuration, vector, energy, residual, direction, scale):
    """Shorten the step until Π falls enough; None where it does not."""
    slope = float(residual @ direction)
    if not slope < 0:
        return None
    # Near the minimum Π changes by less than its rounding error; there the residual decides.
    rounding = 1e-12 * (abs(energy) + abs(slope))
    step = free_share(at, vector, direction)
    for _ in range(12):
        trial = vector + step * direction
        value, gradient = evaluate(at, at.model.state(trial))
        if np.isfinite(value) and np.isfinite(gradient).all():
            gradient = supported(at, gradient)
            enough = value <= energy + 1e-4 * step * slope
            converged = value <= energy + rounding and np.linalg.norm(gradient) < np.linalg.norm(residual)
            if enough or converged:
                return trial, value, gradient
        step *= 0.5
    return None
