"""A problem with a further chamber: a sphere at some place, with its images under the symmetry of the body."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.problem.fewer import table_of
from pneumorph.problem.solid import letters
from pneumorph.problem.whole import Problem
from pneumorph.symmetry.images import placed
from pneumorph.symmetry.operations import operations


def with_further_chamber(
    problem: Problem,
    place: Sequence[float],
    radius: float,
    pressures: Mapping[str, float] | Callable[[np.ndarray], Mapping[str, float]],
    bounds: tuple[float, float],
) -> Problem:
    """The problem with a spherical chamber more, and one in every place to which the symmetry of the body maps it.

    Images that would meet are one chamber between them.

    Parameters
    ----------
    problem : of a body of tubes about a straight axis.
    place : (3,) mm
        Centre of the sphere.
    radius : float
        mm.
    pressures : {task: MPa}, or a function of a place (3,) in mm
        In it and its images, which the function may tell apart; where a task designs its other pressures, at the start.
    bounds : of pressures that are designed, MPa.

    Raises
    ------
    ProblemError
        If there is no room for it at the start, or the body is none of tubes about a straight axis.

    Examples
    --------
    >>> import pneumorph as pm
    >>> problem = pm.load("examples/arm_parallel.toml")
    >>> pressures = {task.name: 0.02 for task in problem.task}
    >>> further = pm.with_further_chamber(problem, (0.0, 0.0, 40.0), 2.0, pressures, (0.0, 0.06))
    >>> [chamber.name for chamber in further.body.chamber]
    ['A', 'B', 'C', 'D', 'E']
    """
    if problem.solid is not None or problem.tubes.bent is not None:
        raise ProblemError(
            "body: further chambers are for tubes about a straight axis; change the CAD file or the axis"
        )
    x, y, z = place
    length, wall = problem.tubes.length, problem.limits.wall
    sphere = np.array([x, y, z - radius, z + radius, radius])
    group = operations(problem.body.symmetry)
    centres = _centres(sphere, group, length, 2.0 * radius + wall)
    table, taken = table_of(problem), {chamber.name for chamber in problem.body.chamber}
    free = [name for name in map(letters, range(len(taken) + len(centres))) if name not in taken]
    for name, (x, y, start, end, _) in zip(free, centres.tolist(), strict=False):
        table["body"]["chamber"].append(
            {
                "name": name,
                "radius": f"{radius:.6g} mm",
                "center": [f"{x:.9g} mm", f"{y:.9g} mm"],
                "span": [f"{start:.9g} mm", f"{end:.9g} mm"],
                "ends": "pole",
            }
        )
        own = pressures(np.array([x, y, 0.5 * (start + end)])) if callable(pressures) else pressures
        for task in table["task"]:
            if "pressure" not in task:
                continue
            given = f"{1e3 * min(max(own[task['name']], bounds[0]), bounds[1]):.6g} kPa"
            low, high = (f"{1e3 * bound:.6g} kPa" for bound in bounds)
            designed = any(isinstance(value, dict) and "start" in value for value in task["pressure"].values())
            task["pressure"][name] = {"start": given, "min": low, "max": high} if designed else given
    return Problem.model_validate(table)


def _centres(own: np.ndarray, group: Sequence[np.ndarray], length: float, apart: float) -> np.ndarray:
    """Places (n, 5) of a sphere and its images, where those nearer to each other than `apart` are one between them."""

    def images(of: np.ndarray) -> np.ndarray:
        return np.array([placed(of, matrix, length) for matrix in group])

    def centre(of: np.ndarray) -> np.ndarray:
        return np.column_stack([of[..., :2], of[..., 2:4].mean(axis=-1)])

    found = images(own)
    near = np.linalg.norm(centre(found) - centre(found[:1]), axis=1) < apart
    found = images(found[near].mean(axis=0))
    kept: list[np.ndarray] = []
    for each in found:
        if all(np.abs(each - other).max() > 1e-6 for other in kept):
            kept.append(each)
    return np.array(kept)
