"""Checks of sheets and fibres: whether they lie on surfaces that there are."""

from __future__ import annotations

from collections.abc import Iterator

from pneumorph.cad.parts import triangles_where
from pneumorph.problem.reinforcement import EXTERIOR, Reinforcement
from pneumorph.problem.solid import SolidSpec
from pneumorph.problem.table import ROUNDING
from pneumorph.problem.tables import Tables


def check_covers(problem: Tables, body: SolidSpec) -> Iterator[tuple[str, str]]:
    """Key and reason of everything that is wrong with the reinforcements on a body from a file."""
    faces, names = body.outline, list[str]()
    surfaces = [EXTERIOR, *(chamber.name for chamber in body.chamber)]
    for table in ("membrane", "fibres"):
        for index, each in enumerate(getattr(problem, table)):
            key = f"{table}[{index}]"
            if each.name in names:
                yield f"{key}.name", f'"{each.name}" is used twice; give each membrane and all fibres different names'
            names.append(each.name)
            for part in ("span", "angles"):
                if getattr(each, part) is not None:
                    yield (
                        f"{key}.{part}",
                        'is for tubes; for a body from a file give on, e.g. on = [{ name = "floor" }]',
                    )
            for name in each.surfaces:
                if name not in surfaces:
                    yield f"{key}.surfaces", f'there is no surface "{name}"; the surfaces are {", ".join(surfaces)}'
            for number, chosen in enumerate(each.on or ()):
                if not len(triangles_where(faces, chosen.where)):
                    yield f"{key}.on[{number}]", f"there is no face {chosen.where}; give it another place"


def check_reinforcements(problem: Tables) -> Iterator[tuple[str, str]]:
    """Key and reason of everything that is wrong with the reinforcements of a problem whose chambers are in order."""
    body, size = problem.tubes, problem.mesh.size
    known = {EXTERIOR: (body.radius, (0.0, body.length))}
    known |= {chamber.name: (chamber.radius, chamber.span) for chamber in body.chamber}
    names: list[str] = []
    for table in ("membrane", "fibres"):
        for index, each in enumerate(getattr(problem, table)):
            key = f"{table}[{index}]"
            if each.name in names:
                yield f"{key}.name", f'"{each.name}" is used twice; give each membrane and all fibres different names'
            names.append(each.name)
            for part in ("on", "along"):
                if getattr(each, part, None) is not None:
                    yield f"{key}.{part}", "is for bodies from files; a tube has surfaces, span and angles"
            for name in each.surfaces:
                if name == EXTERIOR and EXTERIOR in (chamber.name for chamber in body.chamber):
                    yield f"{key}.surfaces", f'"{EXTERIOR}" is a chamber too; give that another name'
                elif name not in known:
                    yield f"{key}.surfaces", f'there is no surface "{name}"; the surfaces are {", ".join(known)}'
                elif each.surfaces.count(name) > 1:
                    yield f"{key}.surfaces", f'has "{name}" twice; name each surface once'
                    break
                else:
                    yield from _part(key, each, name, *known[name], size)


def _part(
    key: str, each: Reinforcement, name: str, radius: float, span: tuple[float, float], size: float
) -> Iterator[tuple[str, str]]:
    if each.span is not None:
        start, end = each.span
        if start < span[0] - ROUNDING or end > span[1] + ROUNDING:
            yield f"{key}.span", f'reaches beyond "{name}" ({span[0]:g} to {span[1]:g} mm); make it shorter'
        elif end - start < size - ROUNDING:
            yield f"{key}.span", f"is shorter than mesh.size = {size:g} mm; make it longer or use a finer mesh"
    if each.angles is not None and (each.angles[1] - each.angles[0]) * radius < size:
        yield f"{key}.angles", f"cover less than mesh.size = {size:g} mm; change them or use a finer mesh"
