"""Sweeps with friction on obstacles: what a step finds depends on the way that the steps before it have gone.

In each step friction is a potential (`contact/friction.py`), whose normal forces and normals are lagged: they are
those of the last solution, and solutions are repeated until the friction that they imply is that which they had.
Anchors are kept during a step. After it those of points that have slipped by more than ε are drawn to ε behind them, so
that what sticks does not creep, and those of points that do not touch are where the points are.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import replace

import numpy as np

from pneumorph.mechanics.assembly.build import with_more
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.model import Model
from pneumorph.mechanics.assembly.potential import poses
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.contact.contact import Contact
from pneumorph.mechanics.contact.friction import Friction, Grip
from pneumorph.mechanics.contact.obstacle import Obstacle
from pneumorph.mechanics.contact.samples import sample_places
from pneumorph.mechanics.elements.energy import Term
from pneumorph.mechanics.elements.kinematics import State
from pneumorph.mechanics.solve.equilibrium import Equilibrium, NoEquilibrium, rest
from pneumorph.mechanics.solve.search import solve
from pneumorph.mechanics.solve.sweep import secant_start

REACH = 1 / 20
"""ε as a fraction of the activation distance."""

LAGGED, MOST_LAGS = 1e-3, 30
"""Change of friction, relative to the normal forces, at which lagging has converged; and most solutions in a step."""

Grips = dict[str, Grip]
Found = Equilibrium | NoEquilibrium


def sweep_with_friction(
    path: Iterable[Configuration], tangent: Tangent, coefficient: float
) -> Iterator[tuple[Configuration, Found]]:
    """The equilibrium of every configuration of a sweep, each solved from the one before; it starts at rest.

    Yields each configuration with the friction that acts there. Parameters are those of `sweep.sweep`, and the
    coefficient of friction.
    """
    walked: list[tuple[Configuration, State]] = []
    grips: Grips | None = None
    stopped: NoEquilibrium | None = None
    for at in path:
        if stopped is not None:
            yield at, NoEquilibrium(f"not tried, the sweep stopped before it: {stopped.reason}", 0.0, None)
            continue
        grips = grips or _at_rest(at)
        here, found, grips = _step(at, tangent, coefficient, grips, walked)
        if isinstance(found, NoEquilibrium):
            stopped = found
        else:
            walked = [*walked[-1:], (here, found.state)]
        yield here, found


def with_friction(model: Model, coefficient: float, grips: Grips) -> Model:
    """The model with the friction of every obstacle."""
    contact, terms = _contact(model), []
    rows = {name: row for row, name in enumerate(contact.free)}
    for number, (name, obstacle) in enumerate(contact.obstacles.items()):
        surface = replace(contact.surface, data=grips[name].data())
        place = number, obstacle.center, rows.get(name, 0), name in rows
        terms.append(Term(surface, Friction(coefficient, _reach(obstacle), *place)))
    return with_more(model, terms, contact.surface)


def _step(
    at: Configuration, tangent: Tangent, coefficient: float, grips: Grips, walked: list[tuple[Configuration, State]]
) -> tuple[Configuration, Found, Grips]:
    """One step: its configuration with friction, what was found, and what the next one begins with."""
    start, since = secant_start(walked, at), walked[-1] if walked else None
    for _ in range(MOST_LAGS):
        here = replace(at, model=with_friction(at.model, coefficient, grips))
        # Where a step must be divided, friction is that of now along all of it.
        found = solve(here, tangent, start, since=since and (replace(since[0], model=here.model), since[1]))
        if isinstance(found, NoEquilibrium):
            return here, found, grips
        again = _lagged(at, found.state, grips)
        settled = _settled(at, found.state, grips, again)
        grips, start, since = again, found.state, (here, found.state)
        if settled:
            return here, found, _drawn(at, found.state, grips)
    reason = f"friction did not settle in {MOST_LAGS} solutions; use smaller steps"
    return at, NoEquilibrium(reason, 0.0, None), grips


def _contact(model: Model) -> Contact:
    assert model.contact is not None
    return model.contact


def _reach(obstacle: Obstacle) -> float:
    return REACH * float(obstacle.activation)


def _sample_points(at: Configuration, state: State) -> Iterator[tuple[str, Obstacle, np.ndarray]]:
    """Every obstacle, with the sample points (F, 7, 3) as it sees them when it is in its place."""
    contact = _contact(at.model)
    places = sample_places(contact.surface, at.X + displacement(at.model.tip, at.X, state))
    views = contact.views(poses(at.model.potential, state, at.loads))
    for (name, obstacle), view in zip(contact.obstacles.items(), views, strict=True):
        yield name, obstacle, view.in_frame(places)


def _at_rest(at: Configuration) -> Grips:
    """No friction, with anchors where the points are at rest, while obstacles are in their places."""
    in_place = replace(at, loads=at.loads._replace(shift=0.0 * np.asarray(at.loads.shift)))
    return {
        name: Grip(np.zeros(places.shape[:2]), places, np.zeros(places.shape))
        for name, _, places in _sample_points(in_place, rest(at.model))
    }


def _lagged(at: Configuration, state: State, grips: Grips) -> Grips:
    """Normal forces and normals at a state, with the same anchors."""
    surface, lagged = _contact(at.model).surface, {}
    for name, obstacle, places in _sample_points(at, state):
        pressures = obstacle.pressures(places)
        acting = np.linalg.norm(pressures, axis=-1)
        normal = pressures / np.maximum(acting, 1e-300)[..., None]
        lagged[name] = Grip(surface.weight[:, None] * surface.data * acting, grips[name].anchor, normal)
    return lagged


def _settled(at: Configuration, state: State, before: Grips, after: Grips) -> bool:
    """Whether friction changes little when normal forces and normals at a state take the place of those before."""
    changed, most = 0.0, 0.0
    for name, obstacle, places in _sample_points(at, state):
        old, new = (each[name].traction(places, _reach(obstacle)) for each in (before, after))
        changed += float(np.linalg.norm(new - old, axis=-1).sum())
        most += float(after[name].force.sum())
    return changed <= LAGGED * most


def _drawn(at: Configuration, state: State, grips: Grips) -> Grips:
    """What the next step begins with."""
    drawn = {}
    for name, obstacle, places in _sample_points(at, state):
        slip = grips[name].slip(places)
        size = np.linalg.norm(slip, axis=-1, keepdims=True)
        beyond = np.maximum(1.0 - _reach(obstacle) / np.maximum(size, 1e-300), 0.0)
        touches = grips[name].force[..., None] > 0.0
        drawn[name] = grips[name]._replace(anchor=np.where(touches, grips[name].anchor + beyond * slip, places))
    return drawn
