"""The fast model of a design on the page of its run: polynomials as numbers, and shapes as the page draws them."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from pneumorph.errors import ProblemError
from pneumorph.geometry import Body
from pneumorph.mesh import TetMesh
from pneumorph.output.packed import MICROMETRE, Steps, in_parts, in_steps
from pneumorph.output.report_shapes import Arrays, moved_obstacles, skin_of_mesh
from pneumorph.problem import Problem
from pneumorph.problem.designed import starting_from
from pneumorph.results import HistoryEntry
from pneumorph.surrogate.file import fingerprint, read_shape
from pneumorph.surrogate.reader import Model, ModelError

NAME = "model.npz"
"""A model of this name in a run directory is on the page."""

MOST_NUMBERS = 500_000
"""Numbers of modes above which surfaces are drawn by the corners of their triangles only."""


def packed_model(
    path: Path, problem: Problem, history: Sequence[HistoryEntry], bodies: Sequence[Body]
) -> tuple[dict[str, Any], Arrays]:
    """What a page is told of the model in a file, and its arrays.

    Parameters
    ----------
    path : Path
    problem : Problem
        Of the run.
    history, bodies : the designs that the page shows.

    Raises
    ------
    ProblemError
        If it is no model, has no shapes, or is not that of a design on the page.
    """
    try:
        model, shape = Model(path), read_shape(path)
    except ModelError as error:
        raise ProblemError(str(error)) from None
    if shape is None:
        raise ProblemError(f"{path}: has no shapes; write it again with pneumorph model")
    if model.loads:
        raise ProblemError(f"{path}: depends on loads, which pages cannot set; write it without --force and --gravity")
    design, task = _owner(model.header["body"], problem, history, bodies, path)
    (faces, modes), count = shape, 6 + len(model.chambers)
    mesh = TetMesh(faces.points, np.zeros((0, 10), int), faces.corners)
    skin = skin_of_mesh(mesh, corners=4 * modes.modes[..., 0].size > MOST_NUMBERS)
    arrays: Arrays = {
        "points model": in_steps(
            faces.points[skin.nodes], min(MICROMETRE, 1e-4 * float(np.ptp(faces.points, axis=0).max()))
        ),
        "triangles model": Steps(skin.triangles.ravel(), differences=True),
    }
    for number, mode in enumerate(modes.modes):
        arrays[f"moved model {number}"] = in_parts(mode[skin.nodes, :3])
        arrays[f"stretched model {number}"] = in_parts(mode[skin.nodes, 3])
    told = {
        "design": design,
        "task": task,
        "parts": skin.parts,
        "obstacles": moved_obstacles(problem, task, None),
        "chambers": list(model.chambers),
        "bounds": model.bounds.tolist(),
        "corners": model.corners.tolist(),
        "index": model.index.tolist(),
        "coefficients": model.coefficients[:, :count].tolist(),
        # The compliance against forces: the first six entries of the lower triangle.
        "soft": {"index": model.soft_index.tolist(), "coefficients": model.soft_coefficients[:, :6].tolist()},
        "amounts": {"index": modes.index.tolist(), "coefficients": modes.coefficients.tolist()},
        "errors": model.errors,
        "held_out": model.header["held_out"],
    }
    return {"model": told}, arrays


def _owner(
    body: str, problem: Problem, history: Sequence[HistoryEntry], bodies: Sequence[Body], path: Path
) -> tuple[int, str]:
    """The number of the design, and the task, that a fingerprint is of."""
    for entry, own in zip(reversed(history), reversed(bodies), strict=True):
        there = starting_from(problem, entry.reinforcements)
        for task in problem.task:
            if fingerprint(there.model_copy(update={"task": (task,)}), own) == body:
                return entry.iteration, task.name
    raise ProblemError(
        f"{path}: is the model of another body, task or mesh; write that of this run with pneumorph model"
    )
