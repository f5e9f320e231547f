"""Whose code is run: that of problem files and runs from elsewhere only once the user has agreed to it.

An objective of kind "custom" is Python code, and can do whatever its user can. The first time a piece of code comes in
a file, `admit` has somebody asked. A fingerprint of what was agreed to is kept in the user's configuration directory,
so that the same code is not asked about again, in whatever file it is. Problems made in Python, and texts given
directly, are their author's own.
"""

from __future__ import annotations

import contextlib
import hashlib
import json
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

import platformdirs

from pneumorph.errors import ProblemError, printable
from pneumorph.problem.objectives import Custom
from pneumorph.problem.reading import read_bytes

if TYPE_CHECKING:
    from pneumorph.problem.whole import Problem

MOST_KEPT = 10_000_000
"""Bytes of the list of fingerprints."""


@dataclass(frozen=True)
class Code:
    """Python code in a problem.

    Attributes
    ----------
    key : of its table in the problem.
    function : name of the function that is called.
    text : the code.
    """

    key: str
    function: str
    text: str

    @property
    def fingerprint(self) -> str:
        """The same for the same code and function, and no other pair has it."""
        # Not joined: where one of several texts ends must not be a matter of opinion.
        return hashlib.sha256(json.dumps({"function": self.function, "text": self.text}).encode()).hexdigest()


Trust = bool | Callable[[str, Sequence[Code]], bool]
"""Whether code is trusted, or a function that is asked: with what names the file, and the code that is new in it."""


def admit(codes: Sequence[Code], where: str, trust: Trust) -> None:
    """Let the code of problems from a file pass, if it is agreed to.

    Raises
    ------
    ProblemError
        If nobody has agreed to it; one line that names the file and the key.
    """
    known = _kept() if codes else set()
    new = list({code.fingerprint: code for code in codes if code.fingerprint not in known}.values())
    if not new:
        return
    if not (trust if isinstance(trust, bool) else trust(where, new)):
        first, more = new[0], f" (and {len(new) - 1} more)" if len(new) > 1 else ""
        raise ProblemError(
            f"{where}: {first.key}: is Python code of {len(first.text.splitlines())} lines that would run with all "
            f"your rights{more}; read it, then add --trust, or trust=True in Python"
        )
    keep(new, where)


def codes_of(problem: Problem) -> list[Code]:
    """The code in a problem."""
    return [
        Code(f"task[{number}].objective.code", task.objective.function, task.objective.code)
        for number, task in enumerate(problem.task)
        if isinstance(task.objective, Custom)
    ]


def keep(codes: Sequence[Code], where: str) -> None:
    """Remember that code is agreed to; where the configuration directory cannot be written, it is asked again."""
    missing = {code.fingerprint for code in codes} - _kept()
    path = _file()
    if not missing or path is None:
        return
    lines = "".join(f"{fingerprint}  {printable(where)}\n" for fingerprint in sorted(missing))
    with contextlib.suppress(OSError):
        path.parent.mkdir(parents=True, exist_ok=True, mode=0o700)
        # A last line that somebody has edited, or that was not written in full, is not continued.
        begin = "" if _ends_a_line(path) else "\n"
        handle = os.open(path, os.O_WRONLY | os.O_CREAT | os.O_APPEND, 0o600)
        try:
            os.write(handle, f"{begin}{lines}".encode(errors="backslashreplace"))
        finally:
            os.close(handle)


def _kept() -> set[str]:
    """The fingerprints that are remembered."""
    path = _file()
    try:
        text = "" if path is None else read_bytes(path, MOST_KEPT).decode("utf-8", errors="replace")
    except OSError:
        return set()
    return {line.split()[0] for line in text.splitlines() if line.strip()}


def _ends_a_line(path: Path) -> bool:
    """Whether a file is missing, empty, or ends with the end of a line."""
    try:
        return read_bytes(path, MOST_KEPT)[-1:] in (b"", b"\n")
    except FileNotFoundError:
        return True


def _file() -> Path | None:
    """Where fingerprints are kept: ``trusted`` in the user's configuration directory; None without a home."""
    try:
        folder = platformdirs.user_config_path("pneumorph", appauthor=False, roaming=True)
    except RuntimeError:
        return None
    # Older versions of platformdirs answer with "~".
    return folder / "trusted" if folder.is_absolute() else None
