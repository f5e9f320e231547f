"""Sweeps: a sequence of loads on one mesh, solved one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

import jax
import numpy as np

from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mechanics.solve.equilibrium import Equilibrium, NoEquilibrium, solve
from pneumorph.mechanics.solve.path import diagnose


def sweep(path: Iterable[Configuration], tangent: Tangent) -> Iterator[Equilibrium | NoEquilibrium]:
    """The equilibrium of every configuration of a sweep, each solved from the one before.

    All configurations have the same nodes and differ in their loads. Steps that are too long are subdivided. The sweep
    ends where there is no equilibrium: that `NoEquilibrium` names the limit found by path following, and the rest is
    not tried.

    Parameters
    ----------
    path : configurations, in order.
    tangent : the linear solver of their model.
    """
    walked: list[tuple[Configuration, State]] = []
    stopped: NoEquilibrium | None = None
    for at in path:
        if stopped is not None:
            yield NoEquilibrium(f"not tried, the sweep stopped before it: {stopped.reason}", 0.0, None)
            continue
        found = solve(at, tangent, secant_start(walked, at), since=walked[-1] if walked else None)
        if isinstance(found, NoEquilibrium):
            found = diagnose(at, tangent, found)
        if isinstance(found, NoEquilibrium):
            stopped = found
        else:
            walked = [*walked[-1:], (at, found.state)]
        yield found


def secant_start(walked: list[tuple[Configuration, State]], at: Configuration) -> State | None:
    """Where surfaces may touch: the last state, extrapolated along the secant through the last two.

    None without any, and without contact, where `solve` itself begins from a prediction that is better.
    """
    if not walked or at.model.contact is None:
        return None
    if len(walked) < 2:
        return walked[-1][1]
    (before, earlier), (now, state) = walked
    done, ahead = _change(before.loads, now.loads), _change(now.loads, at.loads)
    length = float(np.sum(done * done))
    if length == 0.0:
        return state
    ratio = float(np.sum(done * ahead)) / length
    return jax.tree.map(lambda new, old: new + ratio * (new - old), state, earlier)


def _change(one: Loads, other: Loads) -> np.ndarray:
    """How pressures and the displacements of obstacles change; where all change in proportion units do not matter."""
    parts = [(one.pressure, other.pressure), (one.shift, other.shift)]
    return np.concatenate([np.ravel(np.asarray(b) - np.asarray(a)) for a, b in parts])
