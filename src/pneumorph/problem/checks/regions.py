"""Checks of regions: whether they fit the body, its walls and each other."""

from __future__ import annotations

import math
from collections.abc import Iterator

from pneumorph.problem.checks import wedges
from pneumorph.problem.regions import REST, Layer, Region
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables


def check_regions(problem: Tables) -> Iterator[tuple[str, str]]:
    """Key and reason of everything that is wrong with the regions of a problem whose chambers are in order."""
    chambers = [chamber.name for chamber in problem.tubes.chamber]
    if not all(tube.round for tube in (problem.tubes, *problem.tubes.chamber)):
        for index, region in enumerate(problem.region):
            if region.beyond is None:
                yield (
                    f"region[{index}]",
                    "needs tubes of round section without taper, unless it is given by beyond; change its shape, or "
                    "leave out section and taper",
                )
                return
    lined: set[str] = set()
    for index, region in enumerate(problem.region):
        key, wall = f"region[{index}]", problem.limits.wall
        if region.name == REST or region.name in [other.name for other in problem.region[:index]]:
            yield f"{key}.name", f'"{region.name}" is taken; give the region another name'
        if region.inside is not None:
            yield f"{key}.inside", "is for bodies from files; a tube has the regions layer, sleeve, beyond and within"
            continue
        shape = "layer" if region.layer else "sleeve"
        if region.thickness >= wall:
            yield (
                f"{key}.{shape}.thickness",
                f"{region.thickness:g} mm is not less than limits.wall = {wall:g} mm, which keeps the layer apart from "
                "other surfaces; make the layer thinner or raise the limit",
            )
        if region.layer is not None:
            yield from _layer(problem, f"{key}.layer", region.layer)
        if region.beyond is not None:
            yield from _beyond(problem, key, region, region.beyond)
        for name in region.sleeve.chambers if region.sleeve else ():
            if name not in chambers:
                yield f"{key}.sleeve.chambers", f'there is no chamber "{name}"; the chambers are {", ".join(chambers)}'
            elif name in lined:
                yield f"{key}.sleeve.chambers", f'"{name}" has a sleeve already; name each chamber once'
            lined.add(name)
    yield from _together(problem)
    yield from wedges.check_wedges(problem)


def _layer(problem: Tables, key: str, layer: Layer) -> Iterator[tuple[str, str]]:
    length, size = problem.tubes.length, problem.mesh.size
    if layer.span is not None:
        start, end = layer.span
        if start < -ROUNDING or end > length + ROUNDING:
            yield f"{key}.span", f"reaches beyond the body (0 to {length:g} mm); make it shorter"
        elif any(ROUNDING < part < size for part in (start, length - end, end - start)):
            yield (
                f"{key}.span",
                f"leaves less than mesh.size = {size:g} mm to an end of the body, or is shorter than that; move it or "
                "use a finer mesh",
            )
    if layer.angles is not None:
        width = layer.angles[1] - layer.angles[0]
        if min(width, 2.0 * math.pi - width) * problem.tubes.radius < size:
            yield f"{key}.angles", f"leave or cover less than mesh.size = {size:g} mm; change them or use a finer mesh"


def _beyond(problem: Tables, key: str, region: Region, height: float) -> Iterator[tuple[str, str]]:
    length, size, wall = problem.tubes.length, problem.mesh.size, problem.limits.wall
    key = f"{key}.beyond"
    if not size - ROUNDING <= height <= length - size + ROUNDING:
        yield (
            key,
            f"{height:g} mm leaves less than mesh.size = {size:g} mm to an end of the body (0 to {length:g} mm); move "
            "the plane or use a finer mesh",
        )
    for chamber in problem.tubes.chamber:
        near = min(chamber.span, key=lambda end: abs(end - height))
        if abs(near - height) < wall - ROUNDING:
            yield (
                key,
                f'{height:g} mm is nearer than limits.wall = {wall:g} mm to an end of chamber "{chamber.name}" '
                f"(z = {near:g} mm); move the plane into the chamber or farther away from it",
            )
    for other in problem.region:
        if other is not region and other.beyond is not None and abs(other.beyond - height) < size - ROUNDING:
            yield key, f'{height:g} mm is nearer than mesh.size to the plane of "{other.name}"; move them apart'
        if other.layer is not None:
            start, end = other.layer.span or (0.0, length)
            if start - size < height < end + size:
                yield (
                    key,
                    f'{height:g} mm is in the layer "{other.name}" or nearer to it than mesh.size; end that layer '
                    "before the plane",
                )
        for name in other.sleeve.chambers if other.sleeve else ():
            start, end = next((each.span for each in problem.tubes.chamber if each.name == name), (0.0, 0.0))
            if start - other.thickness - size < height < end + other.thickness + size:
                yield (
                    key,
                    f'{height:g} mm is in the sleeve "{other.name}" or nearer to it than mesh.size; move the plane',
                )


def _together(problem: Tables) -> Iterator[tuple[str, str]]:
    """Faults of two regions together: layers that touch, and layers and sleeves that might meet inside a wall."""
    wall = problem.limits.wall
    for j, other in enumerate(problem.region):
        shape = "layer" if other.layer else "sleeve"
        before = [*problem.region[:j], *([other] if other.sleeve and len(other.sleeve.chambers) > 1 else [])]
        for one in before:
            if one.layer and other.layer:
                if not _apart(one.layer, other.layer, problem):
                    yield (
                        f"region[{j}].layer",
                        f'is nearer to that of "{one.name}" than mesh.size, or shares an end of the body with it; move '
                        "them apart, or make one region of them",
                    )
            elif one.thickness + other.thickness >= wall:
                yield (
                    f"region[{j}].{shape}.thickness",
                    f'and that of "{one.name}" are together {one.thickness + other.thickness:g} mm, but walls may be '
                    f"as thin as limits.wall = {wall:g} mm; make the layers thinner or raise the limit",
                )


def _apart(one: Layer, other: Layer, problem: Tables) -> bool:
    """Whether two layers share no end of the body and are at least an element apart, along the body or around it."""
    length, size = problem.tubes.length, problem.mesh.size
    (a, b), (c, d) = (layer.span or (0.0, length) for layer in (one, other))
    if max(a, c) - min(b, d) >= size:
        return True
    if one.angles is None or other.angles is None or max(a, c) <= ROUNDING or min(b, d) >= length - ROUNDING:
        return False
    (a, b), (c, d) = one.angles, other.angles
    gaps = (c - b) % (2.0 * math.pi), (a - d) % (2.0 * math.pi)
    disjoint = abs(sum(gaps) + (b - a) + (d - c) - 2.0 * math.pi) < ROUNDING
    return disjoint and min(gaps) * problem.tubes.radius >= size
