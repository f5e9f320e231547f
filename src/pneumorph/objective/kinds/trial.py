"""A user's code, tried in a process of its own: whatever it does, it ends, and takes no other program with it."""

from __future__ import annotations

import contextlib
import json
import math
import os
import signal
import subprocess
import sys
import threading
import traceback
from collections.abc import Callable
from dataclasses import asdict, dataclass
from functools import lru_cache
from pathlib import Path

from pneumorph.processes import end_with_input, program, python, temporary_folder, wait

if sys.platform != "win32":
    import resource

FILE = "<objective>"

PROCESSOR, WALL = 3, 20
"""Seconds of processor time, which do not depend on what else the machine does, and on the clock."""

MEMORY = 2_000_000_000
"""Bytes that the code may take, where the system limits them."""

STARTING = 300
"""Seconds in which the process has loaded what the code is given."""

ASKED, FOUND = "asked.json", "found.json"

CHILD = "from pneumorph.objective.kinds import custom, trial; trial.main(custom.shape_of)"


@dataclass(frozen=True)
class Asked:
    """What is tried: the code, the name of its function, and what it is given."""

    code: str
    function: str
    sections: int
    chambers: tuple[str, ...]
    obstacles: tuple[str, ...]


@dataclass(frozen=True)
class Fault:
    """What is wrong: with the "code" or its "function", as a clause."""

    key: str
    words: str


@lru_cache(64)
def fault_of(asked: Asked) -> Fault | None:
    """What is wrong with a user's function; None if it returns one real number."""
    with temporary_folder() as folder:
        (folder / ASKED).write_text(json.dumps({**asdict(asked), "path": sys.path}), encoding="utf-8")
        try:
            with program(python("-c", CHILD, str(folder))) as process:
                wait(process, STARTING + WALL)
            status = process.returncode
        except subprocess.TimeoutExpired:
            return _too_long()
        try:
            answer = json.loads((folder / FOUND).read_text(encoding="utf-8"))
        except (OSError, ValueError):
            return _ended(status)
    return None if answer is None else Fault(*answer)


def _too_long() -> Fault:
    return Fault("code", f"takes more than {PROCESSOR} s of processor time to load, or waits; make it end sooner")


def _ended(status: int) -> Fault:
    """Why there is no answer, by the exit status."""
    # In other systems there are no such signals, and the process ends itself.
    if -status in _ALARMS or status == _LATE:
        return _too_long()
    return Fault("code", f"ends the process in which it is loaded (status {status}); fix the code there")


_LATE = 75
"""Exit status of a process that ended itself; none that Python or a signal gives (EX_TEMPFAIL of sysexits.h)."""
_ALARMS: tuple[int, ...] = () if sys.platform == "win32" else (signal.SIGXCPU, signal.SIGALRM)


def main(shape_of: Callable[[Asked], tuple[str, str] | None]) -> None:
    """Try what the folder asks for that the argument of the program names, and write there what is found."""
    end_with_input()
    folder = Path(sys.argv[1])
    given = json.loads((folder / ASKED).read_text(encoding="utf-8"))
    sys.path[:] = given.pop("path")
    asked = Asked(**given)
    _limit()
    answer = None
    try:
        answer = shape_of(asked)
    except BaseException as error:
        answer = "code", words_of(error)
    text = json.dumps(answer)
    (folder / "part").write_text(text, encoding="utf-8")
    (folder / "part").rename(folder / FOUND)
    # What the code may have left behind, such as threads, is not waited for.
    os._exit(0)


def words_of(error: BaseException) -> str:
    """An error in a user's code as a clause that names its line."""
    if isinstance(error, MemoryError):
        return f"takes more than {MEMORY / 1e9:g} GB of memory; make it take less"
    where = [frame.lineno for frame in traceback.extract_tb(error.__traceback__) if frame.filename == FILE]
    line = where[-1] if where else getattr(error, "lineno", None)
    at = f" in line {line}" if line else ""
    words = " ".join(str(error).split())
    return f"{type(error).__name__}{at} ({words[:200]}); fix the code there"


def _limit() -> None:
    """Limit time and memory from here on, also of code that is not Python's own."""
    threading.Thread(target=_end_after, args=(WALL,), daemon=True).start()
    if sys.platform == "win32":
        return
    signal.setitimer(signal.ITIMER_REAL, WALL)
    used = resource.getrusage(resource.RUSAGE_SELF)
    _lower(resource.RLIMIT_CPU, math.ceil(used.ru_utime + used.ru_stime) + PROCESSOR)
    with contextlib.suppress(OSError):
        pages = int(Path("/proc/self/statm").read_text().split()[0])
        _lower(resource.RLIMIT_AS, pages * resource.getpagesize() + MEMORY)


def _lower(kind: int, limit: int) -> None:
    if sys.platform == "win32":
        return
    soft, hard = resource.getrlimit(kind)
    known = [each for each in (soft, hard, limit) if each != resource.RLIM_INFINITY]
    with contextlib.suppress(OSError, ValueError):
        resource.setrlimit(kind, (min(known), hard))


def _end_after(seconds: float) -> None:
    threading.Event().wait(seconds)
    os._exit(_LATE)
