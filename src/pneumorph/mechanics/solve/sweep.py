"""Sweeps: a sequence of loads on one mesh, solved one after the other."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import jax
import numpy as np

from pneumorph.mechanics.assembly.linear import SingularMatrix
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mechanics.solve.buckling import follow_stable, through
from pneumorph.mechanics.solve.equilibrium import Equilibrium, NoEquilibrium, settled
from pneumorph.mechanics.solve.path import diagnose
from pneumorph.mechanics.solve.prediction import MOST_BEFORE, predict_change
from pneumorph.mechanics.solve.search import solve

MOST, MOST_FROM_REST = 60, 400
"""Most factorisations of a step before stable states are followed in small ones, and of the first from rest."""

STRAIGHT = 1e-6
"""To which loads of a sweep go on as they did, relative to their change."""


def sweep(
    path: Iterable[Configuration], tangent: Tangent, begin: tuple[Configuration, State] | None = None
) -> Iterator[Equilibrium | NoEquilibrium]:
    """The equilibrium of every configuration of a sweep, each solved from the one before.

    All configurations have the same nodes and differ in their loads. Steps that are too long are subdivided: where
    pressures rise or fall, if a state is not near the one predicted. Where stability is lost, the body relaxes to
    another stable state (`buckling.py`). The sweep ends where there is none: that `NoEquilibrium` names the limit found
    by path following, and the rest is not tried.

    Parameters
    ----------
    path : iterable of Configuration
        In order.
    tangent : Tangent
        The linear solver of their model.
    begin : (Configuration, State), optional
        A stable equilibrium before them, soon after which stability is lost; else the sweep starts at rest.
    """
    walked: list[tuple[Configuration, State]] = [] if begin is None else [begin]
    stable, small, buckled, stopped = True, begin is not None, False, None
    for at in path:
        if stopped is not None:
            yield NoEquilibrium(f"not tried, the sweep stopped before it: {stopped.reason}", 0.0, None)
            continue
        since = walked[-1] if walked else None
        if small and since is not None and _by_pressure(since[0], at):
            # Longer steps might lead to other states, of which a body that has buckled may have many.
            found = follow_stable(*since, at, tangent)
        else:
            found = _next(at, tangent, walked, stable)
        buckled = buckled or bool(found.buckled)
        small = small or buckled
        if at.enclosed is None and isinstance(found, NoEquilibrium) and not buckled:
            found = replace(diagnose(at, tangent, found), way=found.way)
        if isinstance(found, NoEquilibrium):
            stopped = found
        else:
            stable, walked = found.stable, [*walked[-MOST_BEFORE:], (settled(at, found), found.state)]
        yield found


def _next(
    at: Configuration, tangent: Tangent, walked: list[tuple[Configuration, State]], stable: bool
) -> Equilibrium | NoEquilibrium:
    """The equilibrium after those that were `walked`, of which the last is `stable`."""
    since = walked[-1] if walked else _without_pressure(at, tangent)
    checked = at.enclosed is None and stable and since is not None and _by_pressure(since[0], at)
    ahead = _predicted(*since, at, tangent) if checked and since else None
    # Filling goes in steps of its own.
    few = walked and at.enclosed is None
    most = MOST if few else MOST_FROM_REST
    found = solve(at, tangent, secant_start(walked, at), since=since, most=most, earlier=_earlier(walked, at))
    return through(*since, at, tangent, ahead, found) if checked and since else found


def _predicted(begin: Configuration, state: State, at: Configuration, tangent: Tangent) -> State | None:
    """What an equilibrium of `begin` predicts for `at`; None where its tangent is singular."""
    try:
        return predict_change(begin, tangent, state, at)
    except SingularMatrix:
        return None


def _without_pressure(at: Configuration, tangent: Tangent) -> tuple[Configuration, State] | None:
    """The body under its other loads alone, where it has pressures that nothing else goes along with, and is stable."""
    if at.enclosed is not None or np.any(at.loads.shift) or np.any(at.loads.held) or not np.any(at.loads.pressure):
        return None
    begin = replace(at, loads=at.loads._replace(pressure=0.0 * at.loads.pressure))
    found = solve(begin, tangent)
    return (begin, found.state) if isinstance(found, Equilibrium) and found.stable else None


def _by_pressure(one: Configuration, other: Configuration) -> bool:
    """Whether pressures differ, and neither an obstacle nor a plate that is held has moved."""
    same = all(np.array_equal(getattr(one.loads, part), getattr(other.loads, part)) for part in ("shift", "held"))
    return same and not np.array_equal(one.loads.pressure, other.loads.pressure)


def secant_start(walked: list[tuple[Configuration, State]], at: Configuration) -> State | None:
    """Where surfaces may touch: the last state, extrapolated along the secant through the last two.

    None without any, and without contact, where `solve` itself begins from a prediction that is better.
    """
    if not walked or at.model.contact is None or at.enclosed is not None:
        return None
    if len(walked) < 2:
        return walked[-1][1]
    (before, earlier), (now, state) = walked[-2:]
    done, ahead = _change(before.loads, now.loads), _change(now.loads, at.loads)
    length = float(np.sum(done * done))
    if length == 0.0:
        return state
    ratio = float(np.sum(done * ahead)) / length
    return jax.tree.map(lambda new, old: new + ratio * (new - old), state, earlier)


def _earlier(walked: list[tuple[Configuration, State]], at: Configuration) -> list[tuple[State, float]]:
    """The states before the last one from which loads went on the way that they go now, and at which fractions."""
    earlier: list[tuple[State, float]] = []
    for there, state in reversed(walked[:-1]):
        now = walked[-1][0].loads
        done, ahead = _change(there.loads, now), _change(now, at.loads)
        length = float(np.linalg.norm(ahead))
        part = float(np.linalg.norm(done)) / length if length > 0.0 else 0.0
        nearest = -earlier[0][1] if earlier else 0.0
        if part <= nearest or not np.allclose(done, part * ahead, rtol=0.0, atol=STRAIGHT * length):
            break
        earlier.insert(0, (state, -part))
    return earlier


def _change(one: Loads, other: Loads) -> np.ndarray:
    """How pressures, obstacles and what is held change; where all change in proportion units do not matter."""
    parts = [(one.pressure, other.pressure), (one.shift, other.shift), (one.held, other.held)]
    return np.concatenate([np.ravel(np.asarray(b) - np.asarray(a)) for a, b in parts])
