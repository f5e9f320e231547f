"""Equilibrium as a minimum of the potential.

Newton with conjugate gradients on a reused factorisation, and a line search on the energy. Descent of Π finds stable
states only; a design or load that has none is told apart from a hard one by the reason in `NoEquilibrium`.
"""

from __future__ import annotations

from dataclasses import dataclass

import jax
import jax.numpy as jnp
import numpy as np

from pneumorph.mechanics import potential as kernels
from pneumorph.mechanics.energies import SMALLEST_RATIO
from pneumorph.mechanics.linear import SingularMatrix
from pneumorph.mechanics.model import Model
from pneumorph.mechanics.potential import Loads, State
from pneumorph.mechanics.tangent import Configuration, Tangent

TOLERANCE = 1e-9
"""Residual norm over the norm of the applied forces at which a state counts as an equilibrium."""

MOST_NEWTON_STEPS = 40
MOST_PRODUCTS = 6
"""Conjugate gradient steps that an old factorisation is given: a new one costs about as much as five."""

MOST_RELAXATIONS, MOST_RELAXATIONS_AT_REST, RELAXED, SMOOTH = 3, 10, 0.9, 0.02
"""Steps with the factorisation of an earlier configuration, or of the state of rest, before the first fresh one; what
each has to leave of the residual at most; and the residual at which they have done their work: they even out what a
prediction or an interpolation has left, which would make the tangent indefinite."""

RUNAWAY_STRETCH = 8.0


@dataclass(frozen=True)
class Equilibrium:
    """A converged state.

    Attributes
    ----------
    state : State
        Unknowns, padded; what the next solve starts from.
    u : (N, 3) displacements, mm.
    plate : (6,) translation (mm) and rotation vector (rad) of the plate; area mean and zero rotation of a free tip.
    volumes : dict of chamber volumes, mm³.
    reaction : (6,) what the actuator exerts on whatever blocks the plate, N and N·mm; zero where nothing does.
    max_stretch : largest principal stretch at the quadrature points.
    residual : residual norm over applied forces.
    negative_pivots : of the tangent at this state; 0 means stable.
    factorisations, solves : what it cost.
    """

    state: State
    u: np.ndarray
    plate: np.ndarray
    volumes: dict[str, float]
    reaction: np.ndarray
    max_stretch: float
    residual: float
    negative_pivots: int
    factorisations: int
    solves: int

    @property
    def stable(self) -> bool:
        return self.negative_pivots == 0


@dataclass(frozen=True)
class NoEquilibrium:
    """No equilibrium was found.

    Attributes
    ----------
    reason : a sentence.
    fraction : the part of the load up to which equilibria were found, 0…1 (0 where no load stepping was tried).
    last : the last equilibrium on the way, if any.
    """

    reason: str
    fraction: float
    last: Equilibrium | None


def configuration(model: Model, X: np.ndarray, loads: Loads, blocked: np.ndarray | None = None) -> Configuration:
    """Nodes X (N, 3) mm, loads, and blocked plate components (6,) bool, ready for the solver."""
    return Configuration(
        model, model.pad(X), loads, np.zeros(6, bool) if blocked is None else np.asarray(blocked, bool)
    )


def loads(
    model: Model,
    pressures: dict[str, float],
    acceleration: np.ndarray | None = None,
    spring: np.ndarray | None = None,
    wrench: np.ndarray | None = None,
) -> Loads:
    """Loads on a model: pressures in MPa by chamber, acceleration (3,) mm/s², springs and wrench (6,) in N, mm, rad."""
    zero = np.zeros(6)
    force = np.zeros(3) if acceleration is None else model.rubber.density * np.asarray(acceleration, float)
    return Loads(
        pressure=jnp.asarray([pressures.get(name, 0.0) for name in model.chambers], dtype=float),
        body_force=jnp.asarray(force),
        spring=jnp.asarray(zero if spring is None else spring, dtype=float),
        wrench=jnp.asarray(zero if wrench is None else wrench, dtype=float),
    )


def rest(model: Model) -> State:
    """The undeformed state."""
    return model.state(np.zeros(model.size))


def solve(
    at: Configuration, tangent: Tangent, start: State | None = None, tolerance: float = TOLERANCE
) -> Equilibrium | NoEquilibrium:
    """Find the equilibrium of a configuration.

    Newton goes straight to the full load from `start`; where that fails the load is stepped up from rest, with steps
    that adapt. `tolerance` is the residual norm over that of the applied forces at which a state counts as converged.
    """
    before = tangent.factorisations, tangent.solves
    if start is not None:
        found = _newton(at, tangent, start, tolerance)
        if not isinstance(found, str):
            return _equilibrium(at, tangent, *found, before)
    return _step_up(at, tangent, before, tolerance)


def _step_up(at: Configuration, tangent: Tangent, before, tolerance: float) -> Equilibrium | NoEquilibrium:
    state, residual, reached, step = rest(at.model), 0.0, 0.0, 1.0
    last = None
    reason = ""
    while reached < 1.0:
        fraction = min(1.0, reached + step)
        part = Configuration(at.model, at.X, scaled(at.loads, fraction), at.blocked)
        start = state if last is None else _extrapolate(at, state, last, reached, fraction)
        found = _newton(part, tangent, start, tolerance)
        if isinstance(found, str) and last is not None:
            found = _newton(part, tangent, state, tolerance)
        if isinstance(found, str):
            reason, step = found, step / 2
            if step < 1 / 40:
                pressures = ", ".join(
                    f"{name} = {1e3 * float(p) * fraction:.3g} kPa"
                    for name, p in zip(at.model.chambers, at.loads.pressure, strict=True)
                )
                held = None
                if reached > 0:
                    part = Configuration(at.model, at.X, scaled(at.loads, reached), at.blocked)
                    held = _equilibrium(part, tangent, state, 0.0, before)
                return NoEquilibrium(f"no equilibrium found near {pressures}: {reason}", reached, held)
            continue
        last = (reached, state)
        (state, residual), reached = found, fraction
        step *= 1.5
    return _equilibrium(at, tangent, state, residual, before)


def _extrapolate(at: Configuration, state: State, last, reached: float, fraction: float) -> State:
    earlier, old = last
    ratio = (fraction - reached) / (reached - earlier)
    return jax.tree.map(lambda new, past: new + ratio * (new - past), state, old)


def scaled(full: Loads, fraction: float) -> Loads:
    """A part of the pressures, weights and plate loads; springs stay."""
    return full._replace(
        pressure=full.pressure * fraction, body_force=full.body_force * fraction, wrench=full.wrench * fraction
    )


def unloaded(at: Configuration) -> Configuration:
    """The same body and springs without pressures, weights and plate loads."""
    return Configuration(at.model, at.X, scaled(at.loads, 0.0), at.blocked)


def _evaluate(at: Configuration, state: State):
    model = at.model
    value, residual = kernels.value_and_residual(*model.rubber_arguments, model.top, at.X, state, at.loads)
    return float(value), model.vector(residual)


def applied_force(at: Configuration, state: State) -> float:
    """Norm of the applied nodal forces: the measure that residuals are held against, N."""
    _, full = _evaluate(at, state)
    _, internal = _evaluate(unloaded(at), state)
    difference = full - internal
    # Moments enter with the millimetre as lever; the floor keeps the unloaded body solvable.
    return max(float(np.linalg.norm(difference[np.isfinite(difference)])), 1e-3)


def _newton(at: Configuration, tangent: Tangent, start: State, tolerance: float) -> tuple[State, float] | str:
    """Minimise Π from `start`; the state and its relative residual, or the reason why not."""
    model, held = at.model, at.held
    vector = model.vector(start)
    vector[:-6][held[:-6]] = 0.0
    vector[-6:][held[-6:]] = 0.0
    energy, residual = _evaluate(at, model.state(vector))
    if not np.isfinite(energy) or not np.isfinite(residual).all():
        return "the starting state is no finite one"
    scale = applied_force(at, model.state(vector))
    residual = np.where(held, 0.0, residual)
    size = float(np.linalg.norm(residual)) / scale
    relaxations = MOST_RELAXATIONS
    if not tangent.ready and np.any(vector):
        # A state carried over from another mesh is rough in detail; the tangent at rest is definite and evens it out.
        tangent.factorise(unloaded(at), rest(model))
        relaxations = MOST_RELAXATIONS_AT_REST
    elif not tangent.ready:
        relaxations = 0
    exact = False
    for _ in range(MOST_NEWTON_STEPS):
        if size <= tolerance:
            if _smallest_ratio(at, vector) <= SMALLEST_RATIO:
                return "an element is turned inside out"
            return model.state(vector), size
        state = model.state(vector)
        relaxing = relaxations > 0
        try:
            if relaxing:
                direction = tangent.precondition(-residual)
            else:
                direction, exact = _direction(at, tangent, state, residual, size, exact)
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
        if size > 1e-2 and _largest_stretch(at, vector) > RUNAWAY_STRETCH:
            return f"the body runs away (stretch beyond {RUNAWAY_STRETCH:g}), as when a chamber balloons"
    return f"Newton did not settle in {MOST_NEWTON_STEPS} steps (relative residual {size:.1e})"


def _direction(at: Configuration, tangent: Tangent, state: State, residual: np.ndarray, size: float, exact: bool):
    """A descent direction, and whether the factorisation behind it is that of a tangent, not of a raised one.

    A factorisation of a tangent near by serves a few conjugate gradients; where it does not, a fresh one is made. Where
    the fresh tangent is indefinite, conjugate gradients on it follow its negative curvature.
    """
    accuracy = float(np.clip(np.sqrt(size), 1e-3, 0.1))
    if exact:
        solution = tangent.solve(at, state, -residual, accuracy, MOST_PRODUCTS)
        if solution.converged:
            return solution.x, True
    if tangent.factorise_convex(at, state):
        return tangent.solve(at, state, -residual, 0.1, 2 * MOST_PRODUCTS).x, False
    return tangent.precondition(-residual), True


def _line_search(at: Configuration, vector, energy, residual, direction, scale):
    """Backtrack on Π until it falls enough; None where it does not."""
    slope = float(residual @ direction)
    if not slope < 0:
        return None
    # Near the minimum Π changes by less than its rounding error; there the residual decides.
    rounding = 1e-12 * (abs(energy) + abs(slope))
    step = 1.0
    for _ in range(12):
        trial = vector + step * direction
        value, gradient = _evaluate(at, at.model.state(trial))
        if np.isfinite(value) and np.isfinite(gradient).all():
            gradient = np.where(at.held, 0.0, gradient)
            enough = value <= energy + 1e-4 * step * slope
            settled = value <= energy + rounding and np.linalg.norm(gradient) < np.linalg.norm(residual)
            if enough or settled:
                return trial, value, gradient
        step *= 0.5
    return None


def _smallest_ratio(at: Configuration, vector) -> float:
    _, ratio = kernels.stretches(at.model.top, at.X, at.model.state(vector))
    return float(jnp.min(ratio))


def _largest_stretch(at: Configuration, vector) -> float:
    stretch, _ = kernels.stretches(at.model.top, at.X, at.model.state(vector))
    return float(jnp.max(stretch))


def _equilibrium(at: Configuration, tangent: Tangent, state: State, residual: float, before) -> Equilibrium:
    """Factorise at the converged state, for its stability and for the adjoint, and read the results off."""
    model = at.model
    tangent.factorise(at, state)
    negative = tangent.negative_pivots
    u = kernels.displacement(model.top, at.X, state)
    _, forces = _evaluate(at, state)
    plate = np.asarray(state.plate) if model.plate else np.r_[kernels.tip_mean(model.top, at.X, u), np.zeros(3)]
    volumes = kernels.chamber_volumes(model.top, at.X + u)
    stretch, _ = kernels.stretches(model.top, at.X, state)
    return Equilibrium(
        state=state,
        u=np.asarray(u)[: model.nodes],
        plate=plate,
        volumes=dict(zip(model.chambers, map(float, volumes), strict=True)),
        reaction=np.where(at.blocked, -forces[-6:], 0.0),
        max_stretch=float(jnp.max(stretch)),
        residual=residual,
        negative_pivots=negative,
        factorisations=tangent.factorisations - before[0],
        solves=tangent.solves - before[1],
    )


def predict(at: Configuration, tangent: Tangent, state: State, dX: np.ndarray, dp: np.ndarray) -> State:
    """The state after nodes move by dX (N, 3) and pressures by dp (C,), to first order: K du = −∂R/∂X dX − ∂R/∂p dp."""
    model = at.model
    arguments = (*model.rubber_arguments, model.top, at.X, state, at.loads)
    change = model.vector(kernels.shape_product(*arguments, model.pad(dX)))
    if np.any(dp):
        change = change + model.vector(kernels.pressure_product(*arguments, jnp.asarray(dp)))
    return model.state(model.vector(state) + tangent.precondition(np.where(at.held, 0.0, -change)))
