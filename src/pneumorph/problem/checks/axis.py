"""Checks of axes that are not straight: whether bodies are sound about them, and what needs a straight one."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.problem.axis import Axis
from pneumorph.problem.outline import Outline
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables
from pneumorph.symmetry.operations import operations

SHARPEST = 0.8
"""Share by which lines along a body may be shorter than its axis: beyond it elements inside the bend are too flat."""

SLICES = 200
"""Cross-sections that are checked along an axis."""


def check_axis(problem: Tables) -> Iterator[tuple[str, str]]:
    """Key and reason where no sound body lies along the axis."""
    body, axis = problem.tubes, problem.tubes.bent
    if axis is None:
        return
    outline = body.outline.scaled(max(1.0, body.taper))
    shrinks = axis.shrinks(outline)
    if shrinks > SHARPEST:
        yield (
            "body.axis",
            f"bends so sharply that the inside of the bend is {100 * shrinks:.0f} % shorter than the axis, more than "
            f"{100 * SHARPEST:.0f} %; bend it less, make the arc longer, or the section smaller",
        )
        return
    lengths = np.linspace(0.0, axis.length, SLICES + 1)[1:-1]
    low, high = _over_ends(axis, outline, lengths)
    for end, over in (("base", low), ("tip", high)):
        if over < -ROUNDING:
            yield (
                "body.axis",
                f"turns back until the body crosses the plane of its own {end}, which designs stay on one side of; "
                "bend it less",
            )
            return
    if not all(np.allclose(axis.at(lengths)[0] @ g.T, axis.at(lengths)[0]) for g in operations(body.symmetry)):
        yield (
            "body.symmetry",
            "does not map body.axis to itself; a bent axis has the mirror plane that it lies in, xz or yz, at most",
        )


def check_uses(problem: Tables) -> Iterator[tuple[str, str]]:
    """What does not go together with an axis that is not straight."""
    body, axis, wall = problem.tubes, problem.tubes.bent, problem.limits.wall
    if axis is None:
        return
    for index, chamber in enumerate(body.chamber):
        ends = zip(chamber.span, (1.0, chamber.taper), strict=True)
        outlines = [(chamber.outline.scaled(size).moved(*chamber.center), np.array([at])) for at, size in ends]
        end = min(over for outline, at in outlines for over in _over_ends(axis, outline, at))
        if end < wall - ROUNDING:
            yield (
                f"body.chamber[{index}].span",
                f"leaves a wall of {max(end, 0.0):.3g} mm at an end of the body, inside the bend of its axis, thinner "
                f"than limits.wall = {wall:g} mm at the start; make the chamber shorter, or let the axis end straight",
            )
    for index, region in enumerate(problem.region):
        for key in ("beyond", "within"):
            if getattr(region, key) is not None:
                yield f"region[{index}].{key}", "needs a straight body.axis; use a layer or a sleeve"
    for index, task in enumerate(problem.task):
        if task.objective.section_count[1]:
            key, _ = task.objective.section_count
            yield (
                f"task[{index}].objective.{key}",
                "sections across z need a straight body.axis; use an objective about the tip, e.g. a motion or reach",
            )
    tip = float(body.farthest[1][2])
    if problem.end_effector.kind == "free" and tip < body.radius:
        yield (
            "end_effector.kind",
            f"is free, but the tip is at z = {tip:.3g} mm, less than the body's radius above its base, where its turns "
            'cannot be counted; use "plate", or bend body.axis less',
        )


def _over_ends(axis: Axis, outline: Outline, lengths: np.ndarray) -> tuple[float, float]:
    """The least distances (mm) of cross-sections at lengths (n,) from the planes of base and tip; negative beyond."""
    places, turns = axis.at(lengths)
    points = places[:, None] + np.einsum("nij,kj->nki", turns[..., :2], outline.points)
    (tip,), (turn,) = axis.at([axis.length])
    return float(points[..., 2].min()), float(((tip - points) @ turn[:, 2]).min())
