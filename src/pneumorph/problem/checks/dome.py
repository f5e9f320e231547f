"""Checks of a dome at the tip: whether it fits the body, and what does not go together with it."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.problem.body import BodySpec, ChamberSpec
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables

MOST = 0.8
"""Largest radius of what is bonded to the plate, relative to that of the body: beyond it a flat tip is meant."""

LEAST = 0.5
"""Smallest one, relative to the size of elements, of which eight lie around it."""

SLICES = 16
"""Cross-sections of a chamber that are checked within a dome."""


def check_dome(problem: Tables) -> Iterator[tuple[str, str]]:
    """Key and reason of everything that is wrong with the dome of a body whose chambers are in order."""
    body, size = problem.tubes, problem.mesh.size
    if body.dome is None:
        return
    height, radius, bonded = body.domes[1], body.tip_radius, body.bonded
    if height > body.length + ROUNDING:
        yield (
            "body.dome.height",
            f"{height:.4g} mm is more than the body's length of {body.length:g} mm; make it lower",
        )
        return
    if not LEAST * size - ROUNDING <= bonded <= MOST * radius + ROUNDING:
        yield (
            "body.dome.plate",
            f"{bonded:.3g} mm is not between half of mesh.size = {size:g} mm and {MOST:g} times the radius at the tip, "
            f"{MOST * radius:.3g} mm; change it, or use a finer mesh",
        )
    for index, chamber in enumerate(body.chamber):
        yield from _out_of_it(body, chamber, f"body.chamber[{index}].span")
    for index, region in enumerate(problem.region):
        if region.layer or region.within:
            key = "layer" if region.layer else "within"
            yield f"region[{index}].{key}", "needs a flat tip; leave out body.dome, or use beyond or a sleeve"
        elif region.beyond is not None and region.beyond > body.length - height - size + ROUNDING:
            yield (
                f"region[{index}].beyond",
                f"{region.beyond:g} mm is in the dome or nearer to it than mesh.size = {size:g} mm; put the plane at "
                f"z = {body.length - height - size:.4g} mm or below",
            )


def _out_of_it(body: BodySpec, chamber: ChamberSpec, key: str) -> Iterator[tuple[str, str]]:
    """Whether the cross-sections of a chamber are inside those of the dome."""
    start, end = chamber.span
    inside = max(start, body.length - body.domes[1])
    # At its pole a chamber is a point.
    for height in np.linspace(inside, end, SLICES, endpoint=chamber.ends == "flat").tolist() if inside < end else ():
        outside = body.outline.scaled(body.scale_at(height))
        if outside.clearance(chamber.outline.scaled(chamber.scale_at(height)).moved(*chamber.center)) <= 0.0:
            yield (
                key,
                f"puts part of the chamber outside the dome at z = {height:.3g} mm; end it lower, make it narrower, "
                'or close it by domes: ends = "pole"',
            )
            return
