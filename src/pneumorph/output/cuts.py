"""Where bodies are cut open: in the plane in which a task bends them, or as a user asks."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations
from typing import Literal

import numpy as np

from pneumorph.output.view import View
from pneumorph.problem import Problem, Task
from pneumorph.problem.objectives.bending import LEAST, longer
from pneumorph.results import TaskResult

Cut = Literal["yz", "xz", "xy", "none"]

NORMALS = {"yz": (-1.0, 0.0, 0.0), "xz": (0.0, 1.0, 0.0), "xy": (0.0, 0.0, -1.0), "none": (0.0, 1.0, 0.0)}
"""Normals of the planes by name, away from the camera; a body that is not cut is seen across xz."""

NEAR = np.radians(2.0)
"""A plane that is nearer to xz or yz is taken for it."""

ASKEW = np.radians(45.0)
"""How far a plane through two chambers may be turned from the one in which a body bends."""


def view_of(problem: Problem) -> View:
    """The view of all tasks together, cut open at chambers: of the plane, xz or yz, in which they bend most.

    If they bend as much in both or in none, it is a mirror plane of the body that passes through a chamber, or else the
    one of them that opens more of the chambers.
    """
    about = np.zeros(2)
    for task in problem.task:
        axis = task.objective.bends(problem.body.length)
        about += 0.0 if axis is None or not axis.any() else np.abs(axis) / np.abs(axis).sum()
    if abs(about[0] - about[1]) > 1e-9:
        return _bent_across(problem, np.array(NORMALS["yz" if about[0] > about[1] else "xz"]))
    normals = {plane: np.array(NORMALS[plane]) for plane in ("xz", "yz")}
    mirrors = [normals[plane] for plane in normals if plane in problem.body.symmetry.mirror]
    mirrors = [normal for normal in mirrors if problem.body.opened(normal, 0.0) > 0.0]
    return _through_chambers(problem, *(mirrors or normals.values()))


def task_view(problem: Problem, task: Task, result: TaskResult) -> View:
    """The view of the plane in which one task bends the body.

    It is the plane of the task's objective; for one without a plane of its own, that in which the tip has turned, and
    the view of all tasks together where it has not.
    """
    axis = task.objective.bends(problem.body.length)
    if axis is None:
        axis = longer(np.array(result.rotation[:2]), LEAST)
    if axis is None or not axis.any():
        return view_of(problem)
    return _bent_across(problem, _normal(axis))


def asked_view(problem: Problem, cut: Cut, at: float | None = None) -> View:
    """The view of a plane by its name, through the axis or at a distance in mm along the axis across it."""
    normal = np.array(NORMALS[cut])
    if cut == "none":
        return View(normal, None)
    if at is not None:
        place = float(normal.sum()) * at
    else:
        across = -sum(end[2] for end in problem.body.ends) / 2
        place = across if cut == "xy" else _through_chambers(problem, normal).offset
    # A body is long, so one that is seen along its axis is seen nearly straight.
    return View(normal, place, 4.0, 6.0) if cut == "xy" else View(normal, place)


def _normal(axis: np.ndarray) -> np.ndarray:
    """The normal of a plane across this axis (2,): with x to the right, or y for the plane yz."""
    for straight in ((1.0, 0.0), (0.0, 1.0)):
        if abs(axis @ straight) > np.cos(NEAR) * np.linalg.norm(axis):
            axis = np.array(straight)
    x, y = axis / np.linalg.norm(axis)
    sign = np.sign(y) if abs(y) > 1e-9 else -np.sign(x)
    return sign * np.array([x, y, 0.0])


def _bent_across(problem: Problem, normal: np.ndarray) -> View:
    """The cut of a body that bends across this normal (3,).

    A plane through two chambers that is turned a little is taken if it opens more of them, unless the plane of bending
    is a mirror plane of the body.
    """
    mirrored = any(abs(normal @ NORMALS[plane]) > 1.0 - 1e-9 for plane in problem.body.symmetry.mirror)
    return _through_chambers(problem, normal, askew=() if mirrored else _through_two(problem, normal))


def _through_chambers(problem: Problem, *normals: np.ndarray, askew: Sequence[View] = ()) -> View:
    """The cut across one of the normals, or askew, that opens most of the chambers; of equal ones that nearest to the
    axis, and one across a normal first.
    """

    def order(cut: View) -> tuple[float, bool, float, float]:
        place = cut.offset or 0.0
        # To three digits: a little more is not worth a plane off the axis.
        opened = float(f"{problem.body.opened(cut.normal, place):.3g}")
        return -opened, cut in askew, abs(place), place

    return min((*(View(normal, place) for normal in normals for place in _places(problem, normal)), *askew), key=order)


def _through_two(problem: Problem, normal: np.ndarray) -> list[View]:
    """The cuts along the axis through the middles of two chambers, seen as nearly along a normal (3,) as can be."""
    middles = np.column_stack([np.mean(problem.body.across(along), axis=1) for along in np.eye(3)[:2]])
    cuts = []
    for one, other in combinations(middles, 2):
        along = other - one
        if np.linalg.norm(along) < 1e-6:
            continue
        own = _normal(np.array(along[::-1] * [-1.0, 1.0]))
        own *= np.sign(own @ normal) or 1.0
        if own @ normal < np.cos(ASKEW + 1e-9):
            continue
        cut = View(own, round(float(own[:2] @ one), 6))
        # Turned back towards the plane of bending.
        aside = float(normal @ np.cross(own, [0.0, 0.0, 1.0]))
        cuts.append(replace(cut, turn=-np.sign(aside) * cut.turn if aside else cut.turn))
    return cuts


def _places(problem: Problem, normal: np.ndarray) -> list[float]:
    """Where cuts across a normal may be: at the axis, in the middle of a chamber, and where two chambers overlap."""
    sides = problem.body.across(normal)
    shared = [(max(one[0], other[0]), min(one[1], other[1])) for one in sides for other in sides]
    return [0.0, *sorted({round((low + high) / 2.0, 6) for low, high in shared if low < high})]
