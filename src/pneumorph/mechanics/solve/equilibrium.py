"""Equilibrium: what is asked for, what is found, and the way there.

Plain elements descend the potential (`descent.py`), mixed ones, whose potential has a saddle there, take Newton's
method (`saddle.py`). Both find stable states; a load that has none is answered by the reason in `NoEquilibrium`.
"""

from __future__ import annotations

from dataclasses import dataclass, replace

import jax
import numpy as np

from pneumorph.mechanics.assembly import potential as kernels
from pneumorph.mechanics.assembly.kinematics import State
from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.sums import summed
from pneumorph.mechanics.assembly.sums import volumes as chamber_volumes
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.assembly.terms import Loads
from pneumorph.mechanics.assembly.tip import tip_centre
from pneumorph.mechanics.solve.balance import applied_force, evaluate, largest_stretch, scaled
from pneumorph.mechanics.solve.descent import minimise
from pneumorph.mechanics.solve.saddle import find_stable

TOLERANCE = 1e-9
"""Residual norm over the norm of the applied forces at which a state counts as an equilibrium."""


SMALLEST_FRACTION = 1 / 20
"""Part of the load that is still halved once when the load is stepped up."""


@dataclass(frozen=True)
class Equilibrium:
    """A converged state.

    Attributes
    ----------
    state : State
        Unknowns; what the next solve starts from.
    u : (N, 3) displacements, mm; like the state those of half the body where only that is solved.
    plate : (6,) translation (mm) and rotation vector (rad) of the plate; area mean and zero rotation of a free tip.
    volumes : dict of chamber volumes, mm³, of the whole body.
    reaction : (6,) what the whole actuator exerts on whatever blocks the plate, N and N·mm; zero where nothing does.
    max_stretch : largest principal stretch at the quadrature points.
    residual : residual norm over applied forces.
    negative_pivots : of the tangent at this state; 0 means stable, in half a body against symmetric motions alone.
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


def configure(model: Model, X: np.ndarray, loads: Loads, blocked: np.ndarray | None = None) -> Configuration:
    """Nodes X (N, 3) mm, loads, and blocked plate components (6,) bool, ready for the solver."""
    return Configuration(
        model, np.asarray(X, dtype=float), loads, np.zeros(6, bool) if blocked is None else np.asarray(blocked, bool)
    )


def build_loads(
    model: Model,
    pressures: dict[str, float],
    acceleration: np.ndarray | None = None,
    spring: np.ndarray | None = None,
    wrench: np.ndarray | None = None,
) -> Loads:
    """Loads on a model: pressures in MPa by chamber, acceleration (3,) mm/s², springs and wrench (6,) in N, mm, rad.

    They are those of the whole body and, where the model is half of it, symmetric like it (see `mirror.mirror_of`).
    """
    zero = np.zeros(6)
    share = 1.0 / model.copies
    return Loads(
        pressure=np.asarray([pressures.get(name, 0.0) for name in model.chambers], dtype=float),
        acceleration=np.asarray(zero[:3] if acceleration is None else acceleration, dtype=float),
        spring=share * np.asarray(zero if spring is None else spring, dtype=float),
        wrench=share * np.asarray(zero if wrench is None else wrench, dtype=float),
    )


def rest(model: Model) -> State:
    """The undeformed state."""
    return model.state(np.zeros(model.size))


def solve(
    at: Configuration,
    tangent: Tangent,
    start: State | None = None,
    tolerance: float = TOLERANCE,
    since: tuple[Loads, State] | None = None,
) -> Equilibrium | NoEquilibrium:
    """Find the equilibrium of a configuration.

    Newton goes straight to the full load from `start`; without one, or where that fails, the load is stepped up with
    steps that adapt: from the equilibrium of other loads on the same nodes that `since` tells, or else from rest,
    weights and plate loads first, then pressures. `tolerance` is the residual norm over that of the applied forces at
    which a state counts as converged.
    """
    before = tangent.factorisations, tangent.solves
    try:
        if start is not None:
            found = _find(at, tangent, start, tolerance)
            if not isinstance(found, str):
                return read_off(at, tangent, *found, before)
        if since is not None:
            return _raise(at, since, tangent, before, tolerance)
        return _step_up(at, tangent, before, tolerance)
    except SingularMatrix:
        return NoEquilibrium("the tangent is singular", 0.0, None)


def _find(at: Configuration, tangent: Tangent, start: State, tolerance: float) -> tuple[State, float] | str:
    """A stable state near a prediction and its relative residual, or the reason why none was found."""
    return (find_stable if at.model.mixed else minimise)(at, tangent, start, tolerance)


def _step_up(at: Configuration, tangent: Tangent, before, tolerance: float) -> Equilibrium | NoEquilibrium:
    """From rest: weights and plate loads first, which make the body sag, then the pressures."""
    loads, since = at.loads, (scaled(at.loads, 0.0), rest(at.model))
    if np.any(loads.acceleration) or np.any(loads.wrench):
        sagging = replace(at, loads=loads._replace(pressure=0.0 * loads.pressure))
        # As near as the full load asks for: a small weight's own forces may be lost in the rounding of the residual.
        near = tolerance * max(1.0, applied_force(at, since[1]) / applied_force(sagging, since[1]))
        sag = _raise(sagging, since, tangent, before, near)
        if isinstance(sag, NoEquilibrium) or not np.any(loads.pressure):
            return sag
        since = sagging.loads, sag.state
    return _raise(at, since, tangent, before, tolerance)


def _raise(
    whole: Configuration, since: tuple[Loads, State], tangent: Tangent, before, tolerance: float
) -> Equilibrium | NoEquilibrium:
    """From the equilibrium of other loads to those of `whole`, with steps that adapt."""
    earlier, state = since
    residual, reached, step = 0.0, 0.0, 1.0
    last, at = None, None
    reason = ""
    while at is None or reached < 1.0:
        fraction = min(1.0, reached + step)
        # At the full load the configuration is the caller's own, so that its factorisation is known again.
        part = whole if fraction == 1.0 else replace(whole, loads=_between(earlier, whole.loads, fraction))
        start = state if last is None else _between(last[1], state, (fraction - last[0]) / (reached - last[0]))
        # Cold, Newton's own test needs fewer factorisations than descent, and fails sooner where there is nothing.
        found = find_stable(part, tangent, start, tolerance)
        if isinstance(found, str) and last is not None:
            found = find_stable(part, tangent, state, tolerance)
        if isinstance(found, str) and step < SMALLEST_FRACTION and not part.model.mixed:
            found = minimise(part, tangent, state, tolerance)
        if isinstance(found, str):
            reason, step = found, step / 2
            if step < SMALLEST_FRACTION / 2:
                nearest = None if at is None else read_off(at, tangent, state, 0.0, before)
                return NoEquilibrium(f"no equilibrium found {_where(part, fraction)}: {reason}", reached, nearest)
            continue
        last = (reached, state)
        (state, residual), reached, at = found, fraction, part
        step *= 1.5
    return read_off(at, tangent, state, residual, before)


def _between(one, other, part: float):
    """Loads, or a state, on the straight line from one to the other or beyond it."""
    return jax.tree.map(lambda a, b: a + part * (b - a), one, other)


def _where(at: Configuration, fraction: float) -> str:
    """The loads near which nothing was found."""
    pressures = at.loads.pressure
    if not np.any(pressures):
        return f"at {fraction:.2g} of the weight and the plate's loads"
    named = zip(at.model.chambers, pressures, strict=True)
    return "near " + ", ".join(f"{name} = {1e3 * float(pressure):.3g} kPa" for name, pressure in named)


def read_off(at: Configuration, tangent: Tangent, state: State, residual: float, before) -> Equilibrium:
    """Factorise at the converged state, for its stability and for the adjoint, and read the results off."""
    model = at.model
    tangent.move_to(at, state)
    negative = tangent.negative_pivots
    u = kernels.displacement(model.tip, at.X, state)
    _, forces = evaluate(at, state)
    plate = state.plate if model.plate else np.r_[tip_centre(model.tip, at.X, u), np.zeros(3)]
    volumes = model.copies * summed(chamber_volumes, model.cavities, at.X, u)
    return Equilibrium(
        state=state,
        u=u,
        plate=plate,
        volumes=dict(zip(model.chambers, map(float, volumes), strict=True)),
        reaction=np.where(at.blocked & ~model.odd, -model.copies * forces[-6:], 0.0),
        max_stretch=largest_stretch(at, state),
        residual=residual,
        negative_pivots=negative,
        factorisations=tangent.factorisations - before[0],
        solves=tangent.solves - before[1],
    )
