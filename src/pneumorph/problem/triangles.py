"""Closed surfaces that tables take from STL files, and keep as text."""

from __future__ import annotations

from typing import Any

from pydantic import ValidationInfo

from pneumorph.cad import stl
from pneumorph.errors import short
from pneumorph.problem.beside import contents_of, file_of, stored
from pneumorph.problem.table import InvalidKey


def with_triangles(data: Any, info: ValidationInfo) -> Any:
    """A table with what its `file` contains as `triangles`.

    Raises
    ------
    InvalidKey
        If it is no file with a closed surface, or `triangles` are given too.
    """
    path = file_of(data, info, "triangles", 'an STL file; write e.g. file = "part.stl"')
    if path is None:
        return data
    content = contents_of(path, stl.MOST_BYTES)
    try:
        surface = stl.read_stl(content)
    except ValueError as error:
        raise InvalidKey("file", f"{short(path, 120)} {error}") from None
    return stored(data, triangles=stl.pack(surface))
