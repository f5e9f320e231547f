"""What `pneumorph check` says about a body from a file."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.cad.findings import Findings, findings_of
from pneumorph.cad.shells import place
from pneumorph.problem import SolidSpec

THIN = 1 / 3
"""Walls thinner than this share of the size of elements have flat ones, which are stiff."""


def found_in(body: SolidSpec, size: float) -> Iterator[tuple[str, str]]:
    """Lines on what is in a file, each with its style; `size` is that of the elements, mm."""
    findings = findings_of(body.outline)
    box = " × ".join(f"{part:.4g}" for part in findings.upper - findings.lower)
    yield (
        f"body      {box} mm, from {place(findings.lower)} to {place(findings.upper)}; {findings.faces} faces, "
        f"{findings.volume:.4g} mm³ of rubber",
        "",
    )
    for chamber in body.chamber:
        void = body.parts.chambers[chamber.name]
        port = "" if chamber.port is None else f", with a port in the plane {chamber.port}"
        yield f"chamber   {chamber.name}: {-void.volume:.4g} mm³, centroid {place(void.centre)}{port}", ""
    for name, where, at in zip(("base", "tip"), body.ends_at, body.ends, strict=True):
        yield f"{name:9} faces {where}, centroid {place(np.asarray(at))}", ""
    apart = float(body.deviations(size).max())
    yield f"mesh      its faces deviate by at most {apart:.2g} mm from those of the file", ""
    yield from _faults(findings, size)


def _faults(findings: Findings, size: float) -> Iterator[tuple[str, str]]:
    thickness, where = findings.wall.thickness, place(findings.wall.place)
    thin = thickness < THIN * size
    advice = f'; too thin for elements of {size:g} mm: use mesh.size = "{3 * thickness:.2g} mm"' if thin else ""
    yield f"wall      at least {thickness:.3g} mm, at {where}{advice}", "red" if thin else ""
    if findings.crossing is not None:
        yield f"fault     the surface intersects itself at {place(findings.crossing)}; repair it in CAD", "red"
