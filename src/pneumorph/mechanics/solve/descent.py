"""Equilibrium as a minimum of the potential, for elements without hydrostatic unknowns.

Quasi-Newton steps on a factorised tangent, which is factorised again where they grow slow, and a line search on Π:
descent finds stable states only.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.material.energies import SMALLEST_RATIO
from pneumorph.mechanics.solve.balance import (
    HALVED,
    INTERPENETRATION,
    RUNAWAY_STRETCH,
    SMOOTH,
    apart,
    applied_force,
    bulk_over_shear,
    energy_rounding,
    evaluate,
    free_share,
    held,
    largest_stretch,
    residual_rounding,
    smallest_ratio,
    stepped_ratios,
    supported,
    unloaded,
)
from pneumorph.mechanics.solve.secants import Secants

MOST_STEPS, MOST_WITH_CONTACT = 200, 400
"""Most steps without contact, and with it, where what touches changes on the way."""

WORTH = 10
"""Steps that cost as much as a factorisation: a new one is made where more of them would be needed with the old."""

LEAST_SHIFT = 1e-3
"""Least fraction by which the diagonal of an unstable tangent is raised."""

MOST_PRODUCTS = 12
"""Conjugate-gradient steps on an unstable tangent."""

QUICK = 0.2
"""A factorisation that leaves at most this part of the residual does not count: what converges is not given up."""

MOST_WITH_RATIOS = 5
"""Steps with volume ratios, each of which is a factorisation."""

NEAR, FAR, ROUGH = 0.05, 0.3, 1.0
"""Relative residuals: of a state whose factorisation tells whether the one found from it is a minimum; above which a
step with predicted volume ratios mostly gets farther than Newton's; and above which the tangent is often indefinite for
the stress of rough ones."""

MOST_LEFT = 0.25
"""A step with predicted volume ratios from a state that is not rough is taken if it leaves at most this part of the
residual; else Newton's gets farther."""

ROUGHER = 0.5
"""Relative residual over κ/μ above which it is indefinite with other volume ratios too, since shapes are as rough."""


def minimise(
    at: Configuration,
    tangent: Tangent,
    start: State,
    tolerance: float,
    ratios: np.ndarray | None = None,
    checked: bool = True,
) -> tuple[State, float] | str:
    """Minimise Π from `start`; returns the state and its relative residual, or the reason why it failed.

    `ratios` (4, E) are volume ratios nearer to those of the equilibrium than the start's own, to whose gradients it was
    fitted. With them Π may rise at first, which is not for surfaces that touch.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        With the last factorisation, if there is one.
    start : State
        Where the search begins.
    tolerance : float
        Residual over the applied force at which it ends.
    ratios : (4, E) array, optional
        Volume ratios at the quadrature points.
    checked : bool
        Whether the tangent is factorised near the state that is found, which keeps steps with older ones from ending
        where there is no minimum; else that is for the caller to see.
    """
    model = at.model
    vector = held(at, model.vector(start))
    if not apart(at, vector):
        return INTERPENETRATION
    energy, residual = evaluate(at, model.state(vector))
    if not np.isfinite(energy) or not np.isfinite(residual).all():
        return "the starting state is not finite"
    scale = applied_force(at, model.state(vector))
    here = Place(vector, energy, supported(at, residual))
    raised, most = 0.0, MOST_STEPS if model.contact is None else MOST_WITH_CONTACT
    try:
        if ratios is None and not tangent.ready and here.size > SMOOTH * scale and np.any(vector):
            # Steps with the tangent at rest smooth the rough detail of a state, where its own is often indefinite.
            tangent.factorise(unloaded(at), model.state(np.zeros(model.size)))
        if ratios is not None and FAR < here.size / scale <= ROUGHER * bulk_over_shear(at):
            here = _smoothed(at, tangent, here, ratios, scale)
        # What is lent serves for the answer too.
        secants, made = Secants() if tangent.ready else None, 0.0 if tangent.borrows(at) else np.inf
        for _ in range(most):
            size = here.size / scale
            if size <= tolerance:
                if smallest_ratio(at, here.vector) <= SMALLEST_RATIO:
                    return "an element is inverted"
                if not apart(at, here.vector):
                    return INTERPENETRATION
                return model.state(here.vector), size
            if size > 1e-2 and largest_stretch(at, model.state(here.vector)) > RUNAWAY_STRETCH:
                return (
                    f"the body deforms without limit (stretch beyond {RUNAWAY_STRETCH:g}), as when a chamber balloons"
                )
            if secants is not None:
                moved = line_search(at, here, supported(at, secants.direction(tangent.precondition, here.residual)))
                if moved is None:
                    secants = None
                    continue
                secants = secants.after(moved.vector - here.vector, here.residual, moved.residual)
                here = moved
                due = checked and made > NEAR and SMOOTH**2 * scale < here.size <= SMOOTH * scale
                if due or secants.expected(tolerance * scale) > WORTH:
                    secants = None
                continue
            if size <= QUICK * made < np.inf:
                tangent.max_factorisations += 1
            direction, raised = _factorised(at, tangent, here, raised)
            made = size
            moved = line_search(at, here, direction)
            stuck = not raised and (moved is None or moved.size > HALVED * here.size)
            if stuck and here.size <= residual_rounding(at, here.vector):
                tolerance = max(tolerance, size)
                continue
            if moved is None:
                return "the line search found no lower potential"
            secants = None if raised else Secants().after(moved.vector - here.vector, here.residual, moved.residual)
            here = moved
    except SingularMatrix:
        return "the tangent is singular"
    return f"the search did not converge in {most} steps (relative residual {here.size / scale:.1e})"


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


def _smoothed(at: Configuration, tangent: Tangent, here: Place, ratios: np.ndarray, scale: float) -> Place:
    """A place with less rough detail than a predicted or interpolated state has, for which the tangent is indefinite.

    Where κ is large, the volumetric stress of rough displacements is nowhere near the equilibrium's. That of `ratios`
    takes its place in the tangent; after a step they are the linearised ones, as where stresses are unknowns of their
    own (Magisano, Leonetti and Garcea 2017, Computer Methods in Applied Mechanics and Engineering 313, 986-1005). Where
    that leads nowhere, as for ratios from another mesh, the tangent without volumetric stress often leads on.
    """
    stressed = True
    for _ in range(MOST_WITH_RATIOS):
        tangent.factorise(at, at.model.state(here.vector), ratios)
        direction = supported(at, tangent.precondition(-here.residual))
        moved = _sound(at, here, direction)
        left = 1.0 if here.size > ROUGH * scale else MOST_LEFT
        if moved is None or moved.size > left * here.size:
            if not stressed:
                break
            ratios, stressed = np.ones_like(ratios), False
            continue
        stressed = True
        ratios, here = stepped_ratios(at, ratios, here.vector, direction, moved.vector), moved
        if here.size <= FAR * scale:
            break
    return here


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


def _factorised(at: Configuration, tangent: Tangent, here: Place, raised: float) -> tuple[np.ndarray, float]:
    """Newton's direction by a new factorisation, and by what fraction its diagonal is raised.

    Where the tangent is indefinite, conjugate gradients follow its negative curvature.
    """
    state, residual = at.model.state(here.vector), here.residual
    # Where the last tangent was unstable, this one is likely to be so by about as much.
    first = raised / 4 if raised / 4 >= LEAST_SHIFT else 0.0
    raised = tangent.factorise_convex(at, state, LEAST_SHIFT, first)
    if raised:
        return tangent.solve(at, state, -residual, 0.1, MOST_PRODUCTS).x, raised
    return supported(at, tangent.precondition(-residual)), 0.0


def line_search(at: Configuration, here: Place, direction: np.ndarray) -> Place | None:
    """Shorten the step until Π falls enough; None where it does not."""
    slope = float(here.residual @ direction)
    if not slope < 0:
        return None
    # Near the minimum Π changes by less than its rounding error; there the residual decides.
    rounding = 1e-12 * (abs(here.energy) + abs(slope)) + energy_rounding(at)
    step = free_share(at, here.vector, direction)
    for _ in range(12 if step else 0):
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
