"""Find the equilibrium of a body under given loads.

Plain elements minimise the potential (`descent.py`). Mixed ones, where the equilibrium is a saddle point, use Newton's
method (`saddle.py`). Both look for stable states; where there is none, `NoEquilibrium` has the reason.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field, replace
from types import MappingProxyType

import jax
import numpy as np

from pneumorph.doing import doing
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.enclosed import Enclosed
from pneumorph.mechanics.assembly.linear import SingularMatrix, TooCostly
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.assembly.tip import tip_centre
from pneumorph.mechanics.assembly.volumes import volumes_of
from pneumorph.mechanics.contact.pose import pose_of
from pneumorph.mechanics.elements.kinematics import Guess, State, volume_ratio
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mechanics.solve.balance import (
    applied_force,
    bulk_over_shear,
    evaluate,
    free_share,
    free_way,
    largest_stretches,
    relative_residual,
    unloaded,
)
from pneumorph.mechanics.solve.descent import ROUGH, minimise
from pneumorph.mechanics.solve.filled import (
    Filled,
    fill,
    nearest_pressure,
    negative_motions,
    pressure_of,
    with_pressures,
)
from pneumorph.mechanics.solve.fitting import fitted
from pneumorph.mechanics.solve.landing import Unheld, landed, unheld
from pneumorph.mechanics.solve.prediction import guess_after, predict_change
from pneumorph.mechanics.solve.saddle import find_stable

TOLERANCE = 1e-9
"""Relative residual, over the norm of the applied forces, at which a state counts as an equilibrium."""

SMALLEST_FRACTION = 1 / 20
"""Fraction of the load that is still halved once when the load is stepped up."""

FIRST_RESHAPED, FIRST_MOVED = 1 / 2, 1 / 8
"""Fractions of the way in the first step: where nodes move from one design to another, and where obstacles or a plate
that is held move."""

SMALLEST_MOVE = 1e-4
"""`SMALLEST_FRACTION` where obstacles move, which may have to be less than the gap to what they press on."""


@dataclass(frozen=True)
class Equilibrium:
    """A converged state.

    Attributes
    ----------
    state : State
        The unknowns, from which the next solve starts.
    u : (N, 3) displacements, mm; of the part of the body that is solved.
    plate : (6,) translation (mm) and rotation vector (rad) of the plate; of a free tip its mean displacement.
    volumes : dict of chamber volumes, mm³, of the whole body.
    reaction : (6,) what the whole actuator exerts on the blocks of its plate, N and N·mm; zero for free components.
    stretches : dict of largest principal stretches at the quadrature points of each region.
    residual : residual norm over applied forces.
    negative_pivots : of the tangent at this state; 0 means stable; for part of a body, against symmetric motions only.
    factorisations, solves : the cost.
    buckled : dict of pressures in MPa, by chamber, at which stability was lost on the way to this state; else empty.
    enclosed : dict of the pressures found in MPa, by chamber, where they were unknown.
    """

    state: State
    u: np.ndarray
    plate: np.ndarray
    volumes: dict[str, float]
    reaction: np.ndarray
    stretches: dict[str, float]
    residual: float
    negative_pivots: int
    factorisations: int
    solves: int
    buckled: Mapping[str, float] = field(default_factory=dict)
    enclosed: Mapping[str, float] = field(default_factory=dict)

    @property
    def stable(self) -> bool:
        return self.negative_pivots == 0

    @property
    def max_stretch(self) -> float:
        """Largest principal stretch at the quadrature points."""
        return max(self.stretches.values())


@dataclass(frozen=True)
class NoEquilibrium:
    """No equilibrium was found.

    Attributes
    ----------
    reason : a sentence.
    fraction : fraction of the load up to which equilibria were found (0 without load stepping).
    last : the last equilibrium on the way, if any.
    buckled : {chamber: MPa}
        The pressures at which stability was lost, where a stable state was followed beyond it; else empty.
    limit : {chamber: MPa}
        The last pressures to which states could be followed, where that is known; else empty.
    """

    reason: str
    fraction: float
    last: Equilibrium | None
    buckled: Mapping[str, float] = field(default_factory=dict)
    limit: Mapping[str, float] = field(default_factory=dict)


def configure(
    model: Model,
    X: np.ndarray,
    loads: Loads,
    blocked: np.ndarray | None = None,
    enclosed: Enclosed | None = None,
) -> Configuration:
    """Make a configuration for the solver: nodes X (N, 3) mm, loads, and blocked plate components (6,) bool.

    Parameters
    ----------
    model : Model
    X : (N, 3) array
        Undeformed positions of the nodes, mm.
    loads : Loads
    blocked : (6,) bool, optional
        Components of the plate that are held; none by default.
    enclosed : Enclosed, optional
        The chambers whose pressure is unknown; their pressures in the loads are not used.
    """
    held = np.zeros(6, bool) if blocked is None else np.asarray(blocked, bool)
    return Configuration(model, np.asarray(X, dtype=float), loads, held, enclosed)


def settled(at: Configuration, equilibrium: Equilibrium) -> Configuration:
    """The configuration with the pressures that were found, where they were unknown."""
    if at.enclosed is None:
        return at
    pressure = np.array([equilibrium.enclosed[name] for name in at.enclosed.chambers])
    return with_pressures(at, at.enclosed, pressure)


def build_loads(
    model: Model,
    pressures: dict[str, float],
    acceleration: np.ndarray | None = None,
    spring: np.ndarray | None = None,
    wrench: np.ndarray | None = None,
    moves: Mapping[str, Sequence[float]] = MappingProxyType({}),
    reinforcement: np.ndarray | None = None,
    held: np.ndarray | None = None,
) -> Loads:
    """Loads on a model: pressures in MPa by chamber, acceleration (3,) mm/s², springs and wrench (6,) in N, mm, rad.

    They are given for the whole body. A part gets its share; they must be symmetric (see `part.part_of`).
    `moves` are the displacements (3,) in mm of obstacles by their names, or their poses (6,) with a rotation vector in
    rad; the others are in their places. `reinforcement` are the changes (R, 2) of what lies on surfaces.

    Parameters
    ----------
    model : Model
    pressures : {chamber: MPa}
    acceleration : (3,) array, optional
        mm/s².
    spring, wrench : (6,) array, optional
        Of the plate, N/mm and N·mm/rad; N and N·mm.
    moves : {obstacle: (3,) or (6,)}
        Displacements in mm, or poses with a rotation vector in rad.
    reinforcement : (R, 2) array, optional
        See `Loads.reinforcement`.
    held : (6,) array, optional
        Values at which blocked components of the plate are held, mm and rad.
    """
    obstacles = () if model.contact is None else model.contact.obstacles
    zero = np.zeros(6)
    share = 1.0 / model.copies
    return Loads(
        pressure=np.asarray([pressures.get(name, 0.0) for name in model.chambers], dtype=float),
        acceleration=np.asarray(zero[:3] if acceleration is None else acceleration, dtype=float),
        spring=share * np.asarray(zero if spring is None else spring, dtype=float),
        wrench=share * np.asarray(zero if wrench is None else wrench, dtype=float),
        shift=np.array([pose_of(moves.get(name, ())) for name in obstacles]).reshape(-1, 6),
        reinforcement=np.zeros((len(model.reinforcements), 2)) if reinforcement is None else reinforcement,
        held=np.asarray(zero if held is None else held, dtype=float),
    )


def rest(model: Model) -> State:
    """The undeformed state."""
    return model.state(np.zeros(model.size))


def solve(
    at: Configuration,
    tangent: Tangent,
    start: State | Guess | None = None,
    tolerance: float = TOLERANCE,
    since: tuple[Configuration, State] | None = None,
    most: float = math.inf,
    roughest: float = math.inf,
) -> Equilibrium | NoEquilibrium:
    """Find the equilibrium of a configuration.

    Newton's method goes to the full load at once from `start`. Without a start, or if that fails, the load is raised in
    adaptive steps: from `since`, another configuration of the same model with its equilibrium, or else from rest,
    weights and plate loads first, then pressures. Where the nodes of `since` are in other places, they are moved in the
    same steps. A state has converged when its residual is `tolerance` times the norm of the applied forces. The search
    ends after `most` factorisations, and does not begin where the start's own residual is more than `roughest` κ/μ
    times the applied forces: from so far away it would hardly lead anywhere.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        With the last factorisation, if there is one.
    start : State or Guess, optional
        Where the search begins.
    tolerance : float
        Residual over the applied force at which it ends.
    since : (Configuration, State), optional
        An equilibrium from which the load may be raised.
    most : float
        Most factorisations.
    roughest : float
        Largest residual of the start, over κ/μ times the applied force.
    """
    before = tangent.factorisations, tangent.solves
    tangent.max_factorisations = tangent.factorisations + most
    try:
        # Starts may be anywhere: what is not finite is seen by its value.
        with np.errstate(over="ignore", invalid="ignore"):
            found = _searched(at, tangent, start, tolerance, since, before, roughest)
        if isinstance(found, Equilibrium) and (loose := unheld(at, tangent, found.state)) is not None:
            return NoEquilibrium(loose, 1.0, None)
        return found
    except SingularMatrix:
        return NoEquilibrium("the tangent is singular", 0.0, None)
    except Unheld as error:
        return NoEquilibrium(str(error), 0.0, None)
    except TooCostly:
        return NoEquilibrium(f"no equilibrium found in {most:g} factorisations", 0.0, None)
    finally:
        tangent.max_factorisations = math.inf


def _searched(
    at: Configuration, tangent: Tangent, start: State | Guess | None, tolerance: float, since, before, roughest: float
) -> Equilibrium | NoEquilibrium:
    """The search of `solve`."""
    if at.enclosed is not None:
        return _filled(at, tangent, start, tolerance, since, before)
    if start is not None:
        with suppress(Unheld):
            begin = _begin(at, start)
            if roughest < math.inf and not relative_residual(at, begin.state) <= roughest * bulk_over_shear(at):
                return NoEquilibrium("there is no equilibrium near the predicted state", 0.0, None)
            found = _search(at, tangent, begin, tolerance)
            if not isinstance(found, str):
                return read_off(at, tangent, *found, before)
    if since is not None:
        begin, state = since
        return _raise(at, begin, state, tangent, before, tolerance)
    return _step_up(at, tangent, before, tolerance)


def _filled(at: Configuration, tangent: Tangent, start: State | Guess | None, tolerance: float, since, before):
    """The search of `solve` where pressures are unknown."""
    assert at.enclosed is not None
    found: Filled | str = ""
    if start is not None:
        state = start.state if isinstance(start, Guess) else start
        begin = with_pressures(at, at.enclosed, nearest_pressure(at, state))
        found = fill(begin, tangent, begin, state, tolerance, 1.0)
    if isinstance(found, str) and since is not None:
        begin, state = since
        found = fill(at, tangent, begin, state, tolerance)
    if isinstance(found, str):
        begin = replace(unloaded(at), enclosed=at.enclosed.part(0.0))
        found = fill(at, tangent, begin, rest(at.model), tolerance)
    if isinstance(found, str):
        return NoEquilibrium(found, 0.0, None)
    pressures = pressure_of(found, at.enclosed.rows(at.model))
    equilibrium = read_off(found.at, tangent, found.state, found.residual, before)
    return replace(equilibrium, enclosed=dict(zip(at.enclosed.chambers, map(float, pressures), strict=True)))


def find_near(at: Configuration, tangent: Tangent, start: State | Guess, tolerance: float) -> tuple[State, float] | str:
    """A stable state near `start` with its relative residual, or the reason why none was found.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        Factorised on the way.
    start : State or Guess
        Where the search begins.
    tolerance : float
        Relative residual of an equilibrium.
    """
    return _search(at, tangent, _begin(at, start), tolerance)


def _begin(at: Configuration, start: State | Guess) -> Guess:
    """Where a search begins: free obstacles are let down, and displacements fitted to the gradients that are known."""
    guess = start if isinstance(start, Guess) else Guess(start)
    begin, F = landed(at, guess.state), guess.gradients
    # What is fitted might go through a surface.
    if F is None or at.model.contact is not None:
        return Guess(begin, metrics=guess.metrics)
    return Guess(fitted(at, begin, F) if relative_residual(at, begin) > ROUGH else begin, F, guess.metrics)


def _search(at: Configuration, tangent: Tangent, begin: Guess, tolerance: float) -> tuple[State, float] | str:
    """`find_near`, from where a search begins."""
    if at.model.mixed:
        return find_stable(at, tangent, begin, tolerance)
    if at.model.reinforcements:
        found = find_stable(at, tangent, begin, tolerance)
        if not isinstance(found, str) and tangent.negative_pivots == 0:
            return found
    ratios = None if begin.gradients is None else volume_ratio(begin.gradients)
    return minimise(at, tangent, begin.state, tolerance, ratios)


def _step_up(at: Configuration, tangent: Tangent, before, tolerance: float) -> Equilibrium | NoEquilibrium:
    """Raise the load from rest: weights and plate loads first, under which the body sags, then the pressures.

    Where it does not bear the first, all together.
    """
    loads, begin, state = at.loads, unloaded(at), rest(at.model)
    if np.any(loads.acceleration) or np.any(loads.wrench):
        sagging = replace(at, loads=unloaded(at).loads._replace(acceleration=loads.acceleration, wrench=loads.wrench))
        # Relative to the full load: the forces of a small weight may be lost in rounding errors of the residual.
        near = tolerance * max(1.0, applied_force(at, state) / applied_force(sagging, state))
        sag = _raise(sagging, begin, state, tangent, before, near)
        if not (np.any(loads.pressure) or np.any(loads.shift) or np.any(loads.held)):
            return sag
        # What does not bear its loads without its pressure may bear both together.
        if isinstance(sag, Equilibrium):
            begin, state = sagging, sag.state
    return _raise(at, begin, state, tangent, before, tolerance)


def _raise(
    whole: Configuration, begin: Configuration, state: State, tangent: Tangent, before, tolerance: float
) -> Equilibrium | NoEquilibrium:
    """Raise the load from an equilibrium of `begin` to the loads of `whole`, in adaptive steps; nodes may move too.

    Every step begins where the state before it is predicted to lead.
    """
    at, ahead, residual, reached, reason = begin, None, 0.0, 0.0, ""
    reshaped = not np.array_equal(whole.X, begin.X)
    still = (np.array_equal(getattr(whole.loads, part), getattr(begin.loads, part)) for part in ("shift", "held"))
    moving = reshaped or not all(still)
    step = FIRST_RESHAPED if reshaped else FIRST_MOVED if moving else 1.0
    smallest = SMALLEST_MOVE if moving else SMALLEST_FRACTION
    while reached < 1.0:
        fraction = min(1.0, reached + step)
        # At the full load use the caller's own configuration, so that its factorisation is recognised.
        part = part_way(begin, whole, fraction)
        ahead = predict_change(at, tangent, state, whole) if ahead is None else ahead
        start = between(state, ahead, (fraction - reached) / (1.0 - reached))
        if moving and whole.model.contact is not None and (free := free_way(at, state, part, start)) < 1.0:
            # What an obstacle presses on goes along with it.
            fraction, start = reached + free * (fraction - reached), between(state, start, free)
            part = part_way(begin, whole, fraction)
        start = without_meeting(part, state, start)
        with doing(_where(part, fraction)):
            found = find_near(part, tangent, guess_after(at, state, part, start), tolerance)
            if isinstance(found, str) and (step < smallest or (whole.model.contact is not None and not moving)):
                # Near a limit load, and where surfaces come near, a prediction may lead farther away.
                found = find_near(part, tangent, state, tolerance)
        if isinstance(found, str):
            reason, step = found, min(step, fraction - reached) / 2
            if step < smallest / 2:
                nearest = None if at is begin else read_off(at, tangent, state, 0.0, before)
                return NoEquilibrium(f"no equilibrium found {_where(part, fraction)}: {reason}", reached, nearest)
            continue
        (state, residual), reached, at, ahead = found, fraction, part, None
        step *= 1.5
    return read_off(at, tangent, state, residual, before)


def part_way(begin: Configuration, whole: Configuration, fraction: float) -> Configuration:
    """The configuration at a fraction of the way from one to another; at its end the other one itself."""
    if fraction == 1.0:
        return whole
    X = whole.X if whole.X is begin.X else between(begin.X, whole.X, fraction)
    return replace(whole, X=X, loads=between(begin.loads, whole.loads, fraction))


def without_meeting(at: Configuration, state: State, end: State) -> State:
    """The state on the way from one to another before surfaces meet; the other one if they do not."""
    model = at.model
    if model.contact is None or end is state:
        return end
    vector = model.vector(state)
    change = model.vector(end) - vector
    return model.state(vector + free_share(at, vector, change) * change)


def between(one, other, part: float):
    """Interpolate or extrapolate linearly between two loads, or two states."""
    return jax.tree.map(lambda a, b: a + part * (b - a), one, other)


def _where(at: Configuration, fraction: float) -> str:
    """The loads near which no equilibrium was found, in words."""
    pressures = at.loads.pressure
    if np.any(at.loads.shift):
        return f"at {fraction:.2g} of the way of the obstacles"
    if np.any(at.loads.held):
        return f"at {fraction:.2g} of the way of the plate"
    if not np.any(pressures):
        return f"at {fraction:.2g} of the weight and the plate's loads"
    return f"near {in_words(dict(zip(at.model.chambers, pressures, strict=True)))}"


def in_words(pressures: Mapping[str, float]) -> str:
    """Pressures in MPa as text, with the names of the chambers where there are several."""
    parts = {name: f"{1e3 * float(pressure):.4g} kPa" for name, pressure in pressures.items()}
    return ", ".join(f"{name} = {part}" if len(parts) > 1 else part for name, part in parts.items())


def read_off(at: Configuration, tangent: Tangent, state: State, residual: float, before) -> Equilibrium:
    """Evaluate a converged state; the tangent is factorised there or nearby, for stability and for the adjoint.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    state : State
        Converged.
    tangent : Tangent
        With the last factorisation, if there is one.
    residual : float
        Relative to the applied force.
    before : (int, int)
        Factorisations and solutions before the search.
    """
    model = at.model
    negative = negative_motions(at, tangent, state)
    u = displacement(model.tip, at.X, state)
    _, forces = evaluate(at, state)
    plate = state.plate if model.plate else np.r_[tip_centre(model.tip, at.X, u), np.zeros(3)]
    volumes = model.copies * volumes_of(model, at.X, u, at.loads.shift)
    return Equilibrium(
        state=state,
        u=u,
        plate=plate,
        volumes=dict(zip(model.chambers, map(float, volumes), strict=True)),
        reaction=np.where(at.blocked & ~model.odd, -model.copies * forces[-6:], 0.0),
        stretches=largest_stretches(at, state),
        residual=residual,
        negative_pivots=negative,
        factorisations=tangent.factorisations - before[0],
        solves=tangent.solves - before[1],
    )
