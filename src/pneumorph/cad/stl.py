"""Closed surfaces of triangles from STL files, and as the text by which problems keep them.

The format is read here, in a page. The reader of VTK (pyvista) takes paths instead of bytes, answers every fault of a
file with an empty mesh, and writes the reason to its own log, so that no message could say what to repair; and problem
files are read without loading VTK. Readers of the extra `cad` check less. Coordinates are kept as 32-bit floats, which
is what binary STL has.
"""

from __future__ import annotations

import base64
import binascii
import re
import zlib
from typing import NamedTuple

import numpy as np

MOST_TRIANGLES = 20_000
"""Triangles of a surface: contact looks for what is near among all of them at every state."""

MOST_BYTES = 400 * MOST_TRIANGLES
"""Size of an STL file that is read; in text a triangle takes up to that many bytes."""

THIN = 1e-6
"""Least height of a triangle, as a fraction of its longest edge."""

_RECORD = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_VERTEX = re.compile(rb"\bvertex\s+(\S+)\s+(\S+)\s+(\S+)", re.IGNORECASE)
_COUNTS = np.dtype("<u4")


class Surface(NamedTuple):
    """Points (V, 3) and triangles (T, 3) of a closed surface, counter-clockwise seen from outside."""

    points: np.ndarray
    triangles: np.ndarray


def read_stl(data: bytes) -> Surface:
    """The surface in the bytes of an STL file, binary or text.

    Raises
    ------
    ValueError
        If it is none, too large or not closed; says why and how to repair it.
    """
    return _closed(read_triangles(data, MOST_TRIANGLES))


def read_triangles(data: bytes, most: int) -> Surface:
    """The triangles in the bytes of an STL file with equal points merged, whether they are closed or not.

    Raises
    ------
    ValueError
        If it is none, or has more than `most` triangles; says why and how to repair it.
    """
    return _merged(_binary(data, most) if _is_binary(data) else _text(data, most))


def pack(surface: Surface) -> str:
    """A surface as text."""
    points, triangles = surface
    counts = np.array([len(points), len(triangles)], _COUNTS)
    data = counts.tobytes() + points.astype("<f4").tobytes() + triangles.astype("<u4").tobytes()
    return base64.b64encode(zlib.compress(data, 9)).decode()


def unpack(text: str) -> Surface:
    """The surface that `pack` wrote; raises ValueError for any other text."""
    most = 8 + 24 * MOST_TRIANGLES
    try:
        data = zlib.decompressobj().decompress(base64.b64decode(text, validate=True), most + 1)
        vertices, count = (int(number) for number in np.frombuffer(data, _COUNTS, 2))
        if not 8 + 12 * (vertices + count) == len(data) <= most:
            raise ValueError
        points = np.frombuffer(data, "<f4", 3 * vertices, 8).reshape(-1, 3).astype(float)
        triangles = np.frombuffer(data, "<u4", 3 * count, 8 + 12 * vertices).reshape(-1, 3).astype(int)
        if count and triangles.max() >= vertices:
            raise ValueError
    except (ValueError, binascii.Error, zlib.error):
        raise ValueError("is not the text of a surface; give file in its place") from None
    return _closed(Surface(points, triangles))


def _is_binary(data: bytes) -> bool:
    # Binary files may begin with "solid" too: their length tells.
    return len(data) >= 84 and len(data) == 84 + 50 * int(np.frombuffer(data, _COUNTS, 1, 80)[0])


def _binary(data: bytes, most: int) -> np.ndarray:
    """Corners (T, 3, 3) of all triangles."""
    _few((len(data) - 84) // 50, most)
    return np.frombuffer(data, _RECORD, offset=84)["corners"].astype(np.float32)


def _text(data: bytes, most: int) -> np.ndarray:
    numbers = _VERTEX.findall(data) if data.lstrip()[:5].lower() == b"solid" else []
    _few(len(numbers) // 3, most)
    if not numbers or len(numbers) % 3 or data.lower().count(b"endfacet") != len(numbers) // 3:
        raise ValueError("is not a whole STL file; export it again, as binary or text STL")
    try:
        with np.errstate(over="ignore"):
            return np.array(numbers).astype(float).astype(np.float32).reshape(-1, 3, 3)
    except ValueError:
        raise ValueError("has a corner that is no number; export it again") from None


def _few(count: int, most: int) -> None:
    if count > most:
        raise ValueError(f"has {count} triangles, more than {most}; make it coarser in a mesh program")


def _merged(corners: np.ndarray) -> Surface:
    """Triangles with points of equal coordinates merged, without those of which an edge vanishes by that."""
    if not np.isfinite(corners).all():
        raise ValueError("has a corner that is not a finite number; export it again")
    # Adding zero makes one of the two zeros.
    points, triangles = np.unique(corners.reshape(-1, 3) + np.float32(0.0), axis=0, return_inverse=True)
    triangles = triangles.reshape(-1, 3)
    return Surface(points.astype(float), triangles[np.all(triangles != np.roll(triangles, 1, axis=1), axis=1)])


def _closed(surface: Surface) -> Surface:
    """The surface with its triangles turned outwards; raises ValueError unless it is one that a body can touch."""
    points, triangles = surface
    if not np.isfinite(points).all():
        raise ValueError("has a corner that is not a finite number; export it again")
    directed = np.concatenate([triangles[:, [i, j]] for i, j in ((0, 1), (1, 2), (2, 0))])
    _, count = np.unique(np.sort(directed, axis=1), axis=0, return_counts=True)
    if len(triangles) < 4 or np.any(count != 2):
        open_edges = np.count_nonzero(count != 2)
        raise ValueError(
            f"is not watertight: {open_edges} of {len(count)} edges do not join two triangles; close it in a mesh "
            "program"
        )
    if len(np.unique(directed, axis=0)) != len(directed):
        raise ValueError("has triangles that are not turned alike; make its normals consistent in a mesh program")
    a, b, c = np.moveaxis(points[triangles], 1, 0)
    edges = np.linalg.norm(np.stack([b - a, c - b, a - c]), axis=-1).max(axis=0)
    flat = np.linalg.norm(np.cross(b - a, c - a), axis=-1) <= THIN * edges**2
    if flat.any():
        raise ValueError(f"has {np.count_nonzero(flat)} triangles without area; remesh it in a mesh program")
    volume = np.einsum("ti,ti->", a - points[0], np.cross(b - points[0], c - points[0]))
    return Surface(points, triangles if volume > 0.0 else triangles[:, ::-1])
