"""Equilibria of a body, and its configurations: nodes, loads, and blocked motions of the plate."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType

import numpy as np

from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.enclosed import Enclosed
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.assembly.tip import tip_centre
from pneumorph.mechanics.assembly.volumes import volumes_of
from pneumorph.mechanics.contact.pose import pose_of
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mechanics.solve.balance import evaluate, largest_stretches
from pneumorph.mechanics.solve.border import negative_motions, with_pressures

TOLERANCE = 1e-9
"""Relative residual, over the norm of the applied forces, at which a state counts as an equilibrium."""


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
    way : the stable states from which and through which it was reached, up to a loss of stability; empty where no
        state between was looked for.
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
    way: tuple[tuple[Configuration, State], ...] = field(default=(), repr=False)

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
    way : see `Equilibrium`.
    """

    reason: str
    fraction: float
    last: Equilibrium | None
    buckled: Mapping[str, float] = field(default_factory=dict)
    limit: Mapping[str, float] = field(default_factory=dict)
    way: tuple[tuple[Configuration, State], ...] = field(default=(), repr=False)


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


def in_words(pressures: Mapping[str, float]) -> str:
    """Pressures in MPa as text, with the names of the chambers where there are several."""
    parts = {name: f"{1e3 * float(pressure):.4g} kPa" for name, pressure in pressures.items()}
    return ", ".join(f"{name} = {part}" if len(parts) > 1 else part for name, part in parts.items())


def exerted_on_blocks(at: Configuration, state: State) -> np.ndarray:
    """What the whole actuator exerts on the blocks of its plate (6,), N and N·mm; zero for free components."""
    _, forces = evaluate(at, state)
    return np.where(at.blocked & ~at.model.odd, -at.model.copies * forces[-6:], 0.0)


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
    plate = state.plate if model.plate else np.r_[tip_centre(model.tip, at.X, u), np.zeros(3)]
    volumes = model.copies * volumes_of(model, at.X, u, at.loads.shift)
    return Equilibrium(
        state=state,
        u=u,
        plate=plate,
        volumes=dict(zip(model.chambers, map(float, volumes), strict=True)),
        reaction=exerted_on_blocks(at, state),
        stretches=largest_stretches(at, state),
        residual=residual,
        negative_pivots=negative,
        factorisations=tangent.factorisations - before[0],
        solves=tangent.solves - before[1],
    )
