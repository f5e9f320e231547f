"""Equilibrium of mixed elements: a saddle point of Π, minimal in the displacements and maximal in π.

Newton's method with the affine-invariant monotonicity test (Deuflhard 2011, Newton Methods for Nonlinear Problems,
algorithm NLEQ-ERR): a step is accepted when the next correction by the same factorisation is smaller. If that
correction is much smaller, it is the next step, without a new factorisation. Energies are not compared: with π
eliminated the potential is the more ill-conditioned the larger κ/μ.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.metrics import Metrics, metrics_along_state, metrics_at, missing, pulled
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import Guess, State
from pneumorph.mechanics.material.energies import SMALLEST_RATIO
from pneumorph.mechanics.solve.balance import (
    HALVED,
    INTERPENETRATION,
    RUNAWAY_STRETCH,
    SMOOTH,
    apart,
    applied_force,
    free_share,
    held,
    largest_stretch,
    length,
    ratios_at,
    residual_at,
    residual_rounding,
    smallest_ratio,
    stepped_ratios,
    supported,
)

MOST_NEWTON_STEPS = 40
"""Most steps of a search."""
SMALLEST_STEP = 1 / 64
"""Smallest part of Newton's step that is tried."""

QUICK, SLOW = 0.2, 0.7
"""Contraction below which an old factorisation is kept, and the one that is tolerated while it smooths a rough start:
an assembly with factorisation costs about twelve back-solves."""

GROWN = 2.0
"""With stiff sheets and fibres the correction after a step may be this much larger than the step: where they become
taut or slack it says little of the next one, and shorter steps would pass the same points one by one."""

NEGLIGIBLE, NOTHING = 1e-5, 1e-12
"""A relative residual below the first is rounding error where the correction, over the size of the body, is below the
second: those of stiff sheets and fibres are larger than the tolerance under small loads."""

MOST_TANGENTS_DOWN, STEPS_PER_FACTORISATION, LEAST_SHIFT = 100, 2, 1e-7
"""On the way down from an unstable state: most tangents, steps with each of them, and the least fraction by which their
diagonal is raised."""

LARGEST_MOVE = 0.02
"""Largest displacement in one step on the way down, relative to the diagonal of the body's bounding box."""


def find_stable(at: Configuration, tangent: Tangent, start: Guess, tolerance: float) -> tuple[State, float] | str:
    """A stable state near `start` with its relative residual, or the reason why none was found.

    Where Newton's method ends in an unstable state, the search goes on downhill from there. If that finds nothing, the
    unstable state is returned, with its negative pivots.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        With the last factorisation, if there is one.
    start : Guess
        Where the search begins.
    tolerance : float
        Residual over the applied force at which it ends.
    """
    try:
        found = newton(at, tangent, start, tolerance)
        if isinstance(found, str):
            return found
        if tangent.borrows(at) and tangent.pivots_at(at, found[0]) == 0:
            return found
        tangent.move_to(at, found[0])
        if tangent.negative_pivots == 0:
            return found
        below = _downhill(at, tangent, found[0], tolerance)
        return below or found
    except SingularMatrix:
        return "the tangent is singular"


@dataclass(frozen=True, eq=False)
class Iterate:
    """Unknowns (n,) with the metrics under sheets and fibres, and the residual (n,) that Newton's method reduces.

    That is the residual of both with the metrics eliminated; `residual` is that of the displacements' own metrics.
    """

    vector: np.ndarray
    metrics: Metrics
    residual: np.ndarray
    reduced: np.ndarray


def newton(at: Configuration, tangent: Tangent, start: Guess, tolerance: float) -> tuple[State, float] | str:
    """The equilibrium near `start`, stable or not, with its relative residual, or the reason why none was found.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        With the last factorisation, if there is one.
    start : Guess
        Where the search begins.
    tolerance : float
        Residual over the applied force at which it ends.
    """
    model = at.model
    vector = held(at, model.vector(start.state))
    if not apart(at, vector):
        return INTERPENETRATION
    residual = residual_at(at, vector)
    if not np.isfinite(residual).all():
        return "the starting state is not finite"
    scale = applied_force(at, model.state(vector))
    # In plain elements too, the stress of volume ratios is then an unknown of its own: see `descent.py`.
    ratios = None if model.mixed else ratios_at(at, vector)
    here = Iterate(vector, start.metrics or metrics_at(model, at.X, model.state(vector)), residual, residual)
    direction, fresh = None, True
    if tangent.ready:
        here = reduced_with(at, tangent, here)
        # The factorisation may belong to other blocked components of the plate.
        direction, fresh = supported(at, tangent.precondition(-here.reduced)), False
    size = np.inf
    for _ in range(MOST_NEWTON_STEPS):
        size, rough = (float(np.linalg.norm(each)) / scale for each in (here.residual, here.reduced))
        if size <= tolerance:
            if smallest_ratio(at, here.vector) <= SMALLEST_RATIO:
                return "an element is inverted"
            if not apart(at, here.vector):
                return INTERPENETRATION
            return model.state(here.vector), size
        if direction is None:
            others = ratios if rough > SMOOTH else None
            tangent.factorise(at, model.state(here.vector), others, here.metrics)
            here = reduced_with(at, tangent, here)
            direction, fresh = supported(at, tangent.precondition(-here.reduced)), True
        if size <= NEGLIGIBLE and length(at, direction) <= NOTHING * float(np.abs(at.X).max()):
            tolerance = max(tolerance, size)
            continue
        borne = QUICK if rough < SMOOTH else SLOW
        moved = _moved(at, tangent, here, direction, SMALLEST_STEP if fresh else 1.0, None if fresh else borne)
        stuck = fresh and (moved is None or np.linalg.norm(moved[0].residual) > HALVED * size * scale)
        if stuck and size * scale <= residual_rounding(at, here.vector):
            tolerance = max(tolerance, size)
            continue
        if moved is None and fresh:
            return "Newton's method found no step that leads nearer"
        if moved is None:
            direction = None
            continue
        trial, correction, contraction = moved
        if ratios is not None and rough > SMOOTH:
            ratios = stepped_ratios(at, ratios, here.vector, direction, trial.vector)
        here = trial
        kept = contraction < (QUICK if fresh else borne)
        direction, fresh = (correction, False) if kept else (None, True)
        if rough > 1e-2 and largest_stretch(at, model.state(here.vector)) > RUNAWAY_STRETCH:
            return f"the body deforms without limit (stretch beyond {RUNAWAY_STRETCH:g}), as when a chamber balloons"
    return f"Newton's method did not converge in {MOST_NEWTON_STEPS} steps (relative residual {size:.1e})"


def reduced_with(at: Configuration, tangent: Tangent, here: Iterate) -> Iterate:
    """The same unknowns, with the metrics eliminated by the tangent that is factorised now."""
    model, origin = at.model, tangent.serves
    if not here.metrics or origin is None:
        return replace(here, reduced=here.residual)
    state = model.state(here.vector)
    own = metrics_at(model, at.X, state)
    change = pulled(model, at.X, state, at.loads, here.metrics)
    there = origin.metrics or metrics_at(model, origin.at.X, origin.state)
    short = [now - held for now, held in zip(own, here.metrics, strict=True)]
    change += missing(model, origin.at.X, origin.state, at.loads, there, short)
    return replace(here, reduced=here.residual + supported(at, change))


def metrics_along_step(at: Configuration, tangent: Tangent, here: Iterate, direction: np.ndarray) -> Metrics:
    """How the metrics change with a step along a direction: at its end they are those linearised.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        By which the direction was found.
    here : Iterate
        Where the step begins.
    direction : (n,) array
        The step.
    """
    model, origin = at.model, tangent.serves
    if not here.metrics or origin is None:
        return ()
    by = metrics_along_state(model, origin.at.X, origin.state, model.state(direction))
    own = metrics_at(model, at.X, model.state(here.vector))
    return [now - held + change for now, held, change in zip(own, here.metrics, by, strict=True)]


def _moved(at: Configuration, tangent: Tangent, here: Iterate, direction, smallest: float, bound: float | None):
    """The iterate after a step that passes the test, the next correction and its relative size.

    Steps are halved down to `smallest`. The contraction must be below `bound`, by default 1 − step/4, or `GROWN` with
    sheets and fibres.
    """
    before, whole = length(at, direction), free_share(at, here.vector, direction)
    step, smallest = whole, whole * smallest
    least = min(SMALLEST_RATIO, smallest_ratio(at, here.vector))
    along = metrics_along_step(at, tangent, here, direction)
    while step >= smallest:
        vector = here.vector + step * direction
        residual = residual_at(at, vector)
        if np.isfinite(residual).all() and smallest_ratio(at, vector) >= least:
            metrics = [held + step * change for held, change in zip(here.metrics, along, strict=True)]
            trial = reduced_with(at, tangent, Iterate(vector, metrics, residual, residual))
            correction = supported(at, tangent.precondition(-trial.reduced))
            contraction = length(at, correction) / max(before, 1e-300)
            most = GROWN if here.metrics else 1 - step / 4
            if contraction <= (most if bound is None else bound):
                # Only after a full step does the correction show how good the factorisation still is.
                return trial, correction, contraction if step == 1.0 else 1.0
        step /= 2
    return None


def _downhill(at: Configuration, tangent: Tangent, start: State, tolerance: float) -> tuple[State, float] | None:
    """A stable state of less energy than an unstable one, whose tangent is factorised; None where none was reached.

    A push along the softest motions, then Newton steps with a tangent whose diagonal is raised just enough to make it
    stable: they follow the gradient flow of the potential with π eliminated. Motions that release energy grow by at
    least a third in each step.
    """
    model = at.model
    reach = LARGEST_MOVE * float(np.linalg.norm(np.ptp(np.asarray(at.X)[: model.nodes], axis=0)))
    moving = np.where(at.constrained, 0.0, 1.0)
    moving[model.hydrostatic_unknowns] = 0.0
    push = moving * np.random.default_rng(0).standard_normal(model.size)
    for _ in range(4):
        push = tangent.precondition(moving * push)
        push /= np.abs(moving * push).max()
    push = 0.1 * reach * push
    vector = model.vector(start) + free_share(at, model.vector(start), push) * push
    scale, raised = applied_force(at, start), LEAST_SHIFT
    for _ in range(MOST_TANGENTS_DOWN):
        residual = residual_at(at, vector)
        if not np.isfinite(residual).all() or smallest_ratio(at, vector) <= SMALLEST_RATIO:
            return None
        if largest_stretch(at, model.state(vector)) > RUNAWAY_STRETCH:
            return None
        raised = tangent.factorise_convex(at, model.state(vector), max(raised / 4, LEAST_SHIFT))
        if not raised and np.linalg.norm(residual) < SMOOTH * scale:
            found = newton(at, tangent, Guess(model.state(vector)), tolerance)
            if not isinstance(found, str):
                tangent.move_to(at, found[0])
                if tangent.negative_pivots == 0:
                    return found
        previous = np.inf
        for _ in range(STEPS_PER_FACTORISATION):
            # The first step moves along the soft motions, the next ones correct the errors it made in the stiff ones.
            direction = supported(at, tangent.precondition(-residual))
            now = length(at, direction)
            if now > 2 * previous:
                break
            direction = min(1.0, reach / np.abs(moving * direction).max()) * direction
            vector = vector + free_share(at, vector, direction) * direction
            residual, previous = residual_at(at, vector), now
            if not np.isfinite(residual).all():
                return None
    return None
