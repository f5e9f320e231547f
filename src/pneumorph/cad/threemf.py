"""Triangles from 3MF files, in mm."""

from __future__ import annotations

import io
import zipfile
import zlib
from xml.etree import ElementTree

import numpy as np

from pneumorph.cad.stl import Surface

MM = {"micron": 1e-3, "millimeter": 1.0, "centimeter": 10.0, "inch": 25.4, "foot": 304.8, "meter": 1000.0}

MOST_BYTES = 200_000_000
"""Largest model within a 3MF file that is read."""

_DAMAGED = zipfile.BadZipFile, zlib.error, KeyError, ElementTree.ParseError, EOFError, RuntimeError
"""What is raised for files that are no whole archives of XML; compression of a kind that is not known is the last."""

_DEEPEST = 8
"""Objects within objects."""


def read_3mf(data: bytes, most: int) -> Surface:
    """The points in mm and the triangles of all objects that a 3MF file builds, each in its place.

    Raises
    ------
    ValueError
        If it is none, or has more than `most` triangles; says why and how to repair it.
    """
    try:
        root = ElementTree.fromstring(_model(data))
    except _DAMAGED:
        raise ValueError("is not a whole 3MF file; export it again") from None
    space = root.tag.partition("}")[0] + "}"
    objects = {each.get("id"): each for each in root.iter(f"{space}object")}
    parts: list[tuple[np.ndarray, np.ndarray]] = []
    try:
        for item in root.iter(f"{space}item"):
            _add(parts, objects, item, np.eye(4), space, most, 0)
        scale = MM[root.get("unit", "millimeter")]
    except (KeyError, TypeError, ValueError) as error:
        if error.args and str(error.args[0]).startswith("has "):
            raise
        raise ValueError("has objects that cannot be read; export it again") from None
    if not parts:
        raise ValueError("has no triangles; export it again")
    starts = np.cumsum([0, *(len(points) for points, _ in parts[:-1])])
    triangles = np.concatenate([start + own for start, (_, own) in zip(starts, parts, strict=True)])
    return Surface(scale * np.concatenate([points for points, _ in parts]), triangles)


def _model(data: bytes) -> bytes:
    """The XML of the model in the archive."""
    with zipfile.ZipFile(io.BytesIO(data)) as archive:
        name = next((each for each in archive.namelist() if each.lower().endswith("3dmodel.model")), "3D/3dmodel.model")
        with archive.open(name) as file:
            content = file.read(MOST_BYTES + 1)
    if len(content) > MOST_BYTES:
        raise KeyError(name)
    return content


def _add(
    parts: list[tuple[np.ndarray, np.ndarray]],
    objects: dict[str | None, ElementTree.Element],
    item: ElementTree.Element,
    outer: np.ndarray,
    space: str,
    most: int,
    depth: int,
) -> None:
    """Add the triangles of an item or a component, which is moved by the `outer` matrix (4, 4) after its own."""
    matrix = np.eye(4)
    if text := item.get("transform"):
        # Twelve numbers, row by row, for row vectors.
        matrix[:, :3] = np.array(text.split(), float).reshape(4, 3)
    matrix = matrix @ outer
    part = objects[item.get("objectid")]
    if depth > _DEEPEST:
        raise ValueError("has too many objects within objects; export it as one mesh")
    for inner in part.iterfind(f"{space}components/{space}component"):
        _add(parts, objects, inner, matrix, space, most, depth + 1)
    corners = [[float(each.get(axis, "")) for axis in "xyz"] for each in part.iter(f"{space}vertex")]
    triangles = [[int(each.get(key, "")) for key in ("v1", "v2", "v3")] for each in part.iter(f"{space}triangle")]
    if not triangles:
        return
    points, own = np.array(corners, float).reshape(-1, 3), np.array(triangles, int)
    if own.min() < 0 or own.max() >= len(points):
        raise ValueError("has triangles between corners that it does not have; export it again")
    if sum(len(each) for _, each in parts) + len(own) > most:
        raise ValueError(f"has more than {most} triangles; make it coarser in a mesh program")
    if np.linalg.det(matrix[:3, :3]) < 0.0:
        own = own[:, ::-1]
    parts.append((points @ matrix[:3, :3] + matrix[3, :3], own))
