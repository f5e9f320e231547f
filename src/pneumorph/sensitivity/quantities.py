"""What bodies are measured by (`problem/quantities.py`) at an equilibrium, and its derivatives: an adjoint each."""

from __future__ import annotations

from collections.abc import Sequence

import jax
import numpy as np

from pneumorph.mechanics import Configuration, State, Tangent, rest
from pneumorph.mechanics.assembly.displacement import Displacement
from pneumorph.mechanics.assembly.tangent import EXACT
from pneumorph.mechanics.assembly.volumes import volumes_of
from pneumorph.objective import HeldForce, measure_features
from pneumorph.objective.features import NO_SLABS, element_sums, sums_pulled_back
from pneumorph.problem.components import MOTIONS, PUSH, PUSHES
from pneumorph.problem.quantities import FILLED, VOLUME_OF
from pneumorph.sensitivity.adjoint import with_border
from pneumorph.sensitivity.held import held_force, held_force_value
from pneumorph.sensitivity.motion import MotionSlopes, adjoints_of, slopes_by


def quantities_of(at: Configuration) -> tuple[str, ...]:
    """The motions of the tip, what it pushes with where it is held, and the volumes of all chambers, by their names."""
    held = zip(PUSHES, at.blocked & ~at.model.odd, strict=True)
    pushes = [name for name, blocked in held if blocked]
    return (*MOTIONS, *pushes, *(VOLUME_OF + chamber for chamber in at.model.chambers))


def quantities_at(at: Configuration, state: State, names: Sequence[str]) -> np.ndarray:
    """Quantities (k,) at an equilibrium, of the whole body: mm and rad, N and N·mm, mm³.

    Parameters
    ----------
    at, state : the equilibrium.
    names : of the quantities, see `problem/quantities.py`.
    """
    moved = measure_features(at.model, at.X, state)
    motions = dict(zip(MOTIONS, np.concatenate([moved.translation, moved.rotation]), strict=True))
    return np.array([motions[name] if name in motions else _value(at, state, name) for name in names], float)


def quantity_slopes(at: Configuration, tangent: Tangent, state: State, names: Sequence[str]) -> MotionSlopes:
    """Quantities with their derivatives, at an equilibrium near whose state the tangent was factorised.

    Parameters
    ----------
    at, tangent, state : the equilibrium.
    names : of the quantities.
    """
    motions = adjoints_of(at, tangent, state) if set(names) & set(MOTIONS) else None
    rows = []
    for name in names:
        if name in MOTIONS:
            assert motions is not None
            rows.append(tuple(part[MOTIONS.index(name)] for part in motions))
        elif name in PUSHES:
            value, adjoint, more = held_force(at, tangent, state, HeldForce(name.removeprefix(PUSH), 1.0), EXACT)
            rows.append((value, np.zeros_like(at.X), adjoint, more))
        else:
            rows.append(_volume(at, tangent, state, name))
    values, direct, adjoints, more = (np.array(part) for part in zip(*rows, strict=True))
    return slopes_by(at, state, values, direct, adjoints, more)


def _value(at: Configuration, state: State, name: str) -> float:
    """A force of the tip, or a volume."""
    if name in PUSHES:
        return held_force_value(at, state, HeldForce(name.removeprefix(PUSH), 1.0))
    return _volume_at(at, state, name) - (_volume_at(at, rest(at.model), name) if name.startswith(FILLED) else 0.0)


def _number(at: Configuration, name: str) -> int:
    return at.model.chambers.index(name.removeprefix(VOLUME_OF).removeprefix(FILLED))


def _volume_at(at: Configuration, state: State, name: str) -> float:
    u, model = Displacement(at.model.tip, at.X, state).u, at.model
    return model.copies * float(volumes_of(model, at.X, u, np.asarray(at.loads.shift))[_number(at, name)])


def _volume(
    at: Configuration, tangent: Tangent, state: State, name: str
) -> tuple[float, np.ndarray, np.ndarray, np.ndarray]:
    """A volume, its direct derivatives, its adjoint, and what unknown pressures add."""
    direct, seed = _by_volume(at, state, name)
    solved = tangent.solve_at(at, state, np.where(at.constrained, 0.0, at.model.vector(seed)))
    (solved,), (more,) = with_border(at, tangent, state, solved[None])
    if name.startswith(FILLED):
        # At rest nodes have no displacements, also where they are moved.
        direct = direct - _by_volume(at, rest(at.model), name)[0]
    return _value(at, state, name), direct, solved, more


def _by_volume(at: Configuration, state: State, name: str) -> tuple[np.ndarray, State]:
    """Direct derivatives of the volume of a chamber by nodes (N, 3) and unknowns."""
    model, shift = at.model, np.asarray(at.loads.shift)
    one = jax.tree.map(lambda part: np.zeros((1, *np.shape(part))), element_sums(model, at.X, state, NO_SLABS, shift))
    one.volume[0, _number(at, name)] = float(model.copies)
    (by_X,), (by_state,) = sums_pulled_back(model, at.X, state, NO_SLABS, one, shift)
    return by_X, by_state
