"""All files of a design of a body from a file, in one folder."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from pneumorph.doing import doing
from pneumorph.geometry import Body
from pneumorph.geometry.lattice import LatticeSurface
from pneumorph.make.checks import Check, check_triangles
from pneumorph.make.faces.checks import DEVIATION, check_solid, points_of, volume_within
from pneumorph.make.faces.solid import displaced_solid
from pneumorph.make.faces.triangles import triangulated
from pneumorph.make.files import MadeFiles, as_json, published
from pneumorph.make.printing import write_3mf, write_stl
from pneumorph.make.step import write_step
from pneumorph.make.triangles import Triangles
from pneumorph.problem import Problem

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
    with doing("triangulating the faces"):
        pieces = triangulated(body, chord)
    whole = Triangles(pieces[0].points, np.concatenate([each.corners for each in pieces]))
    open_ = {each.name for each in problem.body.chamber if getattr(each, "port", None) is not None}
    closed = [number for number, each in enumerate(body.chambers) if each.name not in open_]
    parts = {"body": _compact(whole)}
    for number in closed:
        own = pieces[1 + number]
        parts[f"chamber {body.chambers[number].name}"] = _compact(Triangles(own.points, own.corners[:, ::-1]))
    files, checks = [], list[Check]()
    volume = volume_within(body.surfaces)
    assert problem.solid is not None
    if problem.solid.format in EXACT:
        with doing("fitting splines to the faces"):
            made = displaced_solid(problem, body)
        step = folder / "body.step"
        write_step({"body": made.shape}, step)
        files.append(step)
        checks.append(
            Check(step.name, "deviation of faces and edges from the displaced ones", made.deviation, DEVIATION, "mm")
        )
        with doing("checking the solid"):
            checks += check_solid(step, body.surfaces, made.shells, volume)
        for name, core in made.inner.items():
            path = folder / f"chamber_{name}.step"
            write_step({f"chamber {name}": core}, path)
            files.append(path)
            own = next(each for each in body.chambers if each.name == name)
            checks += check_solid(path, [own], 1, -volume_within([own]))
    points = points_of(body.surfaces)
    mesh, plain = folder / "body.3mf", folder / "body.stl"
    write_3mf(mesh, parts)
    write_stl(plain, parts["body"])
    with doing("checking the triangles"):
        for path in (mesh, plain):
            checks += check_triangles(path, points, volume, chord)
    report = folder / "checks.json"
    report.write_text(as_json(checks), encoding="utf-8")
    return MadeFiles((*files, mesh, plain, report), tuple(checks))


def _compact(part: Triangles) -> Triangles:
    """The same triangles, with the points of theirs alone."""
    used, corners = np.unique(part.corners, return_inverse=True)
    return Triangles(part.points[used], corners.reshape(-1, 3))
