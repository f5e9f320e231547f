"""Triangles as files for slicers: 3MF with units and names, and STL for programs that do not read 3MF."""

# pyright: reportOptionalMemberAccess=false
# lib3mf has no annotations, so pyright takes what it returns for None.
from __future__ import annotations

import locale
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path

import numpy as np
from lib3mf import Lib3MF, get_wrapper

from pneumorph.cad.stl import read_triangles
from pneumorph.make.triangles import MAX_TRIANGLES, Triangles

# Both formats store vertices in single precision, with a resolution of 4e-6 mm at 80 mm; six decimals suffice.
_DECIMALS = 6


@contextmanager
def _kept_locale() -> Iterator[None]:
    """Restore the locale, which lib3mf changes: the encoding of files that are opened later depends on it."""
    before = locale.setlocale(locale.LC_ALL)
    try:
        yield
    finally:
        locale.setlocale(locale.LC_ALL, before)


def write_3mf(path: Path, parts: Mapping[str, Triangles], printed: int = 1) -> None:
    """Write named parts in millimetres, of which only the first are to be printed.

    The others are objects of the type "other", which programs can read but slicers do not print: a chamber printed
    together with its body would be filled with material.

    Parameters
    ----------
    path : Path
        The file; an existing one is replaced.
    parts : mapping of str to Triangles
        The parts by name.
    printed : int
        How many of them are printed.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    _write(path, "3mf", parts, printed)


def write_stl(path: Path, part: Triangles) -> None:
    """Write one part as binary STL. The format has no units; the numbers are millimetres.

    Parameters
    ----------
    path : Path
        The file; an existing one is replaced.
    part : Triangles
        In mm.

    Raises
    ------
    OSError
        If the file cannot be written.
    """
    _write(path, "stl", {"": part})


@_kept_locale()
def read_3mf(path: Path) -> dict[str, Triangles]:
    """Read the objects of a 3MF file, by name, in millimetres.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    model = get_wrapper().CreateModel()
    try:
        model.QueryReader("3mf").ReadFromFile(str(path))
    except Lib3MF.ELib3MFException as error:
        raise OSError(f"{path}: is not a 3MF file ({error})") from None
    objects, meshes = model.GetMeshObjects(), {}
    while objects.MoveNext():
        mesh = objects.GetCurrentMeshObject()
        points = np.array([tuple(vertex.Coordinates) for vertex in mesh.GetVertices()], dtype=float)
        corners = np.array([tuple(triangle.Indices) for triangle in mesh.GetTriangleIndices()], dtype=np.int64)
        meshes[mesh.GetName()] = Triangles(points, corners)
    return meshes


def read_stl(path: Path) -> Triangles:
    """Read the triangles of an STL file, with points of equal coordinates merged.

    Raises
    ------
    OSError
        If the file cannot be read.
    """
    try:
        return Triangles(*read_triangles(path.read_bytes(), MAX_TRIANGLES))
    except ValueError as error:
        raise OSError(f"{path}: {error}") from None


@_kept_locale()
def _write(path: Path, form: str, parts: Mapping[str, Triangles], printed: int = 1) -> None:
    wrapper = get_wrapper()
    model = wrapper.CreateModel()
    model.SetUnit(Lib3MF.ModelUnit.MilliMeter)
    for number, (name, part) in enumerate(parts.items()):
        mesh = model.AddMeshObject()
        mesh.SetName(name)
        points = np.ascontiguousarray(part.points, dtype=np.float32)
        corners = np.ascontiguousarray(part.corners, dtype=np.uint32)
        mesh.SetGeometry(
            (Lib3MF.Position * len(points)).from_buffer(points.data),
            (Lib3MF.Triangle * len(corners)).from_buffer(corners.data),
        )
        if number < printed:
            model.AddBuildItem(mesh, wrapper.GetIdentityTransform())
        else:
            mesh.SetType(Lib3MF.ObjectType.Other)
    writer = model.QueryWriter(form)
    writer.SetDecimalPrecision(_DECIMALS)
    try:
        writer.WriteToFile(str(path))
    except Lib3MF.ELib3MFException as error:
        raise OSError(f"{path}: cannot be written ({error})") from None
