"""Ask whether code in a file from elsewhere may run, and show what would run."""

from __future__ import annotations

import sys
from collections.abc import Sequence

from pneumorph.doing import silent
from pneumorph.errors import printable
from pneumorph.problem import Code, Trust

YES = ("y", "yes")


def asking(trusted: bool) -> Trust:
    """Trust for a command: what its option says, or else what whoever sits at the terminal answers."""
    return True if trusted else _ask


def _ask(where: str, codes: Sequence[Code]) -> bool:
    """Show code that is new, and ask whether it may run; no where nobody can answer."""
    if not (sys.stdin.isatty() and sys.stderr.isatty()):
        return False
    for code in codes:
        print(f"{printable(where)}: {code.key}, of which {printable(code.function)} is called:", file=sys.stderr)
        for number, line in enumerate(code.text.splitlines(), start=1):
            print(f"{number:5d}  {_shown(line)}", file=sys.stderr)
    print(
        "This Python code comes with the file, and can do on this machine whatever you can. Run it now, and in future "
        "without asking? [y/N] ",
        end="",
        file=sys.stderr,
        flush=True,
    )
    with silent():
        return sys.stdin.readline().strip().lower() in YES


def _shown(line: str) -> str:
    """A line of code with its spaces, and with what would hide something from the reader escaped."""
    return "".join(part if part == " " else printable(part) or repr(part)[1:-1] for part in line)
