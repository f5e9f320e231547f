"""Checks of a problem whose body is from a file: what it asks for that only tubes have."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.problem.objectives import Maximize, TargetMotion
from pneumorph.problem.solid import SolidSpec
from pneumorph.problem.tables import Tables

MAX_ELEMENTS = 1_000_000

_FROM_BASE = 1e-3
"""How far base and tip of a body may be from the axis, and the base from z = 0, relative to its length, where an
objective measures from the base along the axis."""


def check_solid(problem: Tables) -> Iterator[tuple[str, str]]:
    """Key and reason of everything that is wrong with a problem whose body is from a file."""
    body = problem.body
    assert isinstance(body, SolidSpec)
    for key in ("region", "membrane", "fibres"):
        if getattr(problem, key):
            yield f"{key}[0]", "is for tubes; a body from a file is of one rubber, without sheets and fibres"
    faces = body.outline
    size = problem.mesh.size
    widest = float(np.ptp(faces.points, axis=0).min())
    if size > widest:
        yield "mesh.size", f"{size:g} mm is larger than the body, which is {widest:g} mm wide; make it smaller"
    a, b, c = np.moveaxis(faces.points[faces.triangles[:, :3]], 1, 0)
    volume = float(np.einsum("ti,ti->", a, np.cross(b, c))) / 6.0
    elements = 6.0 * volume / size**3
    if elements > MAX_ELEMENTS:
        yield (
            "mesh.size",
            f"{size:g} mm gives about {elements:.0g} elements, more than {MAX_ELEMENTS}; make it larger",
        )
    base, tip = body.ends
    off = max(np.abs(base).max(), np.hypot(*tip[:2]))
    for index, task in enumerate(problem.task):
        if not isinstance(task.objective, (Maximize, TargetMotion)) and off > _FROM_BASE * body.length:
            yield (
                f"task[{index}].objective.kind",
                "measures from the centre of the base along z; move the body in CAD so that its base is centred at the "
                "origin and its tip on the z axis",
            )
