"""`pneumorph new`: write a commented problem file to start from."""

from __future__ import annotations

import inspect
from collections.abc import Callable, Sequence
from pathlib import Path
from shlex import quote

from pneumorph import bodies
from pneumorph.bodies import Start
from pneumorph.errors import ProblemError
from pneumorph.problem.starts import KINDS, text_of

BODIES: dict[str, Callable[..., Start]] = {
    "pneunet": bodies.pneunet,
    "fast-pneunet": bodies.fast_pneunet,
    "dome": bodies.dome,
    "cup": bodies.cup,
    "bellows": bodies.bellows,
    "hand": bodies.hand,
    "half-round": bodies.half_round,
}
"""Kinds that have sizes."""


def new(name: Path, kind: str, sizes: Sequence[str] = ()) -> None:
    """Write the problem file of a kind, and the STEP file of its body where it has one; files that exist stay.

    Parameters
    ----------
    name : Path
        Of the problem file; ".toml" is added.
    kind : str
        One of `KINDS` and `BODIES`.
    sizes : sequence of "key=value"
        Of a body of `BODIES`.

    Raises
    ------
    ProblemError
        If there is no such kind or size, there is a file of this name already, or it cannot be written.
    """
    if kind not in (*KINDS, *BODIES):
        raise ProblemError(f'--kind: "{kind}" is not known; use one of {", ".join((*KINDS, *BODIES))}')
    if sizes and kind in KINDS:
        raise ProblemError(f'--size: is for {", ".join(BODIES)}; change the file of a "{kind}" instead')
    start = Start(text_of(kind)) if kind in KINDS else _start(kind, sizes)
    path = start.write(name)
    print(f"written to {path}; change it, then: pneumorph check {quote(str(path))}")


def _start(kind: str, sizes: Sequence[str]) -> Start:
    """What a kind starts from, with sizes as "key=value"."""
    known = inspect.signature(BODIES[kind]).parameters
    given: dict[str, str | int] = {}
    for size in sizes:
        key, equals, value = size.partition("=")
        if not equals or key not in known:
            raise ProblemError(f"--size {size}: is not a size of a {kind}; use one of {', '.join(known)}, as wall=2mm")
        counted = isinstance(known[key].default, int) and value.isascii() and value.isdigit()
        given[key] = int(value[:9]) if counted else value
    try:
        return BODIES[kind](**given)
    except ProblemError as error:
        raise ProblemError(f"--size {error}") from None
