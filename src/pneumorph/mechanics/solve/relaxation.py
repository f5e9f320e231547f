"""Relaxation from a state that has lost its stability towards a stable one, as a strongly damped body moves.

The body moves through a medium whose resistance per volume is s times its velocity: s M dx/dt = −R(x), with the masses
M of a body of density 1 (`lateral.masses_of`). Implicit Euler steps of growing length,

    R(x) + s M (x − x_n) = 0,    s → 0,

end as Newton's method (pseudo-transient continuation; Kelley and Keyes 1998, SIAM J. Numer. Anal. 35, 508-523). Where
K + s M has no negative pivots, x is a minimum of Π + s/2 ‖x − x_n‖²_M near x_n, with π eliminated in mixed elements:
the potential falls from step to step.
"""

from __future__ import annotations

import numpy as np

from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.material.energies import SMALLEST_RATIO
from pneumorph.mechanics.solve.balance import (
    RUNAWAY_STRETCH,
    applied_force,
    free_share,
    largest_stretch,
    length,
    residual_at,
    smallest_ratio,
    supported,
)
from pneumorph.mechanics.solve.lateral import masses_of, softest

MOST_STEPS, MOST_CORRECTIONS = 200, 3
"""Most factorisations, and most corrections with each: a step that needs more is too long."""

PUSH, LARGEST_MOVE = 1e-3, 0.05
"""Largest displacements of the first push along the softest motion and in a step, relative to the diagonal of the
body's bounding box."""

FIRST = 2.0
"""s in the first step over the most negative eigenvalue, with which the softest motion doubles in each step."""

BORNE, AIMED, CLOSE = 1.0, 0.3, 0.1
"""Ratio of the first two corrections of a step above which it is too long, the one that the next step aims at, and the
size of a correction, over the first, that is the last."""

SLOWEST, FASTEST, AGAIN, POWER = 6.0, 0.2, 2.0, 1 / 3
"""Largest and smallest ratio of s to that of the step before, the smallest after a step that was too long, and the
power of the ratio of corrections to which it is chosen: those grow with about the third power of 1/s."""

BALLOON, LEAST_BALLOON = 2.0, 3.0
"""Largest stretch, over that of the start, and the least largest stretch, from which on the body balloons."""

SMOOTH, FAINT = 0.02, 0.01
"""Relative residual, and s over its first value, below which a search for the equilibrium takes over."""


def relax(at: Configuration, tangent: Tangent, start: State) -> State | str:
    """A state from which a search finds a stable equilibrium downhill from `start`, or why there is none.

    The start may be an unstable equilibrium, or a stable one under other loads. Of plain elements it is returned after
    a push along its softest motion alone, since their search minimises Π (`descent.py`): it takes longer steps, where
    the membrane forces of thin walls leave viscous ones short.

    Raises
    ------
    SingularMatrix, TooCostly
        As factorisations do.
    """
    model, masses = at.model, masses_of(at)
    size = float(np.linalg.norm(np.ptp(np.asarray(at.X)[: model.nodes], axis=0)))
    soft = softest(at, start, tangent, masses)
    vector, push = model.vector(start), PUSH * size * supported(at, model.vector(soft.motion))
    vector = vector + free_share(at, vector, push) * push
    if not model.mixed:
        return model.state(vector)
    viscosity = first = FIRST * abs(soft.stiffness)
    most = min(max(BALLOON * largest_stretch(at, start), LEAST_BALLOON), RUNAWAY_STRETCH)
    scale, masses = applied_force(at, start), supported(at, masses)
    for _ in range(MOST_STEPS):
        there = model.state(vector)
        tangent.factorise(at, there, damping=viscosity * masses)
        if tangent.negative_pivots > 0:
            viscosity *= SLOWEST
            continue
        residual = float(np.linalg.norm(residual_at(at, vector))) / scale
        if residual < SMOOTH and viscosity < FAINT * first:
            return there
        moved, ratio = _step(at, tangent, vector, viscosity * masses, LARGEST_MOVE * size)
        slower = float(np.clip((ratio / AIMED) ** POWER, FASTEST, SLOWEST))
        viscosity *= slower if moved is not None else max(slower, AGAIN)
        if moved is not None:
            vector = moved
            if largest_stretch(at, model.state(vector)) > most:
                return f"the body balloons beyond a stretch of {most:.2g}"
    return f"no stable state was reached in {MOST_STEPS} steps"


def _step(
    at: Configuration, tangent: Tangent, start: np.ndarray, damping: np.ndarray, reach: float
) -> tuple[np.ndarray | None, float]:
    """Unknowns after an implicit Euler step with the factorised tangent, and the ratio of its first two corrections.

    None where the step is too long. Where surfaces are about to meet it ends, and the ratio is as aimed at.
    """
    vector, first, previous, ratio = start, 0.0, np.inf, 0.0
    for number in range(MOST_CORRECTIONS):
        force = residual_at(at, vector) + damping * (vector - start)
        change = supported(at, tangent.precondition(-force))
        now = length(at, change)
        if not np.isfinite(now):
            return None, np.inf
        if number == 0:
            first, far = now, float(np.abs(change[damping > 0.0]).max()) / reach
            if far > 1.0:
                return None, AIMED * far
        elif number == 1:
            ratio = now / first
        if now > (BORNE if number == 1 else 1.0) * previous:
            return None, max(ratio, BORNE)
        share = free_share(at, vector, change)
        vector = vector + share * change
        if smallest_ratio(at, vector) <= SMALLEST_RATIO:
            return None, np.inf
        if share < 1.0:
            return vector, AIMED
        if number and now < CLOSE * first:
            break
        previous = now
    return vector, ratio
