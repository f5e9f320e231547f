"""The workspace of several tasks: how far, over which area or through which volume the tip goes between their states.

It is the convex hull of the places of the tip. Its size V has the derivatives ∂V/∂c by the places c at its corners, and
none by those within: the gradient is Σ ∂V/∂c · dc/dΦ over the tasks, by one adjoint for each axis and task.
"""

from __future__ import annotations

from collections.abc import Mapping

import jax.numpy as jnp
import numpy as np
from scipy.spatial import ConvexHull, QhullError

from pneumorph.errors import ComputationError
from pneumorph.geometry import DesignSpace
from pneumorph.mechanics import Configuration, Equilibrium, Tangent
from pneumorph.mesh import Morph
from pneumorph.objective import Objective, Workspace
from pneumorph.objective.objective import squares
from pneumorph.sensitivity import residual_jacobian

_TIP = squares([(1.0, lambda f: jnp.asarray(f.translation))], {})


def axes_of(objectives: Mapping[str, Objective]) -> dict[str, tuple[int, ...]]:
    """The tasks that make up a workspace, and the axes along which it is measured."""
    made = {name: each.instead for name, each in objectives.items()}
    return {name: each.axes for name, each in made.items() if isinstance(each, Workspace)}


def workspace_size(
    objectives: Mapping[str, Objective],
    configurations: Mapping[str, Configuration],
    equilibria: Mapping[str, Equilibrium],
) -> float:
    """The length (mm), area (mm²) or volume (mm³) of the workspace.

    Parameters
    ----------
    objectives, configurations, equilibria : by task.
    """
    return _hull(_places(objectives, configurations, equilibria))[0]


def workspace_slope(
    space: DesignSpace,
    morph: Morph,
    objectives: Mapping[str, Objective],
    configurations: Mapping[str, Configuration],
    equilibria: Mapping[str, Equilibrium],
    tangents: Mapping[str, Tangent],
    accuracy: float,
) -> np.ndarray:
    """Derivatives (n,) of the same by Φ.

    Parameters
    ----------
    space, morph : the design space, and the mesh that follows it.
    objectives, configurations, equilibria, tangents : by task.
    accuracy : of the adjoints, see `Tangent.solve_at`.
    """
    total = np.zeros(space.n)
    _, by_place = _hull(_places(objectives, configurations, equilibria))
    for (name, axes), by in zip(axes_of(objectives).items(), by_place, strict=True):
        if not by.any():
            continue
        at = configurations[name]
        found = residual_jacobian(at, tangents[name], equilibria[name], _TIP, accuracy)
        weights = np.zeros(3)
        weights[list(axes)] = by
        pressure = dict(zip(at.model.chambers, (weights @ found.pressure).tolist(), strict=True))
        by_X, by_data = (np.tensordot(weights, part, axes=1) for part in (found.X, found.reinforcement))
        total += space.pullback(morph.pullback(by_X), {name: pressure}, by_data)
    return total


def _places(
    objectives: Mapping[str, Objective],
    configurations: Mapping[str, Configuration],
    equilibria: Mapping[str, Equilibrium],
) -> np.ndarray:
    """Where the tip goes in the tasks, along their axes (tasks, axes), mm."""
    places = []
    for name, axes in axes_of(objectives).items():
        at = configurations[name]
        moved = _TIP.features(at.model, at.X, equilibria[name].state).translation
        places.append(np.asarray(moved)[list(axes)])
    return np.array(places)


def _hull(places: np.ndarray) -> tuple[float, np.ndarray]:
    """The size of the convex hull of points (k, 1, 2 or 3), and its derivatives by them.

    Raises
    ------
    ComputationError
        If they are in a line or a plane, where the hull has no size.
    """
    by_place = np.zeros_like(places)
    if places.shape[1] == 1:
        first, last = int(places.argmin()), int(places.argmax())
        by_place[[last, first], 0] = 1.0, -1.0
        return float(np.ptp(places)), by_place
    try:
        hull = ConvexHull(places)
    except QhullError:
        where = "a line" if places.shape[1] == 2 else "a plane"
        raise ComputationError(
            f"the tips of the tasks of the workspace are in {where} at the start; give pressures that move the tip "
            "along all its axes, or fewer axes"
        ) from None
    # A side that moves outwards by a motion of its corners adds its size times their mean motion.
    for corners, equation in zip(hull.simplices, hull.equations, strict=True):
        sides = places[corners[1:]] - places[corners[0]]
        size = np.sqrt(np.linalg.det(sides @ sides.T)) / (1 if places.shape[1] == 2 else 2)
        by_place[corners] += size / len(corners) * equation[:-1]
    return float(hull.volume), by_place
