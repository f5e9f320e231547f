"""Read the files of a run, which may come from elsewhere: each is bounded, and one that is not sound is said to be."""

from __future__ import annotations

import io
import json
import math
import struct
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any
from zipfile import ZIP_STORED, BadZipFile, ZipFile, ZipInfo

import numpy as np

from pneumorph.errors import ProblemError, clipped
from pneumorph.problem.reading import open_plain, read_bytes

MOST_ARRAYS = 400_000_000
"""Largest file of arrays, in bytes: a checkpoint of a million elements has less."""

MOST_LINES = 50_000_000
"""Largest history, in bytes: it has about two thousand a design."""

MOST_RESULT = 5_000_000
"""Largest ``result.json``, in bytes."""

_WRONG = (
    BadZipFile, EOFError, KeyError, MemoryError, OSError, OverflowError, RecursionError, RuntimeError, SyntaxError,
    TypeError, ValueError, struct.error,
)  # fmt: skip


@contextmanager
def reporting_damage(path: Path, fix: str = "run the design again") -> Iterator[None]:
    """Raise ProblemError, one line, where the contents of a run's file are not what they should be."""
    try:
        yield
    except FileNotFoundError:
        raise ProblemError(f"{path}: there is no such file; check the path") from None
    except _WRONG as error:
        words = f"{error} is missing" if isinstance(error, KeyError) else getattr(error, "strerror", None) or str(error)
        raise ProblemError(f"{path}: is damaged ({clipped(words, 150)}); {fix}") from None


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """All arrays of an .npz file as pneumorph writes it; ProblemError if it is missing or damaged.

    Nothing is unpacked or unpickled, so that no more is read than the file has.
    """
    with reporting_damage(path), open_plain(path, MOST_ARRAYS) as file, ZipFile(file) as archive:
        members = {info.filename: info for info in archive.infolist()}
        size = path.stat().st_size
        if len(members) < len(archive.infolist()) or sum(info.file_size for info in members.values()) > size:
            raise ValueError("it has more in it than its size")
        return {name.removesuffix(".npy"): _array(archive, info) for name, info in members.items()}


def _array(archive: ZipFile, info: ZipInfo) -> np.ndarray:
    if info.flag_bits & 1:
        raise ValueError(f"{info.filename} is encrypted")
    if info.compress_type != ZIP_STORED:
        raise ValueError(f"{info.filename} is compressed")
    content = archive.read(info)
    stream = io.BytesIO(content)
    version = np.lib.format.read_magic(stream)
    if version not in ((1, 0), (2, 0)):
        raise ValueError(f"{info.filename} is of an unknown version")
    header = np.lib.format.read_array_header_1_0 if version == (1, 0) else np.lib.format.read_array_header_2_0
    shape, fortran, dtype = header(stream)
    if dtype.kind not in "biufU":
        raise ValueError(f"{info.filename} is neither numbers nor text")
    count = math.prod(shape)
    if any(length < 0 for length in shape) or count * dtype.itemsize != len(content) - stream.tell():
        raise ValueError(f"{info.filename} has not the size of its shape")
    if count == 0:
        return np.zeros(shape, dtype.newbyteorder("="))
    flat = np.frombuffer(content, dtype, count, stream.tell()).astype(dtype.newbyteorder("="))
    return flat.reshape(shape, order="F" if fortran else "C")


def read_json(path: Path) -> Any:
    """The content of a JSON file."""
    return json.loads(read_bytes(path, MOST_RESULT).decode("utf-8"))


def complete_lines(path: Path) -> list[str]:
    """The complete lines of a file; an incomplete last one is left out. No line where there is no file."""
    try:
        text = read_bytes(path, MOST_LINES).decode("utf-8", errors="replace")
    except FileNotFoundError:
        return []
    return text.split("\n")[:-1]
