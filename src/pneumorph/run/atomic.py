"""Write files so that an interruption leaves the old content or the new one, never a mixture."""

import io
import os
from collections.abc import Mapping
from pathlib import Path
from zipfile import BadZipFile

import numpy as np

from pneumorph.errors import ProblemError


def write_bytes(path: Path, content: bytes) -> None:
    """Replace the file at `path` in one step, once the new content is on disk."""
    temporary = path.with_name(f".{path.name}.new")
    with temporary.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())
    os.replace(temporary, path)


def write_arrays(path: Path, arrays: Mapping[str, np.ndarray]) -> None:
    """Replace the .npz file at `path` in one step."""
    content = io.BytesIO()
    np.savez(content, allow_pickle=False, **arrays)
    write_bytes(path, content.getvalue())


def read_arrays(path: Path) -> dict[str, np.ndarray]:
    """All arrays of an .npz file; ProblemError if it is missing or damaged."""
    try:
        with np.load(path, allow_pickle=False) as stored:
            return {name: stored[name] for name in stored.files}
    except FileNotFoundError:
        raise ProblemError(f"{path}: there is no such file; check the path") from None
    except (BadZipFile, EOFError, OSError, ValueError) as error:
        raise ProblemError(f"{path}: is damaged ({error}); run the design again") from None


def append_line(path: Path, line: str) -> None:
    """Append a line by a single write: an interruption leaves all of it, an incomplete last line, or nothing."""
    handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o644)
    try:
        os.write(handle, f"{line}\n".encode())
        os.fsync(handle)
    finally:
        os.close(handle)


def complete_lines(path: Path) -> list[str]:
    """The complete lines of a file; an incomplete last one is left out."""
    text = path.read_bytes().decode("utf-8", errors="replace") if path.exists() else ""
    return text.split("\n")[:-1]
