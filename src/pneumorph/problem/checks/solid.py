"""Checks of a problem whose body is from a file: what it asks for that only tubes have."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from pneumorph.cad.parts import faces_where
from pneumorph.cad.shells import SYMMETRIC, asymmetry, place
from pneumorph.cad.solids import solids_at
from pneumorph.errors import MeshError
from pneumorph.problem.checks.reinforcement import check_covers
from pneumorph.problem.contact import PlaneSpec
from pneumorph.problem.design import DesignSpec
from pneumorph.problem.models import Limits
from pneumorph.problem.regions import REST
from pneumorph.problem.solid import SolidSpec
from pneumorph.problem.tables import Tables
from pneumorph.symmetry.operations import operations

MAX_ELEMENTS, MAX_CONTROL_POINTS = 1_000_000, 100_000
"""Of a problem: more are taken for a mistake of a unit."""

TURNS = (1, 2, 4)
"""Orders of a rotation that maps lattices along x, y and z to such."""

_FROM_BASE = 1e-3
"""How far base and tip of a body may be from the axis, and the base from z = 0, relative to its length, where an
objective measures from the base along the axis."""

SMALLEST, LARGEST = 1.0, 5000.0
"""Diagonals in mm of bodies that are taken to be meant: others are of another unit."""


def check_solid(problem: Tables) -> Iterator[tuple[str, str]]:
    """Key and reason of everything that is wrong with a problem whose body is from a file."""
    body = problem.body
    assert isinstance(body, SolidSpec)
    yield from check_covers(problem, body)
    yield from _regions(problem, body)
    yield from _seals(problem, body)
    faces = body.outline
    size = problem.mesh.size
    if not SMALLEST <= faces.diagonal <= LARGEST:
        box = " × ".join(f"{part:.3g}" for part in np.ptp(faces.points, axis=0))
        unit, scale = ("metres", "1000") if faces.diagonal < SMALLEST else ("µm", "0.001")
        yield "body.file", f"it is {box} mm in size; if these numbers are {unit}, give scale = {scale}"
        return
    widest = float(np.ptp(faces.points, axis=0).min())
    if size > widest:
        yield "mesh.size", f"{size:g} mm is larger than the body, which is {widest:g} mm wide; make it smaller"
    yield from _designed(problem, body)
    a, b, c = np.moveaxis(faces.points[faces.triangles[:, :3]], 1, 0)
    volume = float(np.einsum("ti,ti->", a, np.cross(b, c))) / 6.0
    yield from too_many_elements(volume, size)
    base, tip = body.ends
    off = max(np.abs(base).max(), np.hypot(*tip[:2]))
    for index, task in enumerate(problem.task):
        if not task.objective.tip_motions and off > _FROM_BASE * body.length:
            yield (
                f"task[{index}].objective.kind",
                "measures from the centre of the base along z; move the body in CAD so that its base is centred at the "
                "origin and its tip on the z axis",
            )


def too_many_elements(volume: float, size: float) -> Iterator[tuple[str, str]]:
    """The fault of a size of elements in mm that is too small for a volume in mm³."""
    elements = 6.0 * volume / size**3
    if elements > MAX_ELEMENTS:
        yield "mesh.size", f"{size:g} mm gives about {elements:.0g} elements, more than {MAX_ELEMENTS}; make it larger"


def _seals(problem: Tables, body: SolidSpec) -> Iterator[tuple[str, str]]:
    planes = [each.name for each in problem.obstacle if isinstance(each, PlaneSpec)]
    for number, chamber in enumerate(body.chamber):
        if chamber.seal is not None and chamber.seal not in planes:
            known = f"the planes are {', '.join(planes)}" if planes else 'add a table [[obstacle]] of kind = "plane"'
            yield f"body.chamber[{number}].seal", f'there is no plane "{chamber.seal}"; {known}'
        given = [index for index, task in enumerate(problem.task) if chamber.name in (task.volume or {})]
        if chamber.seal is not None and given:
            yield f"task[{given[0]}].volume.{chamber.name}", "is closed by an obstacle; give its pressure instead"


def _regions(problem: Tables, body: SolidSpec) -> Iterator[tuple[str, str]]:
    """What is wrong with the regions, each of which is a solid of the file."""
    for index, region in enumerate(problem.region):
        if region.name == REST or region.name in [other.name for other in problem.region[:index]]:
            yield f"region[{index}].name", f'"{region.name}" is taken; give the region another name'
        if region.inside is None:
            yield f"region[{index}]", "has a shape for tubes; for a body from a file give inside, a point in a solid"
            return
    try:
        solids_at(body.outline, {each.name: np.array(each.inside) for each in problem.region})
    except MeshError as error:
        yield "region", f"the file {error}"


def _designed(problem: Tables, body: SolidSpec) -> Iterator[tuple[str, str]]:
    """What is wrong with how the body is designed: its symmetry, its lattices, the faces that are kept."""
    symmetry, faces = body.symmetry, body.outline
    if "xy" in symmetry.mirror or symmetry.point or symmetry.half_turn:
        yield "body.symmetry", "of a body from a file has mirror planes xz and yz, and a rotation; leave the others out"
    elif symmetry.rotation not in TURNS:
        yield "body.symmetry.rotation", f"of a body from a file is one of {TURNS}; use one of these"
    else:
        for operation in operations(symmetry)[1:]:
            away, where = asymmetry(faces.points, faces.triangles, operation)
            if away > SYMMETRIC * faces.diagonal:
                yield (
                    "body.symmetry",
                    f"is not that of the body: at {place(where)} its image is {away:.2g} mm away; correct the body in "
                    "CAD, or ask for less symmetry",
                )
                break
    design = problem.design or DesignSpec()
    names = ("exterior", *(chamber.name for chamber in body.chamber))
    for name in design.spacings or ():
        if name not in names:
            yield f"design.spacings.{name}", f"is no surface of the body; these are {', '.join(names)}"
    count = 0
    for name in names:
        count += int(np.prod(np.ptp(faces.points, axis=0) / design.spacing_of(name, faces.diagonal) + 3.0))
    if count > MAX_CONTROL_POINTS:
        yield "design.spacing", f"gives about {count} control points, more than {MAX_CONTROL_POINTS}; make it larger"
    for index, each in enumerate(design.keep):
        if not faces_where(faces, each.where).any():
            yield f"design.keep[{index}]", f"there is no face {each.where}; give it another place"
    if problem.optimizer.method == "dfp":
        yield "optimizer.method", '"dfp" is for tubes; for a body from a file use "sqp"'
    own = problem.limits
    for key in ("curvature", "skew", "stretch"):
        if getattr(own, key) != getattr(Limits(), key):
            yield f"limits.{key}", "is for tubes; for a body from a file leave it out"
