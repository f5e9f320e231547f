"""The deviation of a quantity to second order, where its curvature along a few directions of the causes is known.

With causes as independent normal variables ε of deviation 1, m = m₀ + gᵀε + ½ εᵀHε has the variance |g|² + ½ tr H².
Along orthogonal unit directions d, two solutions at ±h d have h² ½ dᵀHd = h² b beyond m₀ in the mean, and 2b² of the
variance is due to it. The directions are that of its own gradient and, of a motion, what is left of those of other
motions of the tip: a finger that its core's shift bends to the side becomes shorter both ways, which no first
derivative tells. What other directions and pairs of them add is left out, and motions are quadratic only nearby.
"""

from __future__ import annotations

import numpy as np

from pneumorph.analysis.accuracy import LEVER
from pneumorph.analysis.near import Solved
from pneumorph.analysis.scatter import OneDeviation, castings_along
from pneumorph.problem.components import MOTIONS
from pneumorph.results import Scatter

FURTHER, LARGE = 2, 0.5
"""Most directions of other motions, and the least deviation of what is left of one, relative to that of the motion
itself: others bend the body too little to matter."""

NEAR = 0.5
"""h in the further directions, where a body of which a deviation bends it by 30° is found with few factorisations."""


def second_order(whole: Solved, task: str, scatter: Scatter, number: int, own: OneDeviation) -> float | None:
    """The standard deviation of a quantity to second order; None where a casting has no stable state.

    Parameters
    ----------
    whole : the whole body with its states.
    task : name of the task.
    scatter : its scatter.
    number : of the quantity.
    own : the castings along its own gradient.
    """
    curved = curvatures(whole, task, scatter, number, own)
    if curved is None:
        return None
    return float(np.sqrt(scatter.deviations[number] ** 2 + sum(2.0 * b**2 for _, b in curved)))


def curvatures(
    whole: Solved, task: str, scatter: Scatter, number: int, own: OneDeviation
) -> list[tuple[np.ndarray, float]] | None:
    """Orthogonal unit directions d (n,) of the causes over their tolerances, each with b of a quantity along it.

    Parameters
    ----------
    whole, task, scatter, number, own : see `second_order`.
    """
    directions = [scatter.direction(number), *further_directions(scatter, number)]
    sizes = [1.0, *[NEAR] * (len(directions) - 1)]
    pairs = [own, *(castings_along(whole, task, scatter, number, NEAR * each) for each in directions[1:])]
    found = []
    for direction, size, each in zip(directions, sizes, pairs, strict=True):
        if each.up is None or each.down is None:
            return None
        found.append((direction, ((each.up + each.down) / 2.0 - scatter.values[number]) / size**2))
    return found


def further_directions(scatter: Scatter, number: int) -> list[np.ndarray]:
    """Unit directions (n,) in which other motions scatter most, orthogonal to that of one motion and to each other.

    Their components are changes of the causes over their tolerances. None for forces and volumes, with which motions
    cannot be compared.
    """
    if number >= len(MOTIONS):
        return []
    lever = np.repeat([1.0, LEVER], 3)
    gradients = lever * np.array([cause.tolerance * np.array(cause.by[:6]) for cause in scatter.causes]).reshape(-1, 6)
    least, found = LARGE * np.linalg.norm(gradients[:, number]), list[np.ndarray]()
    direction = scatter.direction(number)
    for _ in range(FURTHER):
        gradients = gradients - np.outer(direction, direction @ gradients)
        sizes = np.linalg.norm(gradients, axis=0)
        largest = int(sizes.argmax())
        if sizes[largest] < least:
            break
        direction = gradients[:, largest] / sizes[largest]
        found.append(direction)
    return found
