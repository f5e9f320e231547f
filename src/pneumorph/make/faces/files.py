"""All files of a design of a body from a file, in one folder."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TypeVar

import numpy as np

from pneumorph.doing import doing
from pneumorph.geometry import Body
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.make.checks import Check, check_triangles
from pneumorph.make.faces.checks import DEVIATION, check_solids, points_of, volume_within
from pneumorph.make.faces.sheets import Sheet, around, sheets_of
from pneumorph.make.faces.solid import displaced_solids
from pneumorph.make.faces.triangles import triangulated
from pneumorph.make.files import MadeFiles, as_json, published
from pneumorph.make.printing import write_3mf, write_stl
from pneumorph.make.step import write_step
from pneumorph.make.triangles import Triangles
from pneumorph.problem import Problem

Shape = TypeVar("Shape")

EXACT = ("step", "brep")
"""Formats of files with faces; others have triangles, of which no STEP file is made."""


def make_faces(problem: Problem, body: Body[LatticeSurface], folder: Path, chord: float = 0.02) -> MadeFiles:
    """Write a design as 3MF and STL and, where its file has exact faces, as STEP, with the results of checks.

    Every face in the STEP file is a B-spline surface through the displaced face of the file; those that stay are as
    they were. Chambers without ports are STEP files too.

    Parameters
    ----------
    problem : Problem
        With a body from a file.
    body : Body
        A design of it.
    folder : Path
        Where to write; created if it does not exist. Existing files of the same names are replaced.
    chord : float
        Largest distance in mm between the surfaces and the triangles of 3MF and STL.

    Raises
    ------
    OSError
        If the folder or a file cannot be written.
    ComputationError
        If the chord error needs too many triangles, see `triangulated`.
    """
    return published(folder, lambda work: _make(problem, body, work, chord))


def _make(problem: Problem, body: Body[LatticeSurface], folder: Path, chord: float) -> MadeFiles:
    """See `make_faces`; in a folder that nobody else writes in."""
    sheets = sheets_of(problem, body)
    with doing("triangulating the faces"):
        pieces = triangulated([sheet.part for sheet in sheets], chord)
    rubbers = dict.fromkeys(name for sheet in sheets for name in (sheet.inner, sheet.outer) if name)
    volumes = {name: _volume(sheets, name) for name in rubbers}
    parts = {name: _joined(pieces, around(sheets, name)) for name in rubbers}
    open_ = {each.name for each in problem.body.chamber if getattr(each, "port", None) is not None}
    for chamber in body.chambers:
        if chamber.name not in open_:
            own = [(number, False) for number, sheet in enumerate(sheets) if sheet.surface == chamber.name]
            parts[f"chamber {chamber.name}"] = _joined(pieces, own)
    files, checks = [], list[Check]()
    assert problem.solid is not None
    if problem.solid.format in EXACT:
        with doing("fitting splines to the faces"):
            made = displaced_solids(problem, body)
        step = folder / "body.step"
        write_step(_named(made.rubbers, made.solids), step, "body" if len(made.solids) > 1 else "")
        files.append(step)
        checks.append(
            Check(step.name, "deviation of faces and edges from the displaced ones", made.deviation, DEVIATION, "mm")
        )
        with doing("checking the solid"):
            checks += check_solids(step, [sheet.part for sheet in sheets], made.shells, volumes, made.rubbers)
        for name, core in made.inner.items():
            path = folder / f"chamber_{name}.step"
            write_step({f"chamber {name}": core}, path)
            files.append(path)
            own = next(each for each in body.chambers if each.name == name)
            checks += check_solids(path, [own], 1, {name: -volume_within([own])}, [name])
    mesh, plain = folder / "body.3mf", folder / "body.stl"
    write_3mf(mesh, parts, len(rubbers))
    write_stl(plain, _joined(pieces, [(number, True) for number, sheet in enumerate(sheets) if not sheet.outer]))
    with doing("checking the triangles"):
        for name in rubbers if len(rubbers) > 1 else ():
            points = points_of([sheets[number].part for number, _ in around(sheets, name)])
            checks += check_triangles(mesh, points, volumes[name], chord, name)
        points, volume = points_of(body.surfaces), volume_within(body.surfaces)
        for path in (mesh, plain) if len(rubbers) == 1 else (plain,):
            checks += check_triangles(path, points, volume, chord)
    report = folder / "checks.json"
    report.write_text(as_json(checks), encoding="utf-8")
    return MadeFiles((*files, mesh, plain, report), tuple(checks))


def _named(rubbers: Sequence[str], solids: Sequence[Shape]) -> dict[str, Shape]:
    """Solids by different names: those of their rubbers, with a number from the second of a rubber on."""
    found: dict[str, Shape] = {}
    for place, (rubber, solid) in enumerate(zip(rubbers, solids, strict=True)):
        count = rubbers[: place + 1].count(rubber)
        found[rubber if count == 1 else f"{rubber} {count}"] = solid
    return found


def _volume(sheets: Sequence[Sheet], rubber: str) -> float:
    """The volume of a rubber, mm³."""
    return sum((1.0 if out else -1.0) * volume_within([sheets[number].part]) for number, out in around(sheets, rubber))


def _joined(pieces: Sequence[Triangles], those: Sequence[tuple[int, bool]]) -> Triangles:
    """Triangles of some pieces, or with their other side out, as one surface."""
    corners = [pieces[number].corners if out else pieces[number].corners[:, ::-1] for number, out in those]
    return _compact(Triangles(pieces[0].points, np.concatenate(corners)))


def _compact(part: Triangles) -> Triangles:
    """The same triangles, with the points of theirs alone."""
    used, corners = np.unique(part.corners, return_inverse=True)
    return Triangles(part.points[used], corners.reshape(-1, 3))
