"""Prediction of how an equilibrium changes with nodes, pressures and other loads, to first order or along its path."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace

import jax
import numpy as np

from pneumorph.mechanics.assembly import products
from pneumorph.mechanics.assembly.displacement import displacement
from pneumorph.mechanics.assembly.metrics import metrics_after
from pneumorph.mechanics.assembly.tangent import Configuration, Tangent
from pneumorph.mechanics.elements.kinematics import Guess, State, gradients_after
from pneumorph.mechanics.elements.terms import Loads
from pneumorph.mechanics.solve.balance import apart, free_share, relative_residual, supported

ENOUGH = 1e-2
"""Relative accuracy of a prediction, which is of first order only."""

MOST_BEYOND = 2.0
"""How far beyond a state its path is extrapolated, as a multiple of the way from the one before."""

MOST_BEFORE = 3
"""Most states before it that are used for that: more change little, and polynomials of higher degree magnify errors."""


def predict(at: Configuration, tangent: Tangent, state: State, dX: np.ndarray, loads: Loads) -> Guess:
    """The state after nodes move by dX (N, 3) mm and loads become others: K du = −∂R/∂X dX − ∂R/∂loads dloads.

    K is the tangent at `state` in the configuration `at`; it is factorised again if something else was.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        With the last factorisation, if there is one.
    state : State
        An equilibrium of it.
    dX : (N, 3) array
        Motion of the nodes, mm.
    loads : Loads
        The new ones.
    """
    model, moved = at.model, replace(at, X=at.X + dX)
    predicted, vector = predict_change(at, tangent, state, replace(moved, loads=loads)), at.model.vector(state)
    if apart(moved, vector):
        # Shortened where surfaces would meet on the way, if they do not where the nodes have moved.
        step = model.vector(predicted) - vector
        predicted = model.state(vector + free_share(moved, vector, step) * step)
    return guess_after(at, state, moved, predicted)


def guess_after(at: Configuration, state: State, there: Configuration, predicted: State) -> Guess:
    """A predicted state, with deformation gradients and metrics that turn with the body; nodes may have moved too.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    state : State
        An equilibrium of it.
    there : Configuration
        The one after it.
    predicted : State
        What was predicted there.
    """
    model = at.model
    u, after = (displacement(model.tip, each.X, one) for each, one in ((at, state), (there, predicted)))
    dX, du = there.X - at.X, after - u
    gradients = gradients_after(model.tets.nodes[: model.elements], at.X, u, dX, du)
    return Guess(predicted, gradients, metrics_after(model, at.X, state, dX + du))


def predict_change(at: Configuration, tangent: Tangent, state: State, there: Configuration) -> State:
    """The state after loads and nodes become those of `there`, to first order. Surfaces may meet in it.

    Where the plate is held it moves as asked, and the rest follows: K du = … − K d̂ for a change d̂ of the held unknowns.

    Parameters
    ----------
    at : Configuration
        The model with its nodes and loads.
    tangent : Tangent
        With the last factorisation, if there is one.
    state : State
        An equilibrium of it.
    there : Configuration
        The one after it.
    """
    model, push = at.model, np.zeros(at.model.size)
    change = _difference(there.loads, at.loads)
    if any(map(np.any, change)):
        push -= model.vector(products.load_product(model.potential, at.X, state, at.loads, change))
    if there.X is not at.X:
        push -= model.vector(products.shape_product(model.potential, at.X, state, at.loads, there.X - at.X))
    begin = model.vector(state)
    to = np.where(at.blocked, there.loads.held, begin[-6:])
    if not np.array_equal(to, begin[-6:]):
        moved = jax.tree.map(np.zeros_like, state)._replace(plate=to - begin[-6:])
        push -= model.vector(products.tangent_product(model.potential, at.X, state, at.loads, moved))
        begin[-6:] = to
    return model.state(begin + tangent.solve_at(at, state, supported(at, push), ENOUGH))


def along_path(
    there: Configuration, state: State, ahead: State, earlier: Sequence[tuple[State, float]], to: float
) -> State | None:
    """The next state on a path of equilibria, extrapolated by polynomials through the last ones.

    The polynomial through `state` and k states before it has the slope of the path at `state`, so its degree is k + 1,
    and its error is of order k + 2. Unlike a prediction of first order it does not stretch what turns, so it needs no
    deformation gradients that turn with the body. Of k = 1, 2 and 3 the state with the smallest residual is taken.
    Where a column buckles all of them lead mixed elements astray, so these go on to first order where that leaves a
    smaller residual. (That of plain elements says little before displacements are fitted to gradients.)

    Parameters
    ----------
    there : Configuration
        The one that is sought.
    state, ahead : State
        An equilibrium, and what `predict_change` says of the loads there.
    earlier : sequence of (State, float)
        Equilibria before it on the path, in order, and where they are: shares of the way from `state` to `ahead`,
        negative.
    to : float
        The share where a state is sought.

    Returns
    -------
    State, or None where a prediction of first order serves better: without states before, where the last one is too
    near to say much, and where mixed elements leave the path.
    """
    if not earlier or to > MOST_BEYOND * -earlier[-1][1]:
        return None
    last = earlier[-MOST_BEFORE:]
    counts = range(0 if there.model.mixed else 1, len(last) + 1)
    found = [_polynomial(state, ahead, last[len(last) - count :], to) for count in counts]
    if len(found) == 1:
        return found[0]
    residuals = [relative_residual(there, each) for each in found]
    nearest = int(np.argmin(np.nan_to_num(residuals, nan=np.inf)))
    return found[nearest] if counts[nearest] else None


def _polynomial(state: State, ahead: State, earlier: Sequence[tuple[State, float]], to: float) -> State:
    """The polynomial through `state` and earlier ones, with the slope from `state` to `ahead`, at the share `to`."""
    shares = np.array([share for _, share in earlier])
    # Lagrange's weights, for what states are beside the tangent over the squares of their shares.
    others = [np.delete(shares, number) for number in range(len(shares))]
    weights = [np.prod((to - other) / (own - other)) for own, other in zip(shares, others, strict=True)]

    def at(here: np.ndarray, there: np.ndarray, *before: np.ndarray) -> np.ndarray:
        beside = sum(
            weight * (to / share) ** 2 * (each - here - share * (there - here))
            for weight, share, each in zip(weights, shares, before, strict=True)
        )
        return here + to * (there - here) + beside

    return jax.tree.map(at, state, ahead, *(each for each, _ in earlier))


def _difference(there: Loads, here: Loads) -> Loads:
    return jax.tree.map(lambda new, old: np.asarray(new) - np.asarray(old), there, here)
